"""Inputs, stores and compiled programs that were cut short or have flipped bits."""

import pathlib
import random
import shutil
from collections.abc import Iterator

import numpy as np
import xarray

from experiments.fault_cases import ENVIRONMENT, STUDY, run
from experiments.fault_places import clock_set_back, one_line

READERS = {
    "log.csv": ("predict", "seen.json", "log.csv", "--horizon", "5", "--out", "out.csv"),
    "seen.json": ("predict", "seen.json", "log.csv", "--horizon", "5", "--out", "out.csv"),
    "diagnosis.json": ("export", "ml.json", "--to", "table", "--diagnosis", "diagnosis.json", "--out", "out.csv"),
    "study.toml": ("sweep", "study.toml", "--trial", "0", "--out", "out"),
}
"""A file, and a command that reads it."""


def damaged(content: bytes, moments: random.Random) -> bytes:
    """Cut short, or with one to eight bits flipped."""
    if moments.random() < 0.5:
        return content[: moments.randrange(len(content))]
    changed = bytearray(content)
    for _ in range(moments.randint(1, 8)):
        changed[moments.randrange(len(changed))] ^= 1 << moments.randrange(8)
    return bytes(changed)


def damages(base: pathlib.Path, folder: pathlib.Path, tries: int, seed: int) -> Iterator[tuple]:
    """A row for each kind of file."""
    moments = random.Random(seed)
    (base / "diagnosis.json").write_text('{"schema": "jaxident.diagnosis/2", "causes": []}\n')
    for name, words in READERS.items():
        yield _inputs(name, words, base, folder / "inputs", tries, moments)
    yield from _stores(folder / "stores", tries, moments)
    yield _cache(base, folder / "cached", max(tries // 2, 3), moments)
    yield from clock_set_back(base, folder / "clock")


def _inputs(name: str, words, base: pathlib.Path, place: pathlib.Path, tries: int, moments) -> tuple:
    """Damaged input: it is read, or refused in one line, and then nothing is written."""
    told: set[str] = set()
    good = refused = 0
    for _ in range(tries):
        shutil.rmtree(place, ignore_errors=True)
        shutil.copytree(base, place)
        (place / name).write_bytes(damaged((base / name).read_bytes(), moments))
        code, _, err = run(words, place)
        unwritten = not (place / "out.csv").exists()
        fine = code == 0 or (code in (1, 2) and one_line(err) and unwritten)
        good, refused = good + fine, refused + (code != 0)
        if not fine:
            told.add(f"code {code}: {err.strip()[-300:]}")
    return "cut or flipped", name, tries, good, "; ".join(sorted(told)) or f"{refused} refused, the others read"


def _stores(place: pathlib.Path, tries: int, moments: random.Random) -> Iterator[tuple]:
    """A finished store, any file of it damaged: the next call mends it to the same arrays, or says that it cannot."""
    place.mkdir()
    (place / "study.toml").write_text(STUDY)
    words = ("sweep", "study.toml", "--out", "s")
    run(words, place)
    shutil.copytree(place / "s", place / "whole")
    with xarray.open_zarr(place / "whole" / "trials.zarr") as opened:
        whole = opened.load()
    files = sorted(path.relative_to(place / "whole") for path in (place / "whole").rglob("*") if path.is_file())
    good = mended = 0
    told: set[str] = set()
    for _ in range(tries):
        shutil.rmtree(place / "s")
        shutil.copytree(place / "whole", place / "s")
        name = moments.choice([name for name in files if (place / "whole" / name).stat().st_size])
        (place / "s" / name).write_bytes(damaged((place / "whole" / name).read_bytes(), moments))
        code, _, err = run(words, place)
        fine = one_line(err) if code else _same(place / "s" / "trials.zarr", whole)
        good, mended = good + fine, mended + (code == 0)
        if not fine:
            told.add(f"{name}: code {code}: {err.strip()[-300:]}")
    yield "cut or flipped", "store", tries, good, "; ".join(sorted(told)) or f"{mended} mended, the others refused"


def _same(path: pathlib.Path, whole: xarray.Dataset) -> bool:
    with xarray.open_zarr(path) as found:
        return all(np.array_equal(found[name], whole[name], equal_nan=True) for name in whole)


def _cache(base: pathlib.Path, place: pathlib.Path, tries: int, moments: random.Random) -> tuple:
    """Compiled programs, every one of them damaged: the same result, as if there were no cache."""
    shutil.copytree(base, place)
    cache = place / "cache"
    words = ("identify", "log.csv", "--method", "key-term-least-squares", "--out", "out.json")
    environment = ENVIRONMENT | {"JAXIDENT_CACHE": str(cache)}
    run(words, place, env=environment)
    whole, good = (place / "out.json").read_bytes(), 0
    shutil.copytree(cache, place / "cache_whole")
    told: set[str] = set()
    for _ in range(tries):
        for path in (place / "cache_whole").rglob("*"):
            if path.is_file() and path.stat().st_size:
                (cache / path.relative_to(place / "cache_whole")).write_bytes(damaged(path.read_bytes(), moments))
        (place / "out.json").unlink(missing_ok=True)
        code, _, err = run(words, place, env=environment)
        fine = code == 0 and (place / "out.json").read_bytes() == whole
        good += fine
        if not fine:
            told.add(f"code {code}: {err.strip()[-300:]}")
    return "cut or flipped", "all of the cache", tries, good, "; ".join(sorted(told))

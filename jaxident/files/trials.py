"""The store of a study's trials, written chunk by chunk: killed at any moment, it goes on where it was.

    DIR/study.json          what the trials are of: study, settings, versions
    DIR/.trials.zarr        the trials while some are missing; takes the name trials.zarr when none is
    DIR/.chunks/N.json      checksums of chunk N's files, written after them: a chunk without is not there

Every file appears whole or not at all, and holds neither time nor place: a store that was interrupted ends equal to
one that was not.
"""

import contextlib
import fcntl
import hashlib
import json
import os
import pathlib
import shutil
import tempfile
from collections.abc import Iterator
from typing import Any, NamedTuple

import xarray
import zarr

from jaxident.effects.catalogue import CATALOGUE
from jaxident.errors import InputError, WorkError
from jaxident.files.atomic import Target, explained, make_folder, write_text
from jaxident.files.json_text import format_json, read_json
from jaxident.study.dataset import attributes, coordinates, describe, further_axes, layout, versions
from jaxident.study.design import Study
from jaxident.study.engine import Piece, chunk_shape, chunks
from jaxident.study.trial import Outcome

SCHEMA = "jaxident.study/1"
DONE, UNDER_WAY = "trials.zarr", ".trials.zarr"
KEPT = "the chunks written so far are kept, and the same command goes on with them"
TRIALS_HELP = "give another folder with --out, or delete this one"


class Store(NamedTuple):
    """An open store: its folder, its study and the study's chunks."""

    folder: pathlib.Path
    study: Study
    pieces: list[Piece]


@contextlib.contextmanager
def opened(study: Study, folder: Target) -> Iterator[Store]:
    """The store of a study in a folder, made where there is none; one process at a time.

    InputError where the folder cannot be written or holds another study, other settings, another version; WorkError
    where study.json is damaged or another process writes there.
    """
    place = pathlib.Path(folder)
    make_folder(folder)
    with _alone(place):
        _check_same(study, place)
        with explained(place, KEPT):
            _lay_out(study, place)
            (place / ".chunks").mkdir(exist_ok=True)
        yield Store(place, study, chunks(study))


def missing(store: Store) -> tuple[list[int], list[int]]:
    """Numbers of the chunks that are still to be computed, and those of them that were there and are damaged."""
    todo, damaged = [], []
    with explained(store.folder):
        for number in range(len(store.pieces)):
            marker = _marker(store, number)
            if not marker.exists():
                todo.append(number)
            elif marker.read_text("utf-8") != _checksums(store, number):
                todo.append(number)
                damaged.append(number)
    return todo, damaged


def write_chunk(store: Store, number: int, outcome: Outcome) -> None:
    """Put a chunk in its place, then its checksums. WorkError where the disk is full: what was there stays."""
    with explained(store.folder, KEPT):
        group = zarr.open_group(store.folder / UNDER_WAY, mode="r+", zarr_format=2, use_consolidated=False)
        for name in further_axes(store.study):
            array: Any = group[name]
            cut = store.pieces[number].cut
            array[cut + (slice(None),) * (array.ndim - len(cut))] = getattr(outcome, name)
        text = _checksums(store, number)
    write_text(_marker(store, number), text)


def finish(store: Store) -> pathlib.Path:
    """Give the store its final name; returns it."""
    with explained(store.folder):
        os.rename(store.folder / UNDER_WAY, store.folder / DONE)
    return store.folder / DONE


def open_trials(path: Target) -> xarray.Dataset:
    """The trials of a finished store, read when they are used."""
    return xarray.open_zarr(path, chunks=None)


@contextlib.contextmanager
def _alone(folder: pathlib.Path) -> Iterator[None]:
    """Hold the folder's lock, which the system takes back from a process that dies."""
    with explained(folder), open(folder / ".lock", "w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise WorkError(f"{folder}: another sweep is writing here; wait for it, or give another folder") from None
        yield


def _check_same(study: Study, folder: pathlib.Path) -> None:
    """Write study.json, or compare it with what would be written."""
    path = folder / "study.json"
    ours = {"schema": SCHEMA, "versions": versions(), "study": describe(study)}
    ours = json.loads(json.dumps(ours))
    if not path.exists():
        if (folder / DONE).exists() or (folder / UNDER_WAY).exists():
            raise InputError(f"{folder}: holds trials without study.json, which says of what; {TRIALS_HELP}")
        write_text(path, format_json(ours))
        return
    try:
        theirs = read_json(path)
    except InputError as error:
        raise WorkError(f"{error}: damaged, so nobody knows what its trials are of; {TRIALS_HELP}") from None
    unlike = _first_difference(completed(theirs), ours, "")
    if unlike is not None:
        key, there, here = unlike
        raise InputError(f"{folder}: holds the trials of another study: {key} is {there} there, {here} here; "
                         f"{TRIALS_HELP}")  # fmt: skip


def completed(content: Any) -> Any:
    """A content of study.json with every effect's parameters: those that a version before did not have are neutral."""
    if isinstance(content, list):
        return [completed(each) for each in content]
    if not isinstance(content, dict):
        return content
    neutral = {name: CATALOGUE[name].neutral() for name in content if name in CATALOGUE}
    return {
        key: neutral[key] | own if key in neutral and isinstance(own, dict) else completed(own)
        for key, own in content.items()
    }


def _first_difference(there: Any, here: Any, key: str) -> tuple[str, str, str] | None:
    """The first key at which two JSON contents differ, with what stands there in either."""
    if isinstance(there, dict) and isinstance(here, dict):
        for name in [*here, *(name for name in there if name not in here)]:
            found = _first_difference(there.get(name), here.get(name), f"{key}.{name}" if key else name)
            if found:
                return found
        return None
    return None if there == here else (key, _short(there), _short(here))


def _short(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 60 else text[:57] + "..."


def _lay_out(study: Study, place: pathlib.Path) -> None:
    """Bring all files but the chunks to what they should be; leftovers of a killed write go. A finished store loses its
    name only after what takes room on the disk."""
    path = place / UNDER_WAY
    with tempfile.TemporaryDirectory(prefix=".part-", dir=place) as folder:
        fresh = pathlib.Path(folder) / "trials.zarr"
        _write_skeleton(study, fresh)
        if (place / DONE).exists():
            os.rename(place / DONE, path)
        for source in sorted(entry for entry in fresh.rglob("*") if entry.is_file()):
            target = path / source.relative_to(fresh)
            target.parent.mkdir(parents=True, exist_ok=True)
            if not target.is_file() or target.read_bytes() != source.read_bytes():
                os.replace(source, target)
    for left in [*path.rglob("*.partial"), *place.glob(".*.part")]:
        left.unlink()
    for left in place.glob(".part-*"):
        shutil.rmtree(left)


def _write_skeleton(study: Study, path: pathlib.Path) -> None:
    """The store without its chunks: coordinates, attributes, shapes. Version 2 of the format, which knows text."""
    coordinates(study).to_zarr(path, mode="w", zarr_format=2, consolidated=False)
    group = zarr.open_group(path, mode="r+", zarr_format=2)
    for name, (shape, kind) in layout(study).items():
        group.create_array(
            name,
            shape=shape,
            chunks=chunk_shape(study) + shape[len(study.axes) :],
            dtype=kind,
            fill_value=None if kind.kind == "i" else float("nan"),
            attributes={"_ARRAY_DIMENSIONS": [*study.axes, *further_axes(study)[name]], **attributes(name)},
            config={"write_empty_chunks": True},
        )
    zarr.consolidate_metadata(path, zarr_format=2)


def _marker(store: Store, number: int) -> pathlib.Path:
    return store.folder / ".chunks" / f"{number}.json"


def _checksums(store: Store, number: int) -> str:
    """SHA-256 of each file of a chunk as JSON text; null for one that is not there."""
    sums: dict[str, str | None] = {}
    size = chunk_shape(store.study)
    index = [part.start // length for part, length in zip(store.pieces[number].cut, size, strict=True)]
    for name, further in further_axes(store.study).items():
        key = ".".join(map(str, index + [0] * len(further)))
        path = store.folder / UNDER_WAY / name / key
        sums[name] = hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else None
    return format_json(sums)

"""Does a study that is killed at any moment end with the same arrays?

    python -m experiments.kill_and_resume [--kills 20] [--soak SECONDS]

Runs a small study once without interruption, then again and again in fresh folders, each time ended by SIGKILL at a
random moment and resumed by the same command. Counts the stores whose arrays equal the first one's, bit for bit.

With `--soak` it does so until the time is over, and a resumed study is ended again and again, by SIGKILL or SIGTERM,
until it comes to its end by itself. It also counts finished chunks that a kill lost, and hidden files that are left.
"""

import argparse
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from typing import NamedTuple

import numpy as np
import xarray

STUDY = """
name = "killed"
seeds = {seeds}
noise = [1e-6, 1e-5, 1e-4]
samples = [{samples}]
hold = 4
chunk = {chunk}
robots = [{{ model = "published" }}]
estimators = {estimators}
"""
LONG = STUDY.format(seeds=600, samples=100, chunk=20, estimators='["batch", "recursive"]')
SHORT = STUDY.format(seeds=200, samples=50, chunk=10, estimators='["recursive"]')
"""What a soak runs: a study that is over soon, so that many end."""


def sweep(study: pathlib.Path, out: pathlib.Path) -> subprocess.Popen:
    """Start the study in a process of its own."""
    words = [sys.executable, "-m", "jaxident", "sweep", str(study), "--out", str(out)]
    return subprocess.Popen(words, stdout=subprocess.DEVNULL)


def finish(study: pathlib.Path, out: pathlib.Path) -> float:
    """Run what is missing; seconds taken. SystemExit where the program fails."""
    begin = time.perf_counter()
    if sweep(study, out).wait():
        raise SystemExit(f"{out}: the study did not end")
    return time.perf_counter() - begin


def same(out: pathlib.Path, whole: xarray.Dataset) -> bool:
    """Whether a store's arrays equal the uninterrupted ones, NaN included."""
    with xarray.open_zarr(out / "trials.zarr") as found:
        return all(np.array_equal(found[name], whole[name], equal_nan=True) for name in whole)


class Soak(NamedTuple):
    """What a soak counted."""

    studies: int = 0
    kills: int = 0
    lost_chunks: int = 0
    left_over: int = 0
    different: int = 0


def kept_chunks(out: pathlib.Path) -> set[str]:
    """Names of the chunks whose checksums are written."""
    return {path.name for path in (out / ".chunks").glob("*.json")}


def left_over(out: pathlib.Path) -> int:
    """Hidden files and folders of writers that died."""
    return sum(1 for pattern in (".*.part", ".part-*", "*.partial") for _ in out.rglob(pattern))


def one_soaked(
    study: pathlib.Path, out: pathlib.Path, seconds: float, moments: random.Random, end: float
) -> tuple[int, int]:
    """Kill and resume one study without pause until it ends; kills, and finished chunks that were lost.

    After a kill that came before any new chunk, the next comes later: a machine that became busy would never get to the
    end. After the moment `end` there is no kill.
    """
    kills = lost = 0
    while True:
        before = kept_chunks(out)
        running = sweep(study, out)
        deadly = moments.choice([signal.SIGKILL, signal.SIGTERM])
        try:
            running.wait(moments.uniform(0.3 * seconds, seconds) if time.monotonic() < end else None)
        except subprocess.TimeoutExpired:
            running.send_signal(deadly)
        kills += (code := running.wait()) != 0
        if not (out / "trials.zarr").exists() or code:
            lost += len(before - kept_chunks(out))
        if code == 0:
            return kills, lost
        seconds *= 1.0 if kept_chunks(out) - before else 1.5
        if code not in (-signal.SIGKILL, -signal.SIGTERM, 128 + signal.SIGTERM):
            raise SystemExit(f"{out}: the study ended with {code}")


def soak(study: pathlib.Path, folder: pathlib.Path, whole: xarray.Dataset, seconds: float, options) -> Soak:
    """Soak until the time is over."""
    moments, end, found = random.Random(options.seed), time.monotonic() + options.soak, Soak()
    while time.monotonic() < end:
        out = folder / "soaked"
        kills, lost = one_soaked(study, out, seconds, moments, end)
        found = Soak(
            found.studies + 1,
            found.kills + kills,
            found.lost_chunks + lost,
            found.left_over + left_over(out),
            found.different + (not same(out, whole)),
        )
        shutil.rmtree(out)
        print(found, flush=True)
    return found


def main() -> None:
    """Run, kill, resume, compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0, help="of the moments")
    parser.add_argument("--soak", type=float, metavar="SECONDS", help="kill and resume for so long")
    options = parser.parse_args()
    moments = random.Random(options.seed)
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        study = folder / "study.toml"
        study.write_text(SHORT if options.soak else LONG)
        finish(study, folder / "first")  # compiles
        seconds = finish(study, folder / "whole")
        whole = xarray.open_zarr(folder / "whole" / "trials.zarr").load()
        if options.soak:
            print(soak(study, folder, whole, seconds, options))
            return
        equal = stopped = 0
        for number in range(options.kills):
            out = folder / f"killed_{number}"
            running = sweep(study, out)
            time.sleep(moments.uniform(0.0, seconds))
            running.send_signal(signal.SIGKILL)
            stopped += running.wait() == -signal.SIGKILL
            kept = len(list((out / ".chunks").glob("*.json"))) if out.exists() else 0
            finish(study, out)
            equal += same(out, whole)
            print(f"kill {number + 1}: {kept} chunks kept; equal so far {equal} of {number + 1}", flush=True)
        print(f"{equal} of {options.kills} equal; {stopped} were killed before their end")


if __name__ == "__main__":
    main()

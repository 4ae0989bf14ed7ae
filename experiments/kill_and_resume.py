"""Does a study that is killed at any moment end with the same arrays?

    python -m experiments.kill_and_resume [--kills 20]

Runs a small study once without interruption, then again and again in fresh folders, each time ended by SIGKILL at a
random moment and resumed by the same command. Counts the stores whose arrays equal the first one's, bit for bit.
"""

import argparse
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np
import xarray

STUDY = """
name = "killed"
seeds = 600
noise = [1e-6, 1e-5, 1e-4]
samples = [100]
hold = 4
chunk = 20
robots = [{ model = "published" }]
estimators = ["batch", "recursive"]
"""


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


def main() -> None:
    """Run, kill, resume, compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0, help="of the moments")
    options = parser.parse_args()
    moments = random.Random(options.seed)
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        study = folder / "study.toml"
        study.write_text(STUDY)
        finish(study, folder / "first")  # compiles
        seconds = finish(study, folder / "whole")
        whole = xarray.open_zarr(folder / "whole" / "trials.zarr").load()
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

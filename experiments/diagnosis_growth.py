"""How the time of a diagnosis grows with runs and their length.

    python -m experiments.diagnosis_growth [--out diagnosis_growth.csv]

The published robot without coupling and with `turn_loss`, multilevel inputs at 1/30 s, camera noise of 0.5 mm and
5 mrad. Every size is diagnosed twice: the first time compiles for its shapes. Seconds of the wall clock and of the
processor; compare rows of one run.
"""

import argparse
import dataclasses
import pathlib
import time

import jax
import numpy as np

import jaxident as ji
from experiments.diagonal import PERIOD, ROBOT
from experiments.rows import write_rows
from jaxident.log import Log, join
from jaxident.robot.model import Effect
from jaxident.study.synthetic import excite, simulate_runs

LOSING = dataclasses.replace(ROBOT, effects=(Effect("turn_loss", {"loss": 0.1}),))
SIZES = ((3, 1000), (6, 1000), (12, 1000), (24, 1000), (6, 500), (6, 2000), (6, 4000))


def record(runs: int, samples: int) -> list[Log]:
    """Noisy runs of the robot."""
    parts = []
    for number in range(runs):
        log = excite(jax.random.key(number), "multilevel", samples, PERIOD)
        parts.append(log._replace(run=np.full(samples, number)))
    found = simulate_runs(LOSING, join(parts), noise=(5e-4, 5e-3), key=jax.random.key(99))
    return found.runs()


def main() -> None:
    """One row for each size."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("diagnosis_growth.csv"))
    options = parser.parse_args()
    rows = [["runs", "samples", "first [s]", "compiled [s]", "processor [s]", "verdict", "named"]]
    for runs, samples in SIZES:
        logs, seconds = record(runs, samples), []
        for _ in range(2):
            begin, used = time.perf_counter(), time.process_time()
            found = ji.diagnose(logs)
            seconds.append((time.perf_counter() - begin, time.process_time() - used))
        (first, _), (again, processor) = seconds
        named = " ".join(found.selected)
        rows.append([str(runs), str(samples), *(f"{s:.1f}" for s in (first, again, processor)), found.verdict, named])
        print(" ".join(rows[-1]), flush=True)
    write_rows(options.out, rows)


if __name__ == "__main__":
    ji.start_jax()
    main()

"""How the time of a whole trial grows with samples and with the number of trials.

    python -m experiments.pipeline_growth [--largest 100000] --out pipeline_growth.csv

Whole trials as `jaxident bench` has them: own excitation, simulation, camera noise, start values from 200 rows, both
recursions. Compiled once for each shape; medians of three, of the wall clock and of the processor (all threads). Start
values take the same time whatever the samples: growth with samples is judged by differences from one size to the next.
"""

import argparse
import pathlib
import statistics
import time

import jax

import jaxident as ji
from experiments.rows import write_rows
from jaxident.study.batch import in_parallel
from jaxident.study.bench import TRIAL_SAMPLES, trial
from jaxident.study.engine import BLOCK

ROBOT = ji.load_model("published")
SAMPLES = (250, 500, 1000, 2000, 4000, 8000, 16000)
TRIALS = (100, 1000, 10_000, 100_000)
REPEATS = 3
AT_ONCE = BLOCK["cpu"]
"""Trials of a block, as in studies."""


def measure(samples: int, count: int, block: int) -> tuple[float, float]:
    """Median seconds of `count` trials, by the wall clock and by the processor."""
    keys = [(some,) for some in jax.random.split(jax.random.key(0), (count // block, block))]
    program = jax.jit(jax.vmap(lambda key: trial(ROBOT, key, samples)))
    in_parallel(program, keys[:2])
    seconds = []
    for _ in range(REPEATS):
        begin, used = time.perf_counter(), time.process_time()
        in_parallel(program, keys)
        seconds.append((time.perf_counter() - begin, time.process_time() - used))
    wall, processor = (statistics.median(column) for column in zip(*seconds, strict=True))
    return wall, processor


def main() -> None:
    """One row for each size."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--largest", type=int, default=TRIALS[-1], help="most trials")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("pipeline_growth.csv"))
    options = parser.parse_args()
    sizes = [(samples, 4 * AT_ONCE) for samples in SAMPLES]
    sizes += [(TRIAL_SAMPLES, count) for count in TRIALS if count <= options.largest]
    rows = [["samples", "trials", "wall [us] a trial", "processor [us] a trial", "processor [ns] a trial-sample"]]
    for samples, count in sizes:
        wall, used = measure(samples, count, AT_ONCE)
        row = (1e6 * wall / count, 1e6 * used / count, 1e9 * used / (count * samples))
        rows.append([str(samples), str(count), *(f"{value:.0f}" for value in row)])
        print(" | ".join(rows[-1]), flush=True)
    write_rows(options.out, rows)


if __name__ == "__main__":
    ji.start_jax()
    main()

"""How the time of a diagnosis, of a fit or of a whole trial grows with the size of its data.

    python -m experiments.growth diagnosis [--out growth.csv]
    python -m experiments.growth fit
    python -m experiments.growth pipeline [--largest 100000]

`diagnosis`: the published robot without coupling and with `turn_loss`, multilevel inputs at 1/30 s, camera noise of
0.5 mm and 5 mrad. Every size is diagnosed twice: the first time compiles for its shapes.

`fit`: maximum likelihood of the robot without coupling at 1 mm and 10 mrad of white camera noise, multilevel inputs.
One fit at a time, compiled; medians of five of the processor's seconds. A search takes as many steps as it needs:
beside the time per row stands that per row and step, starter and all.

`pipeline`: whole trials as `jaxident bench` has them: own excitation, simulation, camera noise, start values from 200
rows, both recursions. Compiled once for each shape; medians of three, of the wall clock and of the processor (all
threads). Start values take the same time whatever the samples: judge growth by differences from one size to the next.

Compare rows of one run only: other work on the machine changes all of them.
"""

import argparse
import dataclasses
import pathlib
import statistics
import time
from collections.abc import Callable, Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import jaxident as ji
from experiments import bootstrap_coverage
from experiments.diagonal import PERIOD, ROBOT
from experiments.rows import write_rows
from jaxident.estimation.poses.maximum_likelihood import fit_runs
from jaxident.log import Log, join
from jaxident.parallel import in_parallel
from jaxident.robot.model import Effect
from jaxident.study.bench import TRIAL_SAMPLES, trial
from jaxident.study.engine import BLOCK
from jaxident.study.synthetic import excite, simulate_runs

LOSING = dataclasses.replace(ROBOT, effects=(Effect("turn_loss", {"loss": 0.1}),))
DIAGNOSED = ((3, 1000), (6, 1000), (12, 1000), (24, 1000), (6, 500), (6, 2000), (6, 4000))
"""Runs, and samples of each."""
FITTED = (*((rows, 1) for rows in (500, 1000, 2000, 4000, 8000, 16000, 32000)),)
FITTED += (*((1000, runs) for runs in (2, 4, 8, 16, 32)),)
"""Rows of each run, and runs."""
FITS = 5
SAMPLES = (250, 500, 1000, 2000, 4000, 8000, 16000)
TRIALS = (100, 1000, 10_000, 100_000)
REPEATS = 3
AT_ONCE = BLOCK
"""Trials of a block, as in studies."""


def timed(work: Callable[[], Any]) -> tuple[Any, float, float]:
    """What one call returns, and its seconds by the wall clock and by the processor."""
    begin, used = time.perf_counter(), time.process_time()
    result = jax.block_until_ready(work())
    return result, time.perf_counter() - begin, time.process_time() - used


def diagnosis(_: int) -> Iterator[list[str]]:
    """The header, then one row for each size of a diagnosis."""
    yield ["runs", "samples", "first [s]", "compiled [s]", "processor [s]", "verdict", "named"]
    for runs, samples in DIAGNOSED:
        logs = record(runs, samples)
        (_, first, _), (found, *again) = (timed(lambda logs=logs: ji.diagnose(logs)) for _ in range(2))
        seconds = [f"{s:.1f}" for s in (first, *again)]
        yield [str(runs), str(samples), *seconds, found.verdict, " ".join(found.selected)]


def record(runs: int, samples: int) -> list[Log]:
    """Noisy runs of the robot that loses speed in turns."""
    parts = []
    for number in range(runs):
        log = excite(jax.random.key(number), "multilevel", samples, PERIOD)
        parts.append(log._replace(run=np.full(samples, number)))
    return simulate_runs(LOSING, join(parts), noise=(5e-4, 5e-3), key=jax.random.key(99)).runs()


def fit(_: int) -> Iterator[list[str]]:
    """The header, then one row for each size of a fit."""
    yield ["rows a run", "runs", "processor [ms]", "steps", "[us] a row", "[us] a row and step"]
    program = jax.jit(lambda data: fit_runs(data, jnp.asarray(bootstrap_coverage.D_MAX)))
    white = bootstrap_coverage.NOISES["white"]
    for rows, runs in FITTED:
        data = bootstrap_coverage.record(jax.random.key(2), white, rows, runs)
        steps = int(program(data).steps)
        seconds = statistics.median(timed(lambda data=data: program(data))[2] for _ in range(FITS))
        each = 1e6 * seconds / (rows * runs)
        yield [str(rows), str(runs), f"{1e3 * seconds:.1f}", str(steps), f"{each:.1f}", f"{each / steps:.2f}"]


def pipeline(largest: int) -> Iterator[list[str]]:
    """The header, then one row for each size of a batch of whole trials."""
    yield ["samples", "trials", "wall [us] a trial", "processor [us] a trial", "processor [ns] a trial-sample"]
    robot = ji.load_model("published")
    sizes = [(samples, 4 * AT_ONCE) for samples in SAMPLES]
    sizes += [(TRIAL_SAMPLES, count) for count in TRIALS if count <= largest]
    for samples, count in sizes:
        keys = [(some,) for some in jax.random.split(jax.random.key(0), (count // AT_ONCE, AT_ONCE))]
        program = jax.jit(jax.vmap(lambda key, samples=samples: trial(robot, key, samples)))
        in_parallel(program, keys[:2])
        times = [timed(lambda keys=keys, program=program: in_parallel(program, keys))[1:] for _ in range(REPEATS)]
        wall, used = (statistics.median(column) for column in zip(*times, strict=True))
        row = (1e6 * wall / count, 1e6 * used / count, 1e9 * used / (count * samples))
        yield [str(samples), str(count), *(f"{value:.0f}" for value in row)]


GROWTHS = {growth.__name__: growth for growth in (diagnosis, fit, pipeline)}


def main() -> None:
    """Measure what the command line names, and write its rows."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=GROWTHS)
    parser.add_argument("--largest", type=int, default=TRIALS[-1], help="most trials (pipeline)")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("growth.csv"))
    options = parser.parse_args()
    rows = []
    for row in GROWTHS[options.what](options.largest):
        rows.append(row)
        print(" | ".join(row), flush=True)
    write_rows(options.out, rows)


if __name__ == "__main__":
    ji.start_jax()
    main()

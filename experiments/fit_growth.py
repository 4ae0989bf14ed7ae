"""How the time of a maximum-likelihood fit grows with the length of runs and with their number.

    python -m experiments.fit_growth --out fit_growth.csv

The robot without coupling at 1 mm / 10 mrad of white camera noise, multilevel inputs. One fit at a time, compiled;
medians of five of the processor's seconds. A search takes as many steps as it needs: beside the time per row stands
that per row and step, starter and all.
"""

import argparse
import pathlib
import statistics
import time

import jax
import jax.numpy as jnp

import jaxident as ji
from experiments.bootstrap_coverage import D_MAX, NOISES, record
from experiments.rows import write_rows
from jaxident.estimation.maximum_likelihood import fit_runs

SIZES = [(rows, 1) for rows in (500, 1000, 2000, 4000, 8000, 16000, 32000)]
SIZES += [(1000, runs) for runs in (2, 4, 8, 16, 32)]
REPEATS = 5


def measure(rows: int, runs: int) -> tuple[float, int]:
    """Median seconds of a fit, and steps of its search."""
    data = record(jax.random.key(2), NOISES["white"], rows, runs)
    fit = jax.jit(lambda data: fit_runs(data, jnp.asarray(D_MAX)))
    steps = int(fit(data).steps)
    seconds = []
    for _ in range(REPEATS):
        begin = time.process_time()
        jax.block_until_ready(fit(data))
        seconds.append(time.process_time() - begin)
    return statistics.median(seconds), steps


def main() -> None:
    """One row for each size."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("fit_growth.csv"))
    options = parser.parse_args()
    table = [["rows a run", "runs", "processor [ms]", "steps", "[us] a row", "[us] a row and step"]]
    for rows, runs in SIZES:
        seconds, steps = measure(rows, runs)
        each = 1e6 * seconds / (rows * runs)
        table.append([str(rows), str(runs), f"{1e3 * seconds:.1f}", str(steps), f"{each:.1f}", f"{each / steps:.2f}"])
        print(" | ".join(table[-1]), flush=True)
    write_rows(options.out, table)


if __name__ == "__main__":
    ji.start_jax()
    main()

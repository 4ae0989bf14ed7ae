"""Robots whose effect stands in no catalogue: what does a diagnosis discover, and what does that bring on fresh runs?

    python -m experiments.unlisted --kinds patch castor --seeds 3 --out FOUND.json --page PAGE.html

Six runs of each robot are diagnosed; four fresh ones are predicted 1 s ahead. `achieved`: the part of the nominal
model's squared error, beyond what a model that knows the robot leaves, that the corrected model takes away there.
Robots that FOUND.json holds already are not run again. `experiments/discovered.md` tells what came out.
"""

import argparse
import json
import multiprocessing
import pathlib

from .measure import line, one, table
from .page import picture, write
from .robots import KINDS


def main() -> None:
    """Robots of each kind, some at a time; the rows are written as they come."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=KINDS)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--first", type=int, default=1, help="the first seed")
    parser.add_argument("--size", type=float, default=1.0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--page", type=pathlib.Path)
    parser.add_argument("--picture", type=pathlib.Path)
    options = parser.parse_args()
    rows = json.loads(options.out.read_text()) if options.out.exists() else []
    there = {(row["kind"], row["seed"], row["size"]) for row in rows}
    seeds = range(options.first, options.first + options.seeds)
    jobs = [(kind, seed, options.size) for seed in seeds for kind in options.kinds]
    with multiprocessing.get_context("spawn").Pool(options.jobs) as pool:
        for row in pool.imap_unordered(one, [job for job in jobs if job not in there]):
            rows.append(row)
            options.out.write_text(json.dumps(rows, indent=1))
            print(line(row), flush=True)
    print(table(rows))
    if options.page is not None:
        write(rows, options.page)
    if options.picture is not None:
        picture(rows, options.picture)


if __name__ == "__main__":
    main()

"""Real robots as they are, and with effects injected into the poses of their logs: are these named?

    python -m experiments.withheld.inject --data ../shared/data --robots create_1 husky --out real/cases
    python -m experiments.withheld diagnose --cases real/cases --found real/found
    python -m experiments.withheld collect --found real/found --out experiments/withheld/real

writes a folder for every robot, `real/cases/create_1/real_*`, and for every effect `real/cases/create_1_NAME/`:
`real_*`, logs with the effect, and `sim_*`, untouched logs of the same robot, for `jaxident diagnose --sim`. Even and
odd parts of a log go one to each, so that both share the robot and the day but no row. `none` is the pair without an
effect. Only what the camera does to poses can be injected afterwards; camera latency is `transport_delay` seen from
outside.
"""

import argparse
import json
import pathlib

import numpy as np

import jaxident as ji
from jaxident.log import Log, join

from .real.logs import PARTS, read_robot

SIZES = {
    "none": {},
    "transport_delay": {"delay": 0.15},
    "marker_offset": {"ahead": 0.04, "left": -0.02},
    "heading_offset": {"offset": 0.06},
    "camera_scale": {"difference": 0.04},
    "outliers": {"probability": 0.02, "position": 0.1, "heading": 0.3},
    "frozen_frames": {"probability": 0.08},
}
"""What is injected unless `--sizes` says otherwise; none of it is so large that the log looks broken."""


def inject(log: Log, name: str, size: dict[str, float], rng) -> Log:
    """One run with an effect in its poses; rows without a pose stay without one.

    A delay is rounded to rows of an even log: poses come that many rows late, the first are empty.
    """
    x, y, theta = (np.array(column, float) for column in log.pose)
    seen = np.isfinite(x)
    if name == "transport_delay":
        rows = max(1, round(size["delay"] / float(np.median(np.diff(log.t)))))
        return log._replace(
            **{key: late(column, rows) for key, column in zip(("x", "y", "theta"), (x, y, theta), strict=True)}
        )
    if name == "marker_offset":
        cosine, sine = np.cos(theta), np.sin(theta)
        x = x + size["ahead"] * cosine - size["left"] * sine
        y = y + size["ahead"] * sine + size["left"] * cosine
    elif name == "heading_offset":
        theta = theta + size["offset"]
    elif name == "camera_scale":
        x, y = x * (1.0 + 0.5 * size["difference"]), y * (1.0 - 0.5 * size["difference"])
    elif name == "outliers":
        hit = rng.random(len(x)) < size["probability"]
        draws = rng.normal(size=(3, len(x))) * hit
        x, y = x + size["position"] * draws[0], y + size["position"] * draws[1]
        theta = theta + size["heading"] * draws[2]
    elif name == "frozen_frames":
        x, y, theta = frozen(np.flatnonzero(seen), size["probability"], rng, x, y, theta)
    return log._replace(x=x, y=y, theta=np.mod(theta + np.pi, 2.0 * np.pi) - np.pi)


def late(column: np.ndarray, rows: int) -> np.ndarray:
    """The column `rows` later, NaN before."""
    return np.concatenate([np.full(rows, np.nan), column])[: len(column)]


def frozen(places: np.ndarray, probability: float, rng, *columns: np.ndarray) -> list[np.ndarray]:
    """Columns in which a pose is, with this probability, that of the frame before, which may be frozen itself."""
    kept = np.where(rng.random(len(places)) < probability, 0, np.arange(len(places)))
    source = places[np.maximum.accumulate(kept)]
    copies = [column.copy() for column in columns]
    for copy, column in zip(copies, columns, strict=True):
        copy[places] = column[source]
    return copies


def write_pair(runs: list[Log], name: str, size: dict[str, float], folder: pathlib.Path, seed: int) -> None:
    """Even runs with the effect as real_*, odd ones untouched as sim_*."""
    rng = np.random.default_rng([seed, *name.encode()])
    write(folder, "real", [inject(run, name, size, rng) for run in runs[::2]])
    write(folder, "sim", runs[1::2])


def write(folder: pathlib.Path, label: str, runs: list[Log]) -> None:
    """A file for each run; one for all of them where they are many."""
    folder.mkdir(parents=True, exist_ok=True)
    groups = [runs] if len(runs) > PARTS else [[run] for run in runs]
    for number, group in enumerate(groups, start=1):
        ji.write_log(join(group), folder / f"{label}_{number}.csv.gz")


def main() -> None:
    """Write every robot, and every injection into its logs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--robots", nargs="+", default=["create_1"], help="create_1 to create_5, husky")
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--sizes", type=json.loads, default={}, help='such as {"heading_offset": {"offset": 0.02}}')
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    for robot in options.robots:
        runs = read_robot(options.data, robot)
        write(options.out / robot, "real", runs)
        for name, size in (SIZES | options.sizes).items():
            write_pair(runs, name, size, options.out / f"{robot}_{name}", options.seed)
        print(f"wrote {robot}", flush=True)


if __name__ == "__main__":
    ji.start_jax()
    main()

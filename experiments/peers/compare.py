"""jaxident beside SciPy, jax-sysid, padasip and mujoco.sysid: accuracy, coverage of 95 % intervals, time per fit.

    python -m experiments.peers.compare draw --seeds 20 --out peers/data.npz
    (peers.py in its own environment: see there)
    python -m experiments.peers.compare table --data peers/data.npz --theirs peers/theirs.npz --out peers/table.md

One run of 1000 rows at 1/30 s, multilevel input, the robot without coupling, camera noise with 10 mrad for each mm.
jaxident starts from the data alone and sizes the noise itself; it is timed after a first fit, which compiles.
"""

import argparse
import dataclasses
import pathlib
import time

import jax
import numpy as np

import jaxident as ji
from experiments.diagonal import PERIOD, ROBOT, TRUTH
from jaxident.files.atomic import write_text
from jaxident.robot.excitation import multilevel
from jaxident.robot.noise import Noise

ROWS, GUESS = 1000, 0.5
KEPT = ("method", "record", "found", "half", "ok", "seconds")
NOISE = (2e-4, 1e-3, 5e-3)


def draw(options) -> None:
    """Records of all noise levels one below the other, and the start that the other tools are given."""
    rows = []
    for level in NOISE:
        model = dataclasses.replace(ROBOT, noise=Noise(level, 10.0 * level))
        for seed in range(options.seeds):
            keys = jax.random.split(jax.random.fold_in(jax.random.key(seed), int(1e6 * level)), 3)
            command = multilevel(keys[0], ROWS)
            t = PERIOD * np.arange(ROWS)
            empty = np.zeros(ROWS)
            log = ji.Log(t, np.asarray(command.right), np.asarray(command.left), empty, empty, empty, empty.astype(int))
            seen = ji.simulate(model, log, key=keys[1])
            pose = np.column_stack([seen.x, seen.y, np.unwrap(np.asarray(seen.theta))])
            start = TRUTH * np.exp(GUESS * np.asarray(jax.random.normal(keys[2], TRUTH.shape)))
            sigma = np.array([level, level, 10.0 * level])
            rows.append((np.column_stack(command), pose, start, TRUTH, sigma))
    columns = (np.array(column) for column in zip(*rows, strict=True))
    options.out.parent.mkdir(parents=True, exist_ok=True)
    keyed = dict(zip(("u", "pose", "start", "truth", "sigma"), columns, strict=True))
    np.savez(options.out, **keyed, period=np.array(PERIOD))


def ours(data) -> list[tuple]:
    """jaxident's fits: name, record, estimate (8,), half-width of the interval (8,), ok, seconds."""
    logs = [_log(u, pose, float(data["period"])) for u, pose in zip(data["u"], data["pose"], strict=True)]
    ji.identify(logs[0])  # compiles; the time of that is no fit's
    rows = []
    for number, log in enumerate(logs):
        begin = time.perf_counter()
        found = ji.identify(log)
        seconds = time.perf_counter() - begin
        drive = found.model.dynamics
        estimate = np.concatenate([drive.rate, np.ravel(drive.gain), found.model.dead_zone])
        half = 1.96 * np.sqrt(np.diagonal(found.covariance))[: len(estimate)]
        rows.append(("jaxident", number, estimate, half, bool(found.ok), seconds))
    return rows


def _log(u: np.ndarray, pose: np.ndarray, period: float) -> ji.Log:
    return ji.Log(period * np.arange(len(u)), *u.T, *pose.T, np.zeros(len(u), int))


def table(options) -> None:
    """Relative errors by noise and method: root mean square over seeds and parameters with its standard error."""
    data, theirs = np.load(options.data), np.load(options.theirs)
    rows = ours(data) + list(zip(*(theirs[key] for key in KEPT), strict=True))
    lines = ["| noise [mm] | tool | rms error of rates and gains [%] | of dead zones | worst fit | coverage of 95 % | "
             "failed | seconds a fit |", "|---" * 8 + "|"]  # fmt: skip
    for level in NOISE:
        for name in dict.fromkeys(row[0] for row in rows):
            own = [r for r in rows if r[0] == name and np.isclose(data["sigma"][r[1]][0], level)]
            lines.append(f"| {1e3 * level:g} | {name} | {' | '.join(_cells(own))} |")
    print("\n".join(lines))
    write_text(options.out, "\n".join(lines) + "\n")


def _cells(rows) -> list[str]:
    good = [row for row in rows if row[4]]
    error = 100.0 * np.stack([row[2] / TRUTH - 1.0 for row in good])
    half = 100.0 * np.stack([row[3] for row in good]) / np.abs(TRUTH)
    inside = np.mean(np.abs(error) <= half, axis=1)[np.isfinite(half).all(axis=1)]  # of one record they err together
    spread = 100 * inside.std() / max(1, len(inside)) ** 0.5
    covered = f"{100 * inside.mean():.1f} ± {spread:.1f} %" if len(inside) else "none told"
    worst = np.sqrt(np.mean(error**2, axis=1)).max()
    return [_size(error[:, :6]), _size(error[:, 6:]), f"{worst:.3g} %", covered, str(len(rows) - len(good)),
            f"{np.median([row[5] for row in good]):.2g}"]  # fmt: skip


def _size(error: np.ndarray) -> str:
    squares = np.mean(error**2, axis=1)
    rms = np.sqrt(np.mean(squares))
    return f"{rms:.3g} ± {np.std(squares) / len(squares) ** 0.5 / (2.0 * max(rms, 1e-12)):.1g}"


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    steps = parser.add_subparsers(required=True)
    one = steps.add_parser("draw")
    one.add_argument("--seeds", type=int, default=20)
    one.set_defaults(step=draw)
    two = steps.add_parser("table")
    for name in ("data", "theirs"):
        two.add_argument(f"--{name}", type=pathlib.Path, required=True)
    two.set_defaults(step=table)
    for each in (one, two):
        each.add_argument("--out", type=pathlib.Path, required=True)
    options = parser.parse_args()
    options.step(options)


if __name__ == "__main__":
    ji.start_jax()
    main()

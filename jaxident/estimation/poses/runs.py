"""Runs as rectangles: every run of a log padded to one length, as whole-run estimators map over them."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array, Pose, Rows, Wheels
from jaxident.log import Log
from jaxident.programs import roomy

WINDOW = 200
"""Rows of the windows that the starter fits: long enough for a slow pole, too short for slip to pile up."""
SHORT = 25
"""Rows that room comes in for many short runs. 402 of a Husky's of 40 rows, padded to windows, took four times as long
as without. No other number was tried."""
MANY = 8
"""Runs beyond which short ones get room in SHORT rows. No other number was tried."""
SAME_STEP = 1e-6
"""Steps that differ by less than this, relative to their mean, are one step: sums of a binary fraction."""


class Runs(NamedTuple):
    """Commands and poses of runs, arrays (runs, rows), finite everywhere; a single run where the axis is dropped.

    step [s]: from each row to the next, or one number where all are equal. seen: whether a pose was measured there;
    rows past the end of a shorter run have none. wheels [rad/s], turning: wheel speeds and whether each was measured,
    both `Wheels`; None for logs without.
    """

    step: Any
    command: Wheels
    pose: Pose
    seen: Any
    wheels: Any = None
    turning: Any = None


def stack_runs(log: Log) -> Runs:
    """The runs of a log (NumPy arrays) side by side, poses alone; a command that is missing on a run's last row becomes
    0. `with_wheels` adds wheel speeds."""
    runs = log.runs()
    rows = max(len(run.t) for run in runs)

    def filled(run: Log, column: Array, value: float = 0.0) -> np.ndarray:
        whole = np.full(rows, value)
        whole[: len(run.t)] = column
        return whole

    steps = [np.diff(run.t) for run in runs]
    mean = float(np.mean(np.concatenate(steps)))
    even = all(np.all(np.abs(step - mean) <= SAME_STEP * mean) for step in steps)
    seen = [np.isfinite(run.x) & np.isfinite(run.y) & np.isfinite(run.theta) for run in runs]
    pairs = list(zip(runs, seen, strict=True))
    uneven = [filled(run, np.append(step, mean), mean) for run, step in zip(runs, steps, strict=True)]
    return Runs(
        step=np.asarray(mean) if even else np.stack(uneven),
        command=Wheels(*(np.stack([filled(run, np.nan_to_num(run.command[k])) for run in runs]) for k in (0, 1))),
        pose=Pose(*(np.stack([filled(run, np.where(own, run.pose[k], 0.0)) for run, own in pairs]) for k in range(3))),
        seen=np.stack([filled(run, own) for run, own in pairs]).astype(bool),
    )


def with_wheels(runs: Runs, log: Log) -> Runs:
    """The runs of a log that has wheel speeds, beside the poses; 0 where none was measured."""
    parts = log.runs()
    shape = np.shape(runs.seen)
    wheels, turning = (Wheels(np.zeros(shape, kind), np.zeros(shape, kind)) for kind in (float, bool))
    for k, run in enumerate(parts):
        for side, speed in enumerate((run.wheel_r, run.wheel_l)):
            measured = np.isfinite(speed)
            turning[side][k, : len(run.t)] = measured
            wheels[side][k, : len(run.t)] = np.where(measured, speed, 0.0)
    return runs._replace(wheels=wheels, turning=turning)


def with_room(runs: Runs) -> Runs:
    """The runs (NumPy arrays) with rows behind them in which nothing was measured, and with runs without a pose: one
    program then serves logs of many lengths (`roomy`). Rows come in whole windows, of many short runs in fewer."""
    count, rows = runs.seen.shape
    unit = SHORT if count > MANY and rows <= WINDOW else WINDOW
    blocks = -(-rows // unit)
    more = roomy(count, count * blocks) - count, unit * roomy(blocks, count * blocks) - rows

    def padded(column: Array) -> np.ndarray:
        if np.ndim(column) == 0:
            return np.asarray(column)
        return np.pad(column, ((0, more[0]), (0, more[1])))

    step = padded(runs.step)
    if np.ndim(step):
        step[:, rows:] = step[count:] = np.mean(runs.step)
    return jax.tree.map(padded, runs)._replace(step=step)


def rows_used(runs: Runs) -> Array:
    """How many rows from the first on the longest of runs (runs, rows) has, up to its last pose."""
    rows = 1 + jnp.arange(runs.seen.shape[1])
    return jnp.max(jnp.where(runs.seen, rows, 1))


def cut_windows(runs: Runs, rows: int) -> Runs:
    """Every run cut into windows of some rows, each a run of its own: (runs, rows) -> (runs * windows, rows); of poses
    alone."""
    runs = runs._replace(wheels=None, turning=None)
    length = runs.seen.shape[-1]
    short = -length % rows

    def cut(column: Array) -> Array:
        if jnp.ndim(column) == 0:
            return column
        end = jnp.repeat(column[:, -1:], short, axis=1)
        return jnp.concatenate([column, end], axis=1).reshape(-1, rows)

    inside = jnp.concatenate([jnp.ones(length, bool), jnp.zeros(short, bool)])
    windows = jax.tree.map(cut, runs)
    return windows._replace(seen=windows.seen & jnp.tile(inside, len(runs.seen)).reshape(-1, rows))


def run_axes(runs: Runs) -> Runs:
    """The axes along which `vmap` walks over runs: a common step is shared."""
    return Runs(None if jnp.ndim(runs.step) == 0 else 0, 0, 0, 0, 0, 0)  # type: ignore[arg-type]


def row_times(run: Runs) -> Rows:
    """Time [s] of each row (rows,) of one run since its first."""
    rows = run.seen.shape[-1]
    if jnp.ndim(run.step) == 0:
        return run.step * jnp.arange(rows)
    return jnp.concatenate([jnp.zeros(1), jnp.cumsum(run.step[:-1])])

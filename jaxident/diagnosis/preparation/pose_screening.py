"""Poses that are no measurement of their time: exact repeats, and outliers among the residuals of a fit."""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.fit.refit import Solution
from jaxident.diagnosis.motion.windows import Windows
from jaxident.diagnosis.noise.law import finest
from jaxident.estimation.increments.observations import repeats
from jaxident.log import Log

OUTLYING, LESS_OUTLYING = 7.0, 4.5
"""Standard deviations by which a pose leaves those nearby before it is an outlier; fewer suffice where a log is known
to have outliers, for not all are large."""
FEW, RARE = 3, 1e-3
"""Outliers, and their part of all rows, from which on a log is known to have some: of one in two thousand, as a real
robot that jerks may leave, nothing more is made."""
REPEATED = 0.3
"""Part of all rows from which on repeats are those of a camera without noise, at a robot that rests."""
TAIL = 2.2
"""What nine tenths of normal deviations from the median of five are below, in units of their median over 0.6745; the
median itself is next to nothing where a model's misses are smooth, for then most rows are the median of their five."""


class Frames(NamedTuple):
    """Poses that are no measurement of their time, boolean (rows of the log,): exact repeats, and outliers; the sizes
    of the latter, root mean square in position [m], each axis, and heading [rad]; how many poses were looked at."""

    frozen: Any
    outlying: Any
    sizes: tuple[float, float] = (0.0, 0.0)
    poses: int = 0


def find_repeats(log: Log) -> np.ndarray:
    """Rows whose pose repeats the one before, unless so many do that the camera has no noise: one with noise never
    measures that."""
    same = repeats(log)
    return same & (np.mean(same) < REPEATED)


def find_outliers(log: Log, windows: Windows, solution: Solution) -> np.ndarray:
    """Rows (of the log) whose residual leaves those of both neighbours, which agree with each other: strict, for what a
    model misses must not be taken for outliers."""
    residual = solution.linear.residual.reshape(*np.asarray(windows.step).T.shape, 3)
    seen = np.asarray(windows.seen).T
    middle = residual[:, 1:-1] - 0.5 * (residual[:, 2:] + residual[:, :-2])
    whole = seen[:, 1:-1] & seen[:, 2:] & seen[:, :-2]
    apart = np.abs(residual[:, 2:] - residual[:, :-2])
    spread = np.array([np.median(np.abs(middle[..., k][whole])) / 0.6745 if whole.any() else 1.0 for k in range(3)])
    spread = np.maximum(spread, _finest(windows))
    lonely = (np.abs(middle) > OUTLYING * spread) & (apart < 0.5 * np.abs(middle))
    window, row = np.nonzero(lonely.any(axis=2) & whole)
    found = np.zeros(len(log.t), bool)
    found[windows.row[window] + row + 1] = True
    return found


def find_more_outliers(log: Log, windows: Windows, solution: Solution) -> np.ndarray:
    """Rows whose residual leaves those nearby, which mostly agree: smaller outliers, two in a row, and those at the
    ends of a window; for logs that are known to have some."""
    residual = solution.linear.residual.reshape(*np.asarray(windows.step).T.shape, 3)
    rows = [np.flatnonzero(own) for own in np.asarray(windows.seen).T]
    pairs = [_beside(own[k]) for own, k in zip(residual, rows, strict=True)]
    apart, near = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
    spread = np.maximum(np.quantile(np.abs(apart), 0.9, axis=0) / TAIL, _finest(windows))
    hit = ((np.abs(apart) > LESS_OUTLYING * spread) & (near < 0.25 * np.abs(apart))).any(axis=1)
    found = np.zeros(len(log.t), bool)
    found[np.concatenate([place + k for place, k in zip(windows.row, rows, strict=True)])[hit]] = True
    return found


def has_outliers(outlying: Array, poses: int) -> bool:
    """Whether outliers, boolean (rows,), are enough to call a log of so many poses one that has some."""
    return bool(outlying.sum() >= max(FEW, RARE * poses))


def frames_of(log: Log, frozen: Array, outlying: Array) -> Frames:
    """What was found in a log whose repeats are blind already."""
    seen = np.isfinite(np.stack(log.pose)).all(axis=0)
    kept, rows = np.flatnonzero(seen & ~outlying), np.flatnonzero(outlying)
    poses = int(seen.sum() + frozen.sum())
    if not len(rows) or not len(kept):
        return Frames(frozen, outlying, poses=poses)
    apart = []
    for k, column in enumerate(log.pose):
        values = np.unwrap(np.asarray(column)[kept]) if k == 2 else np.asarray(column)[kept]
        apart.append(np.asarray(column)[rows] - np.interp(rows, kept, values))
    x, y, turn = apart
    turn = turn - 2.0 * np.pi * np.round(turn / (2.0 * np.pi))
    sizes = float(np.sqrt(np.mean(x**2 + y**2) / 2.0)), float(np.sqrt(np.mean(turn**2)))
    return Frames(frozen, outlying, sizes, poses)


def _finest(windows: Windows) -> np.ndarray:
    """The least error (3,) of a pose: of a log without noise all residuals are rounding, and some stand out."""
    position, heading = finest(windows)
    return np.array([position, position, heading])


def _beside(values: Array) -> tuple[np.ndarray, np.ndarray]:
    """How far each of some values (rows, 3) lies from the median of the five around it, and how far the third nearest
    of these five does: small where most agree, even if two in a row are wrong."""
    first = np.clip(np.arange(len(values)) - 2, 0, len(values) - 5)
    five = values[first[:, None] + np.arange(5)]
    middle = np.median(five, axis=1)
    return values - middle, np.sort(np.abs(five - middle[:, None]), axis=1)[:, 2]

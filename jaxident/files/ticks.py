"""Counts of wheel encoders to wheel speeds."""

import math

import numpy as np

from jaxident.array_types import Wheels
from jaxident.errors import InputError
from jaxident.files.streams import WheelSpeeds, latest

JUMP = 8.0
"""Times the speeds before and after, and the usual one, beyond which the speed over a single step is taken for a wrap
of the counter: a wheel needs several rows to speed up and to stop. No other number was tried."""


def speeds_of_counts(counts: WheelSpeeds, per_turn: float, wraps_at: float | None = None) -> tuple[WheelSpeeds, str]:
    """Wheel speeds [rad/s] of counts at some times, and a line that says how fine they are.

    The speed at a count is that from the one before to the one after, at the ends from or to the only neighbour: so it
    is neither early nor late. per_turn: counts in one turn of the wheel, 2 pi for an angle in radians. wraps_at: the
    number at which the counter begins again at zero, 65536 for 16 bits; a step is then taken the short way round. Rows
    with one wheel alone are left out. InputError for fewer than two rows with both counts, and for a counter that seems
    to wrap and no `wraps_at`.
    """
    t, both = latest("wheel counts", counts.t, counts.speed)
    known = np.isfinite(np.stack(both)).all(axis=0)
    if known.sum() < 2:
        raise InputError(f"wheel counts: {known.sum()} rows have those of both wheels; at least 2 are needed")
    t, value = t[known], np.stack(both)[:, known]
    step = np.diff(value, axis=1)
    if wraps_at is None:
        _check_no_wrap(t, step)
    else:
        step = step - wraps_at * np.round(step / wraps_at)
    total = np.cumsum(np.pad(step, ((0, 0), (1, 0))), axis=1)
    before, after = np.maximum(np.arange(len(t)) - 1, 0), np.minimum(np.arange(len(t)) + 1, len(t) - 1)
    speed = 2.0 * math.pi / per_turn * (total[:, after] - total[:, before]) / (t[after] - t[before])
    span = float(np.median(t[after] - t[before]))
    line = f"one count more in {span:.3g} s is {2.0 * math.pi / per_turn / span:.3g} rad/s"
    return WheelSpeeds(t, Wheels(*speed)), line


def _check_no_wrap(t: np.ndarray, step: np.ndarray) -> None:
    """InputError for a single step that is far beyond its neighbours and the usual one."""
    speed = np.abs(step / np.diff(t))
    moving = speed[speed > 0.0]
    if speed.shape[1] < 3 or not moving.size:
        return
    around = np.maximum(np.maximum(speed[:, :-2], speed[:, 2:]), float(np.median(moving)))
    wheel, place = np.unravel_index(int(np.argmax(speed[:, 1:-1] / around)), around.shape)
    if speed[wheel, place + 1] > JUMP * around[wheel, place]:
        size = float(np.abs(step[wheel, place + 1]))
        likely = 2.0 * math.pi if size <= 2.0 * math.pi else 1 << math.ceil(math.log2(size))
        raise InputError(
            f"wheel counts: a single step of {size:.10g} from t = {t[place + 1]:.10g} to {t[place + 2]:.10g} s: does "
            f"the counter begin again there? `--wheel-counter {likely:.7g}` says at which number"
        )

"""How late the wheels answer the commands, before any ground: the delay and the lag of the command path. NumPy alone.

The wheel speeds between two samples make a path and a turn, as poses do; `clock_offset.respond` reads both as the
answer to the commands. Radius and track are of no matter: they change gains, not times.
"""

from typing import NamedTuple

import numpy as np

from jaxident.array_types import Wheels
from jaxident.estimation.suspicions.clock_offset import PAUSE, Streams, respond
from jaxident.log import Log

EXPLAINED = 0.5
"""Least share of the wheels' motion that the commands must explain."""
SURE = 5.0
"""Standard deviations from zero at which a delay counts."""
LONGEST = 5.0
"""Delays [s] that are looked for."""


class WheelAnswer(NamedTuple):
    """delay [s] from a command to the first answer of the wheels, its standard_error, and the time constant of the lag
    [s] with which they then follow, of both wheels together and against each other."""

    delay: float
    standard_error: float
    lag: tuple[float, float]


def answer_of_wheels(log: Log) -> WheelAnswer | None:
    """The answer in a log with wheel speeds; None where the wheels do not follow the commands, or two delays do as
    well."""
    parts, begin = [], 0.0
    for run in log.runs():
        turning = np.isfinite(run.wheel_r) & np.isfinite(run.wheel_l)
        if turning.sum() > 1:
            parts.append(_of_run(run, turning, begin))
        begin += float(run.t[-1] - run.t[0]) + PAUSE
    if not parts:
        return None
    found = respond(Streams(*(np.concatenate(columns) for columns in zip(*parts, strict=True))), LONGEST)
    if found is None or found.rival is not None or not np.min(found.explained) > EXPLAINED:
        return None
    along, across = (1.0 / found.rate).tolist()
    return WheelAnswer(-found.offset, found.standard_error, (along, across))


def _of_run(run: Log, turning: np.ndarray, begin: float) -> Streams:
    """The commands of a run, and what its wheels turned from sample to sample: trapezoids of mean and difference."""
    t = np.asarray(run.t, float) - run.t[0] + begin
    command = Wheels(*(np.nan_to_num(u) for u in run.command))
    own = t[turning]
    turned = turns_of_wheels(own, np.stack([run.wheel_r, run.wheel_l])[:, turning]).T
    ends = np.stack([own[:-1], own[1:]], axis=1)
    return Streams(np.append(t, t[-1] + 1e-3), np.pad(np.stack(command, axis=1), ((0, 1), (0, 0))), ends, turned)


def turns_of_wheels(t: np.ndarray, speeds: np.ndarray) -> np.ndarray:
    """How far wheels turn [rad] from row to row, (2, ..., rows - 1): the mean of both, and right less left.

    By trapezoids of speeds (2, ..., rows) [rad/s], right and left, at times t (..., rows) [s]."""
    turned = 0.5 * (speeds[..., 1:] + speeds[..., :-1]) * np.diff(t)
    return np.stack([0.5 * (turned[0] + turned[1]), turned[0] - turned[1]])


def late_wheels(log: Log) -> tuple[str, ...]:
    """A line where the wheels answer the commands late by more than a row: that delay is before the wheel."""
    found = answer_of_wheels(log)
    if found is None or not found.delay > max(SURE * found.standard_error, typical_step(log)):
        return ()
    return (f"{told(found)}: what is late here is the motors or the way to them, not the ground",)


def typical_step(log: Log) -> float:
    """The median time step [s] of a log."""
    return float(np.median(np.concatenate([np.diff(run.t) for run in log.runs() if len(run.t) > 1])))


def told(found: WheelAnswer) -> str:
    """The answer in words."""
    along, across = found.lag
    return (
        f"the wheels answer the commands {found.delay:.3g} s late (standard error {found.standard_error:.1g} s), then "
        f"with a lag of {along:.2g} s together and {across:.2g} s against each other"
    )

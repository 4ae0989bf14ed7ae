"""Rules that the rows of a table keep, and the one error line for the first row that does not."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Pose
from jaxident.errors import InputError

SLOWEST, FASTEST = 2.0, 5e-4
"""Steps [s] between the poses of a camera: beyond these a robot is not followed, and the unit of time is another."""
USUAL_STEP = 0.03
"""Step [s] between the poses of a usual camera, between which units are guessed."""
FEWEST_STEPS = 20
"""Steps whose median tells a rate."""
LARGEST_RUN = 2**53
"""Beyond this double precision no longer tells one integer from the next."""


class Rule(NamedTuple):
    """A rule of one column: the rows (rows,) that break it, and what would be right."""

    column: str
    broken: np.ndarray
    right: str


def enforce(rules: Iterable[Rule], columns: Mapping[str, np.ndarray], place: Callable[[int], str]) -> None:
    """InputError for the first row that breaks the first broken rule; `place` names a row."""
    for rule in rules:
        rows = np.flatnonzero(rule.broken)
        if rows.size:
            cell = columns[rule.column][rows[0]]
            found = "empty" if np.isnan(cell) else f"{float(cell):.10g}"
            raise InputError(f"{place(rows[0])}, column {rule.column}: is {found}; {rule.right}")


def rising_time(t: np.ndarray, first: np.ndarray) -> Iterator[Rule]:
    """Every row has a time t (rows,), later than that of the row before except where a run begins: `first` (rows,)."""
    yield Rule("t", ~np.isfinite(t), "every row needs a time")
    yield Rule("t", ~first & (np.diff(t, prepend=t[:1]) <= 0.0), "time must rise from each row to the next")


def ordered_time(t: np.ndarray) -> Iterator[Rule]:
    """Every row has a time t (rows,), not earlier than that of the row before."""
    yield Rule("t", ~np.isfinite(t), "every row needs a time")
    yield Rule("t", np.diff(t, prepend=t[:1]) < 0.0, "time must not go back from one row to the next")


def pose_rules(pose: Pose) -> Iterator[Rule]:
    """All three of a pose's columns (rows,) are finite or, where nothing was measured, NaN."""
    blind = np.isnan(np.stack(pose)).all(axis=0)
    for name, column in pose._asdict().items():
        yield Rule(name, ~np.isfinite(column) & ~blind, "a pose has three cells, or none where nothing was measured")


def log_rules(log: Any, first: np.ndarray) -> Iterator[Rule]:
    """What the columns of a log keep; first (rows,): where a run begins."""
    yield Rule("run", ~(log.run == np.round(log.run)) | (np.abs(log.run) >= LARGEST_RUN), "it should be an integer")
    starts = np.flatnonzero(first)
    _, new = np.unique(log.run[starts], return_index=True)
    again = np.zeros(len(first), bool)
    again[np.delete(starts, new)] = True
    yield Rule("run", again, "the rows of a run must stand together")
    yield from rising_time(log.t, first)
    last = np.append(first[1:], True)
    for name, command in zip(("u_r", "u_l"), log.command, strict=True):
        yield Rule(name, ~np.isfinite(command) & ~last, "only a run's last row may have no command")
    yield from pose_rules(log.pose)
    for name, speed in (("wheel_r", log.wheel_r), ("wheel_l", log.wheel_l)):
        if speed is not None:
            yield Rule(name, np.isinf(speed), "a wheel speed is finite, or empty where none was measured")


def repeat_last(command: np.ndarray, run: np.ndarray) -> np.ndarray:
    """Every missing command (rows,) replaced by the one of the row before, 0 where that row is of another run."""
    before = np.concatenate([[0.0], np.where(run[1:] == run[:-1], command[:-1], 0.0)])
    return np.where(np.isnan(command), before, command)


def check_pose_rate(name: str, steps: Any) -> None:
    """InputError where the median step between poses (steps,) is none of a camera; names the right unit."""
    if len(steps) < FEWEST_STEPS:
        return
    median = float(np.median(steps))
    if FASTEST <= median <= SLOWEST:
        return
    scale = {unit: median / size for unit, size in (("ms", 1e3), ("us", 1e6), ("ns", 1e9), ("min", 1.0 / 60.0))}
    unit = min(scale, key=lambda unit: abs(np.log(max(scale[unit], 1e-300) / USUAL_STEP)))
    option = f": `--columns t=t:{unit}` takes them for {unit}" if FASTEST <= scale[unit] <= SLOWEST else ""
    raise InputError(
        f"{name}: the poses are {median:.4g} s apart; {FASTEST:g} to {SLOWEST:g} s are read. Are the times in another "
        f"unit{option}?"
    )

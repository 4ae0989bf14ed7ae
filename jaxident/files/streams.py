"""Two streams to one log: commands and camera poses that were recorded apart, each with its own times on one clock."""

import warnings
from typing import Any, NamedTuple, TypeVar

import numpy as np

from jaxident.array_types import Pose, Wheels
from jaxident.columns import QUATERNION, Column, Columns
from jaxident.errors import InputError
from jaxident.files.source import Source
from jaxident.files.table import Table, read_table
from jaxident.log import Log, make_log
from jaxident.rules import Rule, check_pose_rate, enforce, ordered_time, pose_rules

ROUNDING = 1e-3
"""Rounding of time stamps, in periods: a command that comes this much after a row is still the row's own."""
SAME_TIME = 1e-6
"""Times less than this [s] apart are one: adding an offset to decimal stamps moves them by a rounding error."""
LONGEST_OFFSET = 1e12
"""Beyond this [s], 30,000 years, a double no longer tells tenths of a millisecond."""
MOST_ROWS = 20_000_000
"""Most rows of an even log; more than that is two clocks mistaken for one."""
UNIX = 1e8
"""Times above this [s] count from 1970: as a robot's time of operation they would be three years."""
OTHER_UNIT = 100.0
"""Ratio of the lengths of two recordings beyond which their times have different units."""
WHEELS = ("u_r", "u_l")
FEWEST = 30
"""Entries of a stream whose length in time means something."""

Signal = TypeVar("Signal", Wheels, Pose)


class Speeds(NamedTuple):
    """Commanded speeds (commands,): v along the heading [m/s], w in heading [rad/s]."""

    v: Any
    w: Any


class Commands(NamedTuple):
    """Commands given at times t (commands,) [s], in order; each holds until the next. Wheels in the user's unit."""

    t: Any
    value: Wheels | Speeds


class Poses(NamedTuple):
    """Camera poses at times t (poses,) [s], in order."""

    t: Any
    pose: Pose


def read_commands(path: Source, columns: Columns | None = None) -> Commands:
    """Commands from CSV with the header t,v,w or t,u_r,u_l; InputError names the line at fault.

    The file follows the rules of a log's: plain or gzipped, further columns ignored with a UserWarning, finite
    numbers only; no cell may be empty. Time must not go back; recorders that round it give equal times. columns: those
    that have other names or units in the file; names of the other stream are passed over.
    """
    table = read_table(
        path, [("t", *Speeds._fields), ("t", *WHEELS)], columns=_own(columns, (*Speeds._fields, *WHEELS))
    )
    _check_times(table)
    t, *values = table.columns.items()
    both = (Rule(name, np.isnan(column), "a command has both values") for name, column in values)
    enforce(both, table.columns, table.place)
    kind = Speeds if "v" in table.columns else Wheels
    return Commands(t[1], kind(*(column for _, column in values)))


def read_poses(path: Source, columns: Columns | None = None) -> Poses:
    """Poses from CSV with the header t,x,y,theta, rules as in `read_commands`; rows without a pose are left out."""
    table = read_table(path, [("t", *Pose._fields)], columns=_own(columns, (*Pose._fields, *QUATERNION)))
    _check_times(table)
    t, *pose = table.columns.values()
    enforce(pose_rules(Pose(*pose)), table.columns, table.place)
    seen = np.isfinite(pose[0])
    if not seen.any():
        raise InputError(f"{table.name}: no row has a pose")
    return Poses(t[seen], Pose(*(column[seen] for column in pose)))


def _own(columns: Columns | None, names: tuple[str, ...]) -> dict[str, Column]:
    """Those of the columns that a stream has."""
    return {name: column for name, column in (columns or {}).items() if name in ("t", *names)}


def merge(
    commands: Commands,
    poses: Poses,
    *,
    period: float | None = None,
    track: float | None = None,
    pose_offset: float = 0.0,
    hold_timeout: float | None = None,
) -> Log:
    """One log, a single run, from the first command to the last event; a pose is never interpolated.

    Speeds become wheel speeds by the track W [m]: u_r = v + w W / 2, u_l = v - w W / 2. `pose_offset` [s] is added
    to the times of the poses. A command holds until the next, with `hold_timeout` [s] that long at most, then zero.

    Without a period every event (command, expiry, pose) is a row; equal times share one, and a row without a pose
    has NaN. Poses before the first command are left out: what the robot was told then is not known. With a
    `period` [s] the rows are t_0 + k period from the first command on, each with the command in force and the
    nearest pose within half a period or NaN; each pose is used once at most.

    Of several commands or poses at one time the last counts, with a UserWarning. InputError for a setting out of range,
    speeds without a track, wheel commands with one, times that go back, streams that do not overlap or whose times
    have other units.
    """
    _check_settings(pose_offset, period=period, track=track, hold_timeout=hold_timeout)
    command_t, wheels = _latest("commands", commands.t, wheel_speeds(commands.value, track))
    pose_t, pose = _latest("poses", np.asarray(poses.t) + pose_offset, poses.pose)
    check_pose_rate("poses", np.diff(pose_t))
    _check_overlap(command_t, pose_t)
    end = max(command_t[-1], pose_t[-1])
    held_t, held = _expire(command_t, wheels, hold_timeout, end)
    t, in_force, pose_row = _by_event(held_t, pose_t) if period is None else _by_period(held_t, pose_t, end, period)
    if len(t) < 2:
        raise InputError(f"the streams make a log of a single row, at {t[0]:.10g} s; it needs two at least")
    measured = (np.where(pose_row < 0, np.nan, column[pose_row]) for column in pose)
    return make_log(t, *(command[in_force] for command in held), *measured)


def _by_event(held_t: np.ndarray, pose_t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times of the rows, and per row the command in force and the pose (-1 for none) as indices."""
    last = np.maximum(np.searchsorted(held_t, pose_t + SAME_TIME, side="right") - 1, 0)
    pose_t = np.where(np.abs(pose_t - held_t[last]) <= SAME_TIME, held_t[last], pose_t)
    t = np.union1d(held_t, pose_t[pose_t >= held_t[0]])
    nearest = np.minimum(np.searchsorted(pose_t, t), len(pose_t) - 1)
    return t, np.searchsorted(held_t, t, side="right") - 1, np.where(pose_t[nearest] == t, nearest, -1)


def _by_period(held_t: np.ndarray, pose_t: np.ndarray, end: float, period: float) -> tuple[np.ndarray, ...]:
    """As `_by_event`, on the even grid; times are compared as counts of periods since the first row."""
    with np.errstate(over="ignore"):  # infinitely many rows are too many too
        rows = np.floor((end - held_t[0]) / period + ROUNDING) + 1
    if rows > MOST_ROWS:
        raise InputError(
            f"period: {period:g} s makes {rows:.3g} rows between {held_t[0]:.10g} s and {end:.10g} s; are both streams "
            "on one clock?"
        )
    row = np.arange(int(rows))
    in_force = np.searchsorted((held_t - held_t[0]) / period, row + ROUNDING, side="right") - 1
    count = (pose_t - held_t[0]) / period
    nearest = np.floor(count + 0.5)
    order = np.lexsort((np.abs(count - nearest), nearest))  # by row, the nearest pose first
    row_of_pose, first = np.unique(nearest[order], return_index=True)
    inside = (row_of_pose >= 0) & (row_of_pose < rows)
    pose_row = np.full(len(row), -1)
    pose_row[row_of_pose[inside].astype(int)] = order[first[inside]]
    return held_t[0] + period * row, in_force, pose_row


def wheel_speeds(value: Wheels | Speeds, track: float | None) -> Wheels:
    """Commands as those of the wheels; InputError for speeds without a track, wheel commands with one."""
    if isinstance(value, Wheels):
        if track is not None:
            raise InputError("track: the commands are u_r,u_l already; leave it out")
        return value
    if track is None:
        raise InputError("track: the commands are v,w; give the track width in metres to make them wheel speeds")
    v, half = np.asarray(value.v, float), np.asarray(value.w, float) * (0.5 * track)
    return Wheels(v + half, v - half)


def _expire(t: np.ndarray, value: Wheels, timeout: float | None, end: float) -> tuple[np.ndarray, Wheels]:
    """The commands with a zero put in wherever one grows older than the timeout before the next, or the end."""
    if timeout is None:
        return t, value
    late = t[t + timeout < np.append(t[1:], end) - SAME_TIME] + timeout
    place = np.searchsorted(t, late)
    return np.insert(t, place, late), Wheels(*(np.insert(command, place, 0.0) for command in value))


def _check_settings(pose_offset: float, **positive: float | None) -> None:
    if not abs(pose_offset) < LONGEST_OFFSET:
        raise InputError(
            f"pose_offset: is {pose_offset:g}; it should be a finite time in seconds, below {LONGEST_OFFSET:g}"
        )
    for name, value in positive.items():
        if value is not None and not 0.0 < value < np.inf:
            raise InputError(f"{name}: is {value:g}; it should be positive")


def _latest(name: str, t: Any, value: Signal) -> tuple[np.ndarray, Signal]:
    """A stream in order of time, each time once: of several entries at one time the last counts."""
    t = np.asarray(t, float)
    if not len(t):
        raise InputError(f"{name}: there are none")
    enforce(ordered_time(t), {"t": t}, lambda row: f"{name}, entry {row}")
    counts = np.append(t[1:] != t[:-1], True)
    if not counts.all():
        shared = np.sum(~counts)
        warnings.warn(f"{name}: {shared} of {len(t)} share their time with the next, which counts", stacklevel=3)
    return t[counts], type(value)(*(np.asarray(column)[counts] for column in value))


def _check_overlap(command_t: np.ndarray, pose_t: np.ndarray) -> None:
    """InputError for two streams without a time in common, or with times in different units."""
    lengths = float(np.ptp(command_t)), float(np.ptp(pose_t))
    if min(len(command_t), len(pose_t)) > FEWEST and max(lengths) > OTHER_UNIT * min(lengths):
        raise InputError(
            f"the commands last {lengths[0]:.6g} s and the poses {lengths[1]:.6g} s: are the times of one in another "
            "unit? --command-columns t=t:ms or --pose-columns t=t:ms takes them for milliseconds"
        )
    if pose_t[-1] >= command_t[0] and (len(command_t) == 1 or pose_t[0] <= command_t[-1]):
        return
    names = [name for name, t in (("commands", command_t), ("poses", pose_t)) if t[0] > UNIX]
    unix = f"; the {names[0]} are in Unix time, the others not" if len(names) == 1 else ""
    raise InputError(
        f"the streams do not overlap: commands from {command_t[0]:.10g} to {command_t[-1]:.10g} s, poses from "
        f"{pose_t[0]:.10g} to {pose_t[-1]:.10g} s{unix}: are both streams on one clock? --pose-offset auto finds the "
        "time to add to the poses, a number sets it"
    )


def _check_times(table: Table) -> None:
    if not len(table.line):
        raise InputError(f"{table.name}: has no rows below its header")
    enforce(ordered_time(table.columns["t"]), table.columns, table.place)

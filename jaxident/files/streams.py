"""Two streams to one log, or three: commands, camera poses and perhaps wheel speeds that were recorded apart, each with
its own times on one clock."""

import warnings
from typing import Any, NamedTuple, TypeVar

import numpy as np

from jaxident.array_types import Pose, Wheels
from jaxident.columns import QUATERNION, Column, Columns
from jaxident.columns import WHEELS as WHEEL_SPEEDS
from jaxident.errors import InputError
from jaxident.files.merged_rows import SAME_TIME, by_event, by_period
from jaxident.files.source import Source
from jaxident.files.table import Table, read_table
from jaxident.log import Log, make_log
from jaxident.rules import Rule, check_pose_rate, enforce, ordered_time, pose_rules

LONGEST_OFFSET = 1e12
"""Beyond this [s], 30,000 years, a double no longer tells tenths of a millisecond."""
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


class WheelSpeeds(NamedTuple):
    """Measured wheel speeds [rad/s] at times t (speeds,) [s], in order; NaN where one was not measured."""

    t: Any
    speed: Wheels


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


def read_wheels(path: Source, columns: Columns | None = None) -> WheelSpeeds:
    """Wheel speeds from CSV with the header t,wheel_r,wheel_l, rules as in `read_commands`; a cell may be empty."""
    table = read_table(path, [("t", *WHEEL_SPEEDS)], columns=_own(columns, WHEEL_SPEEDS))
    _check_times(table)
    t, *speed = table.columns.values()
    if np.isnan(speed).all():
        raise InputError(f"{table.name}: no row has a wheel speed")
    return WheelSpeeds(t, Wheels(*speed))


def _own(columns: Columns | None, names: tuple[str, ...]) -> dict[str, Column]:
    """Those of the columns that a stream has."""
    return {name: column for name, column in (columns or {}).items() if name in ("t", *names)}


def merge(
    commands: Commands,
    poses: Poses,
    *,
    wheels: WheelSpeeds | None = None,
    period: float | None = None,
    track: float | None = None,
    pose_offset: float = 0.0,
    hold_timeout: float | None = None,
) -> Log:
    """One log, a single run, from the first command to the last event; a pose is never interpolated.

    Speeds become wheel speeds by the track W [m]: u_r = v + w W / 2, u_l = v - w W / 2. `pose_offset` [s] is added
    to the times of the poses. A command holds until the next, with `hold_timeout` [s] that long at most, then zero.

    Without a period every event (command, expiry, pose) is a row; equal times share one, and a row without a pose
    has NaN. Poses before the first command are left out: what the robot was told then is not known. With a `period` [s]
    the rows are t_0 + k period from the first command on, each with the command in force and the nearest pose within
    half a period or NaN; each pose is used once at most. Measured wheel speeds are laid on the rows as poses are; those
    before the first command and after the end of commands and poses are left out.

    Of several entries of a stream at one time the last counts, with a UserWarning. InputError for a setting out of
    range, speeds without a track, wheel commands with one, times that go back, streams that do not overlap or whose
    times have other units.
    """
    _check_settings(pose_offset, period=period, track=track, hold_timeout=hold_timeout)
    command_t, value = latest("commands", commands.t, wheel_speeds(commands.value, track))
    pose_t, pose = latest("poses", np.asarray(poses.t) + pose_offset, poses.pose)
    check_pose_rate("poses", np.diff(pose_t))
    _check_overlap(command_t, pose_t)
    end = max(command_t[-1], pose_t[-1])
    held_t, held = _expire(command_t, value, hold_timeout, end)
    sensors = [(pose_t, pose)] if wheels is None else [(pose_t, pose), _inside(wheels, held_t[0], end)]
    times = [own for own, _ in sensors]
    t, in_force, found = by_event(held_t, times) if period is None else by_period(held_t, times, end, period)
    if len(t) < 2:
        raise InputError(f"the streams make a log of a single row, at {t[0]:.10g} s; it needs two at least")
    log = make_log(t, *(command[in_force] for command in held), *_laid(pose, found[0]))
    return Log(*log, *_laid(sensors[1][1], found[1])) if wheels else log


def _laid(values: tuple, rows: np.ndarray) -> list[np.ndarray]:
    """The columns of a sensor at the rows of a log, NaN where -1 says that it measured nothing."""
    return [np.where(rows < 0, np.nan, column[rows]) for column in values]


def _inside(wheels: WheelSpeeds, begin: float, end: float) -> tuple[np.ndarray, Wheels]:
    """Times and wheel speeds from the first command to the end; InputError where there are none."""
    t, speed = latest("wheel speeds", wheels.t, wheels.speed)
    kept = (t >= begin - SAME_TIME) & (t <= end + SAME_TIME)
    if not kept.any():
        raise InputError(
            f"the wheel speeds run from {t[0]:.10g} to {t[-1]:.10g} s, commands and poses from {begin:.10g} to "
            f"{end:.10g} s: they do not overlap; are all streams on one clock, in the same unit of time?"
        )
    return t[kept], Wheels(*(column[kept] for column in speed))


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


def latest(name: str, t: Any, value: Signal) -> tuple[np.ndarray, Signal]:
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
            "unit? `--command-columns t=t:ms` or `--pose-columns t=t:ms` takes them for milliseconds"
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

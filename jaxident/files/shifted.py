"""A finished log whose poses have another clock than its commands, or whose rows are uneven: put together anew."""

import numpy as np

from jaxident.array_types import Pose, Wheels
from jaxident.errors import InputError
from jaxident.files.streams import Commands, Poses, WheelSpeeds, merge
from jaxident.log import Log, join, wheels_measured


def shift_poses(log: Log, pose_offset: float = 0.0, period: float | None = None) -> Log:
    """The log with `pose_offset` [s] added to the times of its poses, run by run; see `merge`.

    Without a period a row is kept where a pose, a change of the command, or an end of the run stands; with one the rows
    are even. Poses that come to lie before the first command of their run are left out. Wheel speeds stay with the
    commands, and a row with one is kept too. An offset of 0 without a period
    changes nothing. InputError where no pose is left, or where a setting is out of range.
    """
    if pose_offset == 0.0 and period is None:
        return log
    moved = [_moved(run, number, pose_offset, period) for number, run in enumerate(log.runs())]
    made = join(moved)
    if not np.isfinite(made.x).any():
        raise InputError(f"pose_offset: {pose_offset:g} s leaves no pose; the runs are shorter than that")
    return made


def shift_wheels(log: Log, wheels_offset: float, period: float | None = None) -> Log:
    """The log with `wheels_offset` [s] added to the times of its wheel speeds, run by run; rows as in `shift_poses`.

    An offset of 0 changes nothing. InputError for a log without wheel speeds, and where none is left.
    """
    if wheels_offset == 0.0:
        return log
    if wheels_measured(log) is None:
        raise InputError("wheels_offset: the log has no wheel speeds")
    moved = [_moved(run, number, 0.0, period, wheels_offset) for number, run in enumerate(log.runs())]
    return join(moved)


def _moved(run: Log, number: int, pose_offset: float, period: float | None, wheels_offset: float = 0.0) -> Log:
    seen = np.isfinite(np.stack(run.pose)).all(axis=0)
    if not seen.any():
        return run
    commands = Commands(run.t, Wheels(run.u_r, run.u_l))
    poses = Poses(run.t[seen], Pose(*(column[seen] for column in run.pose)))
    wheels = None if run.wheel_r is None else WheelSpeeds(run.t + wheels_offset, Wheels(run.wheel_r, run.wheel_l))
    try:
        made = merge(commands, poses, wheels=wheels, period=period, pose_offset=pose_offset)
    except InputError as error:
        raise InputError(f"run {number}: {error}") from None
    return made if period is not None else made[_needed(made)]


def _needed(log: Log) -> np.ndarray:
    """Boolean (rows,): rows with a measurement, with another command than the row before, and both ends."""
    change = (np.diff(log.u_r) != 0.0) | (np.diff(log.u_l) != 0.0)
    kept = np.isfinite(log.x) | np.concatenate([[True], change])
    if log.wheel_r is not None:
        kept |= np.isfinite(log.wheel_r) | np.isfinite(log.wheel_l)
    kept[-1] = True
    return kept

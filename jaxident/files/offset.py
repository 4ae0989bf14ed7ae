"""The offset between the clocks of two streams, for `--pose-offset auto`."""

import numpy as np

from jaxident.errors import InputError
from jaxident.estimation.suspicions.clock_offset import Response, respond, streams_of, streams_of_log
from jaxident.estimation.suspicions.wheel_suspicions import wheel_offset
from jaxident.files.streams import Commands, Poses, wheel_speeds
from jaxident.log import Log

SMALLEST_SHARE = 0.05
"""Share of the motion's variance that the commands must explain."""


def estimate_offset(commands: Commands, poses: Poses, track: float | None = None) -> Response:
    """The time to add to the poses, with its standard error; see `clock_offset`.

    A delay of the robot counts as a negative offset. Clocks that share no time are first laid on each other by the
    begins of the recordings. InputError where the motion does not answer the commands, or two offsets do as well.
    """
    wheels = wheel_speeds(commands.value, track)
    begin, t = float(commands.t[0]), np.asarray(commands.t, float)
    apart = poses.t[0] > t[-1] or poses.t[-1] < begin
    shift = begin - float(poses.t[0]) if apart else 0.0
    change = np.concatenate([[True], np.diff(t) > 0.0])
    new = np.concatenate([[True], np.diff(poses.t) > 0.0])
    # times from the first command on: Unix time leaves too few digits
    pose = type(poses.pose)(*(column[new] for column in poses.pose))
    streams = streams_of(
        t[change] - begin, type(wheels)(*(u[change] for u in wheels)), poses.t[new] + shift - begin, pose
    )
    return _checked(respond(streams), shift)


def estimate_log_offset(log: Log) -> Response:
    """As `estimate_offset`, for the poses of a finished log: one offset for all of its runs."""
    return _checked(respond(streams_of_log(log)))


def estimate_wheels_offset(log: Log) -> tuple[float, float]:
    """The time [s] to add to the wheel speeds' of a log, and its standard error. InputError where there is none."""
    found = None if log.wheel_r is None else wheel_offset(log)
    if found is None:
        raise InputError(
            "wheels_offset: the motion does not answer the wheel speeds, so no offset can be found; give a number"
        )
    return found


def _checked(found: Response | None, shift: float = 0.0) -> Response:
    """The response, its offset later by `shift`; InputError where it is none that can be relied on."""
    if found is None or np.max(found.explained) < SMALLEST_SHARE or not found.standard_error > 0.0:
        raise InputError(
            "pose_offset: the motion does not answer the commands, so no offset can be found; give a number"
        )
    if found.rival is not None:
        first, second = found.offset + shift, found.rival + shift
        raise InputError(f"pose_offset: {first:.6g} s and {second:.6g} s fit as well as each other; give the right one")
    return found._replace(offset=found.offset + shift)

"""What wheel speeds say against themselves, held against the camera: which of them to use, and a line for each doubt.

The poses are read as the answer of a robot to its wheel speeds (`clock_offset.respond`), as suspicions about commands
read them as the answer to the commands: signs, the unit and the clock follow from that answer. NumPy alone.
"""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Pose, Wheels
from jaxident.estimation.suspicions.clock_offset import PAUSE, Response, Streams, respond, streams_of
from jaxident.estimation.suspicions.heading import AGAINST, BACKWARDS, EXPLAINED, SURE, Signs
from jaxident.estimation.suspicions.wheel_answer import late_wheels, typical_step
from jaxident.log import Log

MOST = 20_000
"""Rows that are looked at, as in `suspicions`."""
QUIET = 2.0
"""Time [s] without a command after which a wheel should stand; the slowest of six real robots stops within 1 s."""
TURNING = 0.1
"""Share of a wheel's usual speed (root mean square) from which on it is said to turn."""
SEVERAL = 0.9
"""Rows of offset between wheels and camera that are worth a word."""
LARGEST_OFFSET = 5.0
"""Offsets between clocks [s] that are looked for."""
SMALLEST_RATIO, LARGEST_RATIO = 0.04, 1.0
"""Radius over track of robots on wheels, with room: a Create has 0.15, a TurtleBot3 0.2, a Husky 0.3, in turns 0.15.
Speeds in rpm take it to a tenth, rim speeds in m/s to 1 / track."""
NEAR_ONE = 0.1
"""Radii [m] this near to 1 look like rim speeds in m/s; robots have smaller wheels."""


WRONG_WHEELS: dict[Signs, str] = {
    AGAINST: "the wheel speeds of right and left are swapped: `--columns wheel_r=wheel_l,wheel_l=wheel_r`",
    (-1, -1, -1, 1): "both wheel speeds have the wrong sign: `--columns wheel_r=wheel_r:-1,wheel_l=wheel_l:-1`",
    BACKWARDS: "both wheel speeds have the wrong sign and are swapped: `--columns "
    "wheel_r=wheel_l:-1,wheel_l=wheel_r:-1`",
    (-1, 1, -1, -1): "the right wheel's speed has the wrong sign: `--columns wheel_r=wheel_r:-1`",
    (1, -1, 1, 1): "the left wheel's speed has the wrong sign: `--columns wheel_l=wheel_l:-1`",
}
"""What is wrong with wheel speeds, and what mends it, by the signs of four gains: right and left along, right and left
in heading; of the motion by wheel speeds, or of these by commands."""


class WheelCheck(NamedTuple):
    """Whether the wheel speeds can be used beside the camera, and what is suspected of them, a line each."""

    usable: bool
    lines: tuple[str, ...]


def check_wheels(log: Log) -> WheelCheck:
    """What a log with wheel speeds (NumPy arrays) says of them. Those that contradict the camera are not to be used."""
    log = log.rows(0, MOST)
    zero = _zeros(log)
    if zero:
        return WheelCheck(False, (zero,))
    lines = [_turning_alone(log)]
    response = respond(_streams(log), LARGEST_OFFSET)
    wrong = "" if response is None else wheel_signs(response)
    if wrong:
        return WheelCheck(False, (*filter(None, lines), f"{wrong}; they are not used"))
    clock = "" if response is None else offset(response, log)
    lines += ["" if response is None else unit(response), clock]
    lines += () if clock else late_wheels(log)  # late stamps of the wheels would look like late wheels
    return WheelCheck(True, tuple(filter(None, lines)))


def wheels_turn(log: Log) -> bool:
    """Whether a log has wheel speeds other than zero."""
    return any(bool(np.nan_to_num(speed).any()) for speed in (log.wheel_r, log.wheel_l) if speed is not None)


def _streams(log: Log) -> Streams:
    """The log's wheel speeds in place of commands, each from halfway after the sample before to halfway to the next."""
    parts, begin = [], 0.0
    for run in log.runs():
        turning = np.isfinite(run.wheel_r) & np.isfinite(run.wheel_l)
        seen = np.isfinite(np.stack(run.pose)).all(axis=0)
        if turning.sum() < 2 or seen.sum() < 2:
            continue
        t = np.asarray(run.t, float) - run.t[0] + begin
        own = t[turning]
        middle = np.concatenate([own[:1], 0.5 * (own[1:] + own[:-1])])
        speed = Wheels(np.asarray(run.wheel_r)[turning], np.asarray(run.wheel_l)[turning])
        part = streams_of(middle, speed, t[seen], Pose(*(np.asarray(column)[seen] for column in run.pose)))
        end = max(t[-1], middle[-1]) + 1e-3
        parts.append(part._replace(command_t=np.append(middle, end), command=np.pad(part.command, ((0, 1), (0, 0)))))
        begin = t[-1] + PAUSE
    if not parts:
        return Streams(np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2)), np.zeros((0, 2)))
    return Streams(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def _zeros(log: Log) -> str:
    """A wheel that never turns, though the robot moves."""
    for name, speed in (("wheel_r", log.wheel_r), ("wheel_l", log.wheel_l)):
        measured = speed[np.isfinite(speed)]
        if measured.size and not measured.any():
            return f"{name} is 0 in all {measured.size} rows while the robot moves: the wheel speeds are not used"
    return ""


def _turning_alone(log: Log) -> str:
    """A wheel that turns long after the last command other than zero."""
    worst: tuple[float, str, float] = (0.0, "", 0.0)
    for run in log.runs():
        told = np.any(np.nan_to_num(np.stack(run.command)) != 0.0, axis=0)
        last = np.maximum.accumulate(np.where(told, np.arange(len(told)), -1))
        ended = np.where(last >= 0, run.t[np.minimum(np.maximum(last, 0) + 1, len(told) - 1)], run.t[0])
        quiet = ~told & (run.t - ended > QUIET)
        for name, speed in (("wheel_r", run.wheel_r), ("wheel_l", run.wheel_l)):
            size = np.sqrt(np.nanmean(np.asarray(speed) ** 2)) if np.isfinite(speed).any() else np.inf
            alone = np.where(quiet & np.isfinite(speed), np.abs(speed), 0.0)
            if alone.max() > max(worst[0], TURNING * size):
                worst = float(alone.max()), name, float(run.t[np.argmax(alone)])
    if not worst[1]:
        return ""
    return (
        f"{worst[1]} turns at {worst[0]:.3g} rad/s at t = {worst[2]:g} s, though every command has been 0 for "
        f"{QUIET:g} s: does something else drive or push the robot, or are its commands missing?"
    )


def wheel_signs(response: Response) -> str:
    """Wheel speeds that the camera contradicts: signs of the gains (2, 2) other than + + along and + - in heading, or
    motion that they do not explain."""
    clear = np.abs(response.gain) >= SURE * response.gain_deviation
    if not np.max(response.explained) > EXPLAINED or (response.rival is not None and not clear.any()):
        return "the camera sees motion that does not follow the wheel speeds: are they of this robot, and on its clock?"
    if not clear.all():
        return ""
    signs: Any = tuple(int(s) for s in np.sign(response.gain).ravel())
    line = WRONG_WHEELS.get(signs, "")
    return f"{line} (signs of the gains, each {SURE:g} standard deviations clear)" if line else ""


def sensor_of(response: Response) -> tuple[float, float]:
    """Radius and track [m] that the answer of the poses to the wheel speeds implies."""
    radius = float(response.gain[0].sum())
    return radius, 2.0 * radius / float(response.gain[1, 0] - response.gain[1, 1])


def unit(response: Response) -> str:
    """Wheel speeds that are hardly in rad/s, by the radius and track that they imply."""
    if not np.all(np.abs(response.gain) >= SURE * response.gain_deviation):
        return ""
    radius, track = sensor_of(response)
    told = f"the wheels would have a radius of {radius:.3g} m and stand {track:.3g} m apart: "
    if radius < SMALLEST_RATIO * track:
        return told + (
            "wheel speeds in rpm or deg/s instead of rad/s, or of the motor before its gear? `--columns "
            "wheel_r=wheel_r:rpm,wheel_l=wheel_l:rpm` (deg/s for degrees; a number to multiply by for a gear)"
        )
    if radius > LARGEST_RATIO * track or abs(radius - 1.0) < NEAR_ONE:
        return told + (
            "rim speeds in m/s instead of rad/s? Multiply them by 1 over the radius in metres, for 0.05 m by "
            "`--columns wheel_r=wheel_r:20,wheel_l=wheel_l:20`"
        )
    return ""


def offset(response: Response, log: Log) -> str:
    """Wheel speeds that come early or late beside the poses, by about a row or more."""
    lag = float(np.mean(1.0 / response.rate))  # what a lag takes up of the offset, to first order
    late, error = response.offset - lag, response.standard_error
    step = typical_step(log)
    if response.rival is not None or not abs(late) > max(SEVERAL * step, SURE * error):
        return ""
    word, cause = ("late", "two clocks") if late > 0.0 else ("early", "two clocks, or a camera that reports late")
    return (
        f"the wheel speeds come {abs(late):.3g} s {word} beside the poses (standard error {error:.1g} s, "
        f"{abs(late) / step:.1f} rows): {cause}: `jaxident convert --log LOG --wheels-offset {-late:.3g} --out NEW`"
    )


def wheel_offset(log: Log) -> tuple[float, float] | None:
    """The time [s] to add to the wheel speeds' so that they fit the poses, and its standard error; None where the poses
    do not answer the wheel speeds, or two offsets do as well as each other."""
    found: Any = respond(_streams(log))
    if found is None or found.rival is not None or not np.max(found.explained) > EXPLAINED:
        return None
    return float(np.mean(1.0 / found.rate)) - found.offset, found.standard_error

"""What a log says against itself: frames, units, wheels, clocks, odometry. A line each, with the option that mends it.

NumPy alone, on motions from one seen pose to the next: along and to the left in the frame of the heading halfway, and
the turn. Thresholds are wide: a suspicion says what to check, it changes nothing.
"""

import numpy as np

from jaxident.errors import InputError
from jaxident.estimation.poses.parameters import Robot
from jaxident.estimation.suspicions.clock_offset import Response, respond, streams_of_log
from jaxident.estimation.suspicions.heading import (
    AGAINST,
    BACKWARDS,
    EXPLAINED,
    SURE,
    Signs,
    flipped_heading,
    misread_heading,
    signs_of,
)
from jaxident.estimation.suspicions.motions import FEWEST, Motions, motions
from jaxident.log import Log, even_period

MOST = 20_000
"""Rows that are looked at, in 4 s; 100,000 take half a minute and say the same of three real robots."""
SMALLEST_TRACK, LARGEST_TRACK = 0.01, 2.0
"""Distances between the wheels [m] of robots before a camera, wide: here simulated small robots come out at 0.02 to
0.04 m, and a Husky is half a metre wide."""
TAPS = 12
"""Rows over which the answer to a command is looked at."""
SEVERAL, EARLY = 2.0, 0.9
"""Rows of delay that are worth a word, and rows by which nothing should move before it is told to."""
LARGEST_OFFSET = 5.0
"""Offsets between clocks [s] that are looked for in a log."""
ODOMETRY, NOISY, EXACT = 0.05, 1e-3, 1e-9
"""Sideways over along: of the noise where that is at least NOISY of the motion, else of the motion itself."""


def log_suspicions(log: Log) -> tuple[str, ...]:
    """All suspicions about a log (NumPy arrays) that need no model, the same for every command: from its first MOST
    rows."""
    log = log.rows(0, MOST)
    seen = log[np.isfinite(log.x) & np.isfinite(log.y) & np.isfinite(log.theta)]  # rows of events alone have no pose
    single = motions(seen) if len(seen.t) else None
    if single is None or len(single.row) < FEWEST:
        return ()
    flipped = flipped_heading(seen, single)
    if flipped:
        return (flipped,)
    misread = misread_heading(seen)
    if misread:
        read = log._replace(theta=misread.reading.read(np.asarray(log.theta)))
        return (misread.told(signs_of(respond(streams_of_log(read), LARGEST_OFFSET))),)
    response = respond(streams_of_log(log), LARGEST_OFFSET)
    if response is None:
        return ()
    steps = np.concatenate([np.diff(run.t) for run in seen.runs()])
    lines = (wheel_signs(response), position_unit(response), offset_clock(response, float(np.median(steps))))
    return tuple(line for line in lines if line)


def odometry_suspicions(log: Log, robot: Robot) -> tuple[str, ...]:
    """Whether the poses look like wheel odometry, given the robot fitted to an even log; nothing is said of others."""
    single = motions(log)
    if len(single.row) < FEWEST or flipped_heading(log, single) or misread_heading(log):
        return ()
    gain = np.array([[float(g) for g in row] for row in robot.drive.gain])
    rate = np.array([float(r) for r in robot.drive.rate])
    left = _along_error(log, single, rate, gain, np.array([float(d) for d in robot.dead_zone]))
    line = "" if left is None else odometry(single, left)
    return (line,) if line else ()


def wheel_signs(response: Response) -> str:
    """Wheels that push the wrong way: the signs of the gains (2, 2) should be + + along and + - in heading."""
    found: dict[Signs, str] = {
        AGAINST: "the robot turns against its wheels: right and left are swapped (`--columns u_r=u_l,u_l=u_r`), "
        "or y points down (`--columns y=y:-1,theta=theta:-1`)",
        (-1, -1, -1, 1): "both wheels run backwards under positive commands: `--columns u_r=u_r:-1,u_l=u_l:-1`",
        BACKWARDS: "positive commands drive the robot backwards: the marker is turned by half a turn (`--columns "
        "theta=theta:rad+3.14159`), or both wheels are reversed and swapped (`--columns u_r=u_l:-1,u_l=u_r:-1`)",
        (-1, 1, -1, -1): "the right wheel runs backwards under positive commands: `--columns u_r=u_r:-1`",
        (1, -1, 1, 1): "the left wheel runs backwards under positive commands: `--columns u_l=u_l:-1`",
    }
    line = found.get(signs_of(response) or (), "")
    return f"{line} (signs of the gains, each {SURE:g} standard deviations clear)" if line else ""


def position_unit(response: Response) -> str:
    """Positions in another unit, by the distance between the wheels that speeds along and in heading imply."""
    along, turning = np.abs(response.gain).sum(axis=1)
    if not (signs_of(response) and along > LARGEST_TRACK * turning):
        return ""
    track = along / turning
    fits = [
        f"`--columns x=x:{unit},y=y:{unit}` (then {track / parts:.2g} m)"
        for unit, parts in (("mm", 1e3), ("cm", 1e2))
        if SMALLEST_TRACK < track / parts < LARGEST_TRACK
    ]
    mend = ": " + " or ".join(fits) if fits else ""
    return f"the wheels would stand {track:.3g} m apart: are the positions in another unit than metres{mend}?"


def offset_clock(response: Response, step: float) -> str:
    """Poses that come early or late beside the commands, by several steps [s] between poses."""
    late, error = -response.offset, response.standard_error
    known = response.rival is None and np.max(response.explained) > EXPLAINED
    if not known or not (late > max(SEVERAL * step, SURE * error) or -late > max(EARLY * step, SURE * error)):
        return ""
    mend = f"`jaxident convert --log LOG --pose-offset {response.offset:.3g} --out NEW`"
    told = f"{abs(late):.3g} s (standard error {error:.1g} s, {abs(late) / step:.1f} rows)"
    if late < 0.0:
        return f"the robot moves {told} before it is told to: the poses have another clock than the commands: {mend}"
    return (
        f"the robot answers its commands {told} late: a delay, which the nominal model has not and `jaxident diagnose` "
        f"measures, or two clocks that differ, which {mend} mends"
    )


def _along_error(log: Log, single: Motions, rate: np.ndarray, gain: np.ndarray, width: np.ndarray) -> float | None:
    """Deviation [m] of what the pull of the wheels over the last rows leaves of path lengths; None for an uneven log.

    Increments y_k - exp(-rate step) y_{k-1} leave two weights, rows 0 and 1, of a robot without delay: (13)-(14).
    """
    try:
        period = even_period(log)
    except InputError:
        return None
    passed = [np.sign(u) * np.maximum(np.abs(u) - d, 0.0) for u, d in zip(log.command, width, strict=True)]
    first = np.cumsum([0, *(len(run.t) for run in log.runs())])
    place = first[single.run] + single.row
    pull = np.nan_to_num(gain[0, 0] * passed[0] + gain[0, 1] * passed[1])
    follows = np.flatnonzero((np.diff(place) == 1) & (single.row[1:] >= TAPS)) + 1
    along = single.along()
    target = along[follows] - np.exp(-rate[0] * period) * along[follows - 1]
    columns = np.stack([pull[place[follows] - lag] for lag in range(TAPS)], axis=1)
    if len(target) < 4 * TAPS or np.linalg.matrix_rank(columns) < TAPS:
        return None
    return float(np.std(target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0]))


def odometry(single: Motions, left: float) -> str:
    """Poses that never err sideways come from wheels, not from a camera."""
    sideways, motion = np.std(single.left()), np.sqrt(np.mean(single.along() ** 2))
    turning = np.sqrt(np.mean(single.turn**2)) > 1e-3
    share = sideways / left if left > NOISY * motion else sideways / motion * ODOMETRY / EXACT
    if not (turning and share < ODOMETRY):
        return ""
    return (
        f"sideways the poses err by {sideways:.1g} m per row, along by {left:.1g} m: they look like wheel "
        "odometry, which hides the slip that a camera would see"
    )

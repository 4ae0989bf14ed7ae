"""What a log says against itself: frames, units, wheels, clocks, odometry. A line each, with the option that mends it.

NumPy alone, on motions from one seen pose to the next: along and to the left in the frame of the heading halfway, and
the turn. Thresholds are wide: a suspicion says what to check, it changes nothing.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from jaxident.errors import InputError
from jaxident.estimation.poses.parameters import Robot
from jaxident.estimation.suspicions.clock_offset import Response, respond, streams_of_log
from jaxident.log import Log, even_period

FEWEST = 30
"""Motions that a judgement needs."""
MOST = 20_000
"""Rows that are looked at, in 4 s; 100,000 take half a minute and say the same of three real robots."""
LARGEST_TRACK = 5.0
"""Distance between the wheels [m] beyond which positions are hardly in metres."""
SURE = 5.0
"""Standard deviations from zero at which the sign of a gain counts."""
TAPS = 12
"""Rows over which the answer to a command is looked at."""
SEVERAL, EARLY = 2.0, 0.9
"""Rows of delay that are worth a word, and rows by which nothing should move before it is told to."""
LARGEST_OFFSET = 5.0
"""Offsets between clocks [s] that are looked for in a log."""
EXPLAINED = 0.1
"""Least share of the motion's variance that commands explain before anything is read from it."""
ODOMETRY, NOISY, EXACT = 0.05, 1e-3, 1e-9
"""Sideways over along: of the noise where that is at least NOISY of the motion, else of the motion itself."""
SIDEWAYS, STRAIGHT = 0.3, 0.1
"""Share of sideways motion that puzzles, and the one that a better reading of the heading must reach."""


class Motions(NamedTuple):
    """Between rows `lag` apart with poses (motions,): run and row they start from, displacement [m], heading halfway
    and turn [rad]."""

    run: Any
    row: Any
    dx: Any
    dy: Any
    middle: Any
    turn: Any

    def along(self) -> np.ndarray:
        """Path length of the arc whose chord was seen [m]."""
        chord = self.dx * np.cos(self.middle) + self.dy * np.sin(self.middle)
        return chord / np.sinc(self.turn / (2.0 * np.pi))

    def left(self) -> np.ndarray:
        """Sideways motion [m]."""
        return self.dy * np.cos(self.middle) - self.dx * np.sin(self.middle)


def motions(log: Log, lag: int = 1, read: Callable[[np.ndarray], np.ndarray] = np.asarray) -> Motions:
    """Motions over `lag` rows; `read` turns the heading column into headings."""
    parts = []
    for number, run in enumerate(log.runs()):
        x, y, theta = np.asarray(run.x), np.asarray(run.y), read(np.asarray(run.theta))
        rows = np.flatnonzero(np.isfinite(x[lag:] + x[:-lag] + theta[lag:] + theta[:-lag]))
        turn = (theta[rows + lag] - theta[rows] + np.pi) % (2.0 * np.pi) - np.pi
        parts.append(
            (np.full(len(rows), number), rows, x[rows + lag] - x[rows], y[rows + lag] - y[rows],
             theta[rows] + 0.5 * turn, turn)
        )  # fmt: skip
    return Motions(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def log_suspicions(log: Log) -> tuple[str, ...]:
    """All suspicions about a log (NumPy arrays) that need no model, the same for every command: from its first MOST
    rows."""
    log = log.rows(0, MOST)
    seen = log[np.isfinite(log.x) & np.isfinite(log.y) & np.isfinite(log.theta)]  # rows of events alone have no pose
    single = motions(seen) if len(seen.t) else None
    if single is None or len(single.row) < FEWEST:
        return ()
    frame = flipped_heading(seen, single) or misread_heading(seen)
    response = None if frame else respond(streams_of_log(log), LARGEST_OFFSET)
    if response is None:
        return (frame,) if frame else ()
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


def flipped_heading(log: Log, single: Motions) -> str:
    """Half turns from one row to the next, by a robot that does not turn fast."""
    size = np.abs(single.turn)
    half, odd = size > np.pi - 0.5, (size > 1.2) & (size <= np.pi - 0.5)
    if not half.any() or np.median(size) > 0.5 or 4 * odd.sum() > half.sum():
        return ""
    first = np.argmax(half)
    t = log.runs()[single.run[first]].t[single.row[first] + 1]
    return f"the heading jumps by half a turn {half.sum()} times, first at t = {t:g} s: a marker read upside down?"


def misread_heading(log: Log) -> str:
    """Motion that would point along the heading if the column were read in another way."""
    noise = _position_noise(log)
    readings: dict[str, Callable[[np.ndarray], np.ndarray]] = {
        "": np.asarray,
        "degrees: `--columns theta=theta:deg`": np.radians,
        "mirrored, as in a picture whose y axis points down: `--columns y=y:-1`": np.negative,
        "as if x and y were swapped: `--columns x=y,y=x`": lambda theta: 0.5 * np.pi - theta,
        "a quarter turn off, the marker sits sideways: `--columns theta=theta:rad+1.5708`": lambda theta: (
            theta + 0.5 * np.pi
        ),
    }
    shares = {text: _sideways(log, noise, read) for text, read in readings.items()}
    best = min(shares, key=lambda text: shares[text])
    if not (shares[""] > SIDEWAYS and shares[best] < STRAIGHT):
        return ""
    numbers = f"{100 * shares['']:.0f} % of the motion is sideways, {100 * shares[best]:.0f} % if it were"
    return f"the heading does not point where the robot goes ({numbers}): it looks {best}"


def _position_noise(log: Log) -> float:
    """Camera noise in position [m] from third differences, which motion hardly reaches."""
    thirds = [np.diff(np.asarray(column), 3) for run in log.runs() for column in (run.x, run.y)]
    size = np.abs(np.concatenate(thirds))
    return float(1.48 * np.median(size[np.isfinite(size)])) / np.sqrt(20.0) if np.isfinite(size).any() else np.inf


def _sideways(log: Log, noise: float, read: Callable[[np.ndarray], np.ndarray]) -> float:
    """Share of sideways in the squared motion, over the fewest rows that bring it clear of the noise."""
    for lag in (1, 2, 4, 8, 16):
        moved = motions(log, lag, read)
        straight = np.abs(moved.turn) < 1.0
        size = (moved.dx**2 + moved.dy**2)[straight]
        if size.size >= FEWEST and np.sqrt(np.mean(size)) > 6.0 * noise:
            return float(np.mean(moved.left()[straight] ** 2) / np.mean(size))
    return np.nan


def _sure(response: Response) -> bool:
    """Whether the signs of all gains count."""
    clear = np.all(np.abs(response.gain) >= SURE * response.gain_deviation)
    return bool(clear and np.all(response.explained > EXPLAINED))


def wheel_signs(response: Response) -> str:
    """Wheels that push the wrong way: the signs of the gains (2, 2) should be + + along and + - in heading."""
    if not _sure(response):
        return ""
    found: dict[tuple[int, ...], str] = {
        (1, 1, -1, 1): "the robot turns against its wheels: right and left are swapped (`--columns u_r=u_l,u_l=u_r`), "
        "or y points down (`--columns y=y:-1,theta=theta:-1`)",
        (-1, -1, -1, 1): "both wheels run backwards under positive commands: `--columns u_r=u_r:-1,u_l=u_l:-1`",
        (-1, -1, 1, -1): "positive commands drive the robot backwards: the marker is turned by half a turn (`--columns "
        "theta=theta:rad+3.14159`), or both wheels are reversed and swapped (`--columns u_r=u_l:-1,u_l=u_r:-1`)",
        (-1, 1, -1, -1): "the right wheel runs backwards under positive commands: `--columns u_r=u_r:-1`",
        (1, -1, 1, 1): "the left wheel runs backwards under positive commands: `--columns u_l=u_l:-1`",
    }
    line = found.get(tuple(int(s) for s in np.sign(response.gain).ravel()), "")
    return f"{line} (signs of the gains, each {SURE:g} standard deviations clear)" if line else ""


def position_unit(response: Response) -> str:
    """The distance between the wheels that speeds along and in heading imply."""
    along, turning = np.abs(response.gain).sum(axis=1)
    if not (_sure(response) and along > LARGEST_TRACK * turning):
        return ""
    return (
        f"the wheels would stand {along / turning:.3g} m apart: positions in millimetres instead of metres? `--columns "
        "x=x:mm,y=y:mm` (cm for centimetres)"
    )


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

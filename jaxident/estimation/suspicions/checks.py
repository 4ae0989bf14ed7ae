"""What a log must have before anything can be estimated from it."""

import numpy as np

from jaxident.errors import InputError
from jaxident.estimation.suspicions.heading import DEGREES, misread_heading
from jaxident.estimation.suspicions.wheel_answer import answer_of_wheels, told
from jaxident.estimation.suspicions.wheel_suspicions import wheels_turn
from jaxident.log import Log
from jaxident.rules import check_pose_rate

LOST_HEADING = 1.5
"""Root-mean-square turn [rad] from pose to pose beyond which nobody knows which way the robot turned; headings at
random give 1.81."""
STILL_RATIO = 2.0
"""A robot that moves is displaced over many rows by more than this times its row-to-row camera error."""


def check_informative(log: Log) -> None:
    """InputError with the reason if the log cannot show how the robot answers its commands."""
    seen = np.isfinite(log.x) & np.isfinite(log.y) & np.isfinite(log.theta)
    check_log_rate(log)
    if np.count_nonzero(seen) < 3:
        raise InputError(f"{np.count_nonzero(seen)} measured poses: at least 3 are needed to see any motion")
    if all(np.ptp(np.asarray(u)) == 0.0 for u in log.command):
        raise InputError("no excitation: both commands are constant, so nothing shows how the robot answers them")
    turn = _turn(log, seen)
    if turn > LOST_HEADING and not _in_degrees(log):  # these are told, and fitted
        raise InputError(
            f"the headings turn by {turn:.2g} rad from pose to pose (root mean square), where headings at random turn "
            "by 1.8 rad: they are noise, or of a robot that turns faster than the camera sees"
        )
    if not moves(log, seen):
        raise InputError(
            "nothing moves: the poses are at rest within the camera's noise while the commands change"
            + (_in_the_air(log) if wheels_turn(log) else "")
        )


def check_log_rate(log: Log) -> None:
    """InputError where the poses of a log come at no camera's rate: its times have another unit."""
    steps = [np.diff(np.asarray(run.t)[np.isfinite(run.x)]) for run in log.runs()]
    check_pose_rate("log", np.concatenate(steps))


def _in_degrees(log: Log) -> bool:
    misread = misread_heading(log)
    return misread is not None and misread.reading is DEGREES


def _in_the_air(log: Log) -> str:
    """What wheels tell that turn while nothing moves."""
    answer = answer_of_wheels(log)
    return "; its wheels turn: are they in the air? `jaxident motors` finds what they show, the motors" + (
        "" if answer is None else f" ({told(answer)})"
    )


def _turn(log: Log, seen: np.ndarray) -> float:
    """Root-mean-square turn [rad] between poses that follow each other, each within half a turn."""
    runs = Log(*(np.asarray(column)[seen] for column in log)).runs()
    turns = np.concatenate([np.diff(run.theta) for run in runs])
    return float(np.sqrt(np.mean(((turns + np.pi) % (2.0 * np.pi) - np.pi) ** 2))) if turns.size else 0.0


def moves(log: Log, seen: np.ndarray) -> bool:
    """Whether displacement grows with the time between poses, as motion does and camera noise does not."""
    tracks = [
        np.stack([run.x, run.y, np.unwrap(run.theta)])
        for run in Log(*(np.asarray(column)[seen] for column in log)).runs()
        if len(run.t) > 1
    ]
    longest = max((track.shape[1] for track in tracks), default=0)
    lags = [2**k for k in range(longest.bit_length()) if 2**k < longest]
    spread = np.array([_displacement(tracks, lag) for lag in lags])
    return bool(lags) and bool(np.any(spread.max(axis=0) > STILL_RATIO * spread[0]))


def _displacement(tracks: list[np.ndarray], lag: int) -> np.ndarray:
    """Root-mean-square displacement [m], [rad] over `lag` measured poses."""
    moved = np.concatenate([track[:, lag:] - track[:, :-lag] for track in tracks], axis=1)
    return np.sqrt(np.array([np.mean(moved[0] ** 2 + moved[1] ** 2), np.mean(moved[2] ** 2)]))

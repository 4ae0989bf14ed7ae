"""Whether the heading points where the robot goes, and the option that makes it so if it does not."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from jaxident.estimation.suspicions.clock_offset import Response
from jaxident.estimation.suspicions.motions import FEWEST, Motions, motions
from jaxident.log import Log

SIDEWAYS, STRAIGHT = 0.3, 0.1
"""Share of sideways motion that puzzles, and the one that a better reading of the heading must reach."""
SURE = 5.0
"""Standard deviations from zero at which the sign of a gain, or an offset, counts."""
EXPLAINED = 0.1
"""Least share of the motion's variance that commands or wheel speeds explain before anything is read from it."""
Signs = tuple[int, ...]
RIGHT: Signs = (1, 1, 1, -1)
"""Signs of the gains of a robot whose log is right: right and left wheel along, right and left wheel in turn."""
AGAINST: Signs = (1, 1, -1, 1)
"""Signs of the gains of a robot that turns against its wheels."""
BACKWARDS: Signs = (-1, -1, 1, -1)
"""Signs of the gains of a robot that drives backwards under positive commands."""


class Reading(NamedTuple):
    """Another way to read the heading column: the headings [rad] that it gives, and by the signs of the gains under
    them what the column looks like, with the option that mends the log."""

    read: Callable[[np.ndarray], np.ndarray]
    looks: dict[Signs, str]


DEGREES = Reading(np.radians, {RIGHT: "in degrees: `--columns theta=theta:deg`"})
READINGS = (
    DEGREES,
    Reading(
        np.negative,
        {
            AGAINST: "mirrored, as in a picture whose y axis points down: `--columns y=y:-1`",
            RIGHT: "counted clockwise: `--columns theta=theta:-1`",
        },
    ),
    Reading(
        lambda theta: 0.5 * np.pi - theta,
        {
            AGAINST: "as if x and y were swapped: `--columns x=y,y=x`",
            RIGHT: "counted clockwise from the y axis, as on a compass: `--columns theta=theta:-1+1.5708`",
        },
    ),
    Reading(
        lambda theta: theta + 0.5 * np.pi,
        {
            RIGHT: "a quarter turn off, the marker sits sideways: `--columns theta=theta:rad+1.5708`",
            BACKWARDS: "a quarter turn off, the marker sits sideways: `--columns theta=theta:rad-1.5708`",
        },
    ),
)


class Misread(NamedTuple):
    """A heading that fits the motion better in another reading, and the shares of sideways motion as it is and so."""

    reading: Reading
    given: float
    read: float

    def told(self, signs: Signs | None) -> str:
        """The line for the user; `signs` of the gains under the new reading choose what mends it, others tell all."""
        looks = self.reading.looks
        found = looks[signs] if signs in looks else ", or ".join(looks.values())
        numbers = f"{100 * self.given:.0f} % of the motion is sideways, {100 * self.read:.0f} % if it were"
        return f"the heading does not point where the robot goes ({numbers}): it looks {found}"


def flipped_heading(log: Log, single: Motions) -> str:
    """Half turns from one row to the next, by a robot that does not turn fast."""
    size = np.abs(single.turn)
    half, odd = size > np.pi - 0.5, (size > 1.2) & (size <= np.pi - 0.5)
    if not half.any() or np.median(size) > 0.5 or 4 * odd.sum() > half.sum():
        return ""
    first = np.argmax(half)
    t = log.runs()[single.run[first]].t[single.row[first] + 1]
    return f"the heading jumps by half a turn {half.sum()} times, first at t = {t:g} s: a marker read upside down?"


def misread_heading(log: Log) -> Misread | None:
    """The reading of the heading column under which the robot moves along its heading, if it does not as it is."""
    noise = _position_noise(log)
    given = _sideways(log, noise, np.asarray)
    if not given > SIDEWAYS:
        return None
    shares = [_sideways(log, noise, reading.read) for reading in READINGS]
    best = min(range(len(READINGS)), key=lambda number: shares[number])
    return Misread(READINGS[best], given, shares[best]) if shares[best] < STRAIGHT else None


def signs_of(response: Response | None) -> Signs | None:
    """Signs of the gains, right and left wheel along, then both in turn; None if one of them is not sure."""
    if response is None or not np.all(response.explained > EXPLAINED):
        return None
    if not np.all(np.abs(response.gain) >= SURE * response.gain_deviation):
        return None
    return tuple(int(sign) for sign in np.sign(response.gain).ravel())


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

"""What is known of the nominal robot before its log is read: its two wheels are alike, and it answers its commands.

A log that turns one way only, or mostly at one command, says little of each wheel's own gain. Flat priors then take an
effect for wheels that differ: half a Create's log, on which speed falls in left turns, asked for a left wheel that
drives backwards at 0.4 times what the right one does.

In the plane of a channel's two gains, equal wheels stand at 45 degrees. The angle from there is normal about zero. It
is that of a line, between -90 and 90 degrees: a robot whose commands or whose camera's axes point the other way is as
likely.

Every window has start speeds of its own, and a robot that coasts keeps them: it fits nearly any motion and predicts
none. Where the windows ask for such a robot (`nominal.coasts`), its rates and couplings are held: as a given nominal
model has them or, as `identify` does, at what robots have, without coupling.
"""

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.motion.windows import Windows
from jaxident.effects.coordinates import NOMINAL
from jaxident.estimation.poses.prior import HALF_TRACK, RATE, RATE_SPREAD

SPREAD = 0.1
"""Deviation [rad] of the angle: gains that differ by a fifth. No other value was tried."""
GAINS = [(NOMINAL.index(f"gain_{channel}1"), NOMINAL.index(f"gain_{channel}2")) for channel in (1, 2)]
"""Places of both gains of each channel."""
_SIGNS = (1.0, -1.0)
HOLDS = [NOMINAL.index(name) for name in ("rate_1", "rate_2", "coupling_1", "coupling_2")]
"""Places of what may be held."""
FIRMLY = 1e6
"""Weight on the departure of what is held. At 1e4 a log that shows another rate clearly moved one by 1.6 %."""
MIDDLE = np.array([np.log(RATE), np.log(RATE), 0.0, 0.0])
_WIDTH = np.array([RATE_SPREAD, RATE_SPREAD, RATE * HALF_TRACK, RATE / HALF_TRACK])
"""Middle and deviation of each of them under the prior of `estimation.poses.prior`."""


def departures(vector: Array, windows: Windows) -> tuple[np.ndarray, np.ndarray]:
    """How far a vector (SIZE,) departs from what is known, in deviations (6,), and the derivatives by the nominal
    coordinates (6, 10): the gains of both channels from equal wheels, and what is held from where it is held."""
    away, slopes = np.zeros(2 + len(HOLDS)), np.zeros((2 + len(HOLDS), len(NOMINAL)))
    for channel, ((right, left), sign) in enumerate(zip(GAINS, _SIGNS, strict=True)):
        one, other = vector[right], sign * vector[left]
        angle = np.arctan2(other, one) - 0.25 * np.pi
        away[channel] = (angle - np.pi * np.round(angle / np.pi)) / SPREAD
        square = max(one**2 + other**2, 1e-12)
        slopes[channel, [right, left]] = np.array([-other, sign * one]) / square / SPREAD
    weight = np.where(np.isfinite(windows.held), FIRMLY, 0.0) / _WIDTH
    away[2:] = weight * (vector[HOLDS] - np.nan_to_num(windows.held))
    slopes[np.arange(2, 2 + len(HOLDS)), HOLDS] = weight
    return away, slopes


def held_rates(windows: Windows) -> tuple[str, ...]:
    """Names of the rates that are held in some windows."""
    return tuple(name for name, value in zip(NOMINAL[:2], windows.held, strict=False) if np.isfinite(value))


def as_held(vector: Array, windows: Windows) -> np.ndarray:
    """A vector (SIZE,) with what is held exactly where it is held, next to which a fit ends."""
    found = np.array(vector, float)
    found[HOLDS] = np.where(np.isfinite(windows.held), windows.held, found[HOLDS])
    return found


def unlikeliness(vector: Array, windows: Windows) -> float:
    """-log p of a vector but for a constant, 0 for equal wheels."""
    return 0.5 * float(np.sum(departures(vector, windows)[0] ** 2))


def with_prior(products: Array, vector: Array, windows: Windows) -> np.ndarray:
    """Summed products (n, n) of columns, the nominal coordinates first and the residual last, with the prior's."""
    away, slopes = departures(vector, windows)
    rows = np.zeros((len(away), len(products)))
    rows[:, : len(NOMINAL)], rows[:, -1] = slopes, -away
    return products + rows.T @ rows


def as_uncertain_as_prior(covariance: Array, windows: Windows) -> np.ndarray:
    """A covariance (n, n), the nominal coordinates first, in which rates that are held are as uncertain as the prior
    says, and all else as much more as it answers to that. Couplings that are held are certain."""
    chosen = np.flatnonzero(np.isfinite(windows.held[:2]))
    if not len(chosen):
        return covariance
    places = np.array(HOLDS)[chosen]
    own = covariance[np.ix_(places, places)]
    answers = np.linalg.solve(own, covariance[places]).T
    return covariance + answers @ (np.diag(_WIDTH[chosen] ** 2) - own) @ answers.T

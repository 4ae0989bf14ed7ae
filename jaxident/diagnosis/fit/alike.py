"""What is known of the nominal robot before its log is read: its two wheels are alike.

A log that turns one way only, or mostly at one command, says little of each wheel's own gain. Flat priors then take an
effect for wheels that differ: half a Create's log, on which speed falls in left turns, asked for a left wheel that
drives backwards at 0.4 times what the right one does.

In the plane of a channel's two gains, equal wheels stand at 45 degrees. The angle from there is normal about zero. It
is that of a line, between -90 and 90 degrees: a robot whose commands or whose camera's axes point the other way is as
likely.
"""

import numpy as np

from jaxident.array_types import Array
from jaxident.effects.coordinates import NOMINAL

SPREAD = 0.1
"""Deviation [rad] of the angle: gains that differ by a fifth. No other value was tried."""
GAINS = [(NOMINAL.index(f"gain_{channel}1"), NOMINAL.index(f"gain_{channel}2")) for channel in (1, 2)]
"""Places of both gains of each channel."""
_SIGNS = (1.0, -1.0)


def departures(vector: Array) -> tuple[np.ndarray, np.ndarray]:
    """How far the gains of a vector (SIZE,) depart from equal wheels, in deviations (2,), and the derivatives by the
    nominal coordinates (2, 10)."""
    away, slopes = np.zeros(2), np.zeros((2, len(NOMINAL)))
    for channel, ((right, left), sign) in enumerate(zip(GAINS, _SIGNS, strict=True)):
        one, other = vector[right], sign * vector[left]
        angle = np.arctan2(other, one) - 0.25 * np.pi
        away[channel] = (angle - np.pi * np.round(angle / np.pi)) / SPREAD
        square = max(one**2 + other**2, 1e-12)
        slopes[channel, [right, left]] = np.array([-other, sign * one]) / square / SPREAD
    return away, slopes


def unlikeliness(vector: Array) -> float:
    """-log p of the gains of a vector, 0 for equal wheels."""
    return 0.5 * float(np.sum(departures(vector)[0] ** 2))


def with_prior(products: Array, vector: Array) -> np.ndarray:
    """Summed products (n, n) of columns, the nominal coordinates first and the residual last, with the prior's."""
    away, slopes = departures(vector)
    rows = np.zeros((len(away), len(products)))
    rows[:, : len(NOMINAL)], rows[:, -1] = slopes, -away
    return products + rows.T @ rows

"""A curve or surface with a roughness prior, on Gram matrices: its size by restricted likelihood, and what it brings
where it was not fitted.

The values at the knots are normal about zero, with the precision (D' D + FLAT I) / s^2, D second differences: a
penalised spline (Eilers, Marx 1996, Statistical Science 11). For a surface D holds first differences along both signals
(Eilers, Marx 2003, Chemometrics and Intelligent Laboratory Systems 66, has second ones): where the robot was not, it is
as it is nearby, and goes on in no straight line. s is the one of greatest restricted likelihood, nominal parameters,
effects and start states being free; no smoothing is set by hand.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from jaxident.array_types import Array

FLAT = 1e-3
"""Precision of the values themselves over that of their second differences: straight lines are nearly free. No other
value was tried."""
HELD = 1e6
"""Precision of what the nominal robot has as well, in the same unit. Were it free, a gain could grow while a curve
falls: along that bent valley a refit did not arrive in ten steps (warm motors). At 1e3 the prior held
nothing of a curve whose s is large: a rate fell from 4.4 to 0.1 1/s (one robot, patch 1 of `experiments.unlisted`)."""
SIZES = np.geomspace(1e-8, 1e8, 65)
"""Variances s^2 that are tried, in units of the mean variance of a knot's value without a prior."""
FOLDS = 4
"""Groups of windows, every fourth in one, of which each is left out once. Neighbours in one
group do not do: where the robot has been once only, the curve left out would have to go on straight from elsewhere."""


class Bent(NamedTuple):
    """A curve found: log evidence over none; what it brings to windows that had no part in its fit, as a fall of -log
    p; and the variance s^2 of its prior."""

    evidence: float
    held_out: float
    variance: float


def precision(at: Sequence[Array], nominal: Array, closed: bool = False) -> np.ndarray:
    """Prior precision (n, n) of a law of unit size with some knots along each of its signals; n: all its knots, row by
    row. nominal (n, m): combinations of values that the nominal robot has as well, and the law has not. closed: of a
    curve whose last knot is its first one again, as an angle's."""
    whole, order = np.zeros((1, 1)), 2 if len(at) == 1 else 1
    for knots in at:
        bend = np.diff(np.eye(len(knots)), order, axis=0)
        if closed:
            unit = np.eye(len(knots))
            bend = np.vstack([bend, unit[-2] - 2.0 * unit[-1] + unit[1], np.sqrt(HELD) * (unit[-1] - unit[0])])
        whole = np.kron(whole, np.eye(len(knots))) + np.kron(np.eye(len(whole)), bend.T @ bend)
    basis, _ = np.linalg.qr(nominal)
    return whole + FLAT * np.eye(len(whole)) + HELD * basis @ basis.T


def bend(by_window: Array, prior: Array, smooth: Array) -> Bent:
    """The law whose columns stand last before the residual, all other columns free under their prior.

    by_window (windows, n, n): products of columns, the residual last; prior (n, n): what a prior of the others adds;
    smooth (knots, knots): `precision` of the law.
    """
    summed, knots = by_window.sum(axis=0) + prior, len(smooth)
    free = len(summed) - 1 - knots
    left, right = _freed(summed, free)
    root = np.linalg.cholesky(np.linalg.inv(smooth))
    power, turn = np.linalg.eigh(root.T @ left @ root)
    power, share = np.maximum(power, 0.0), (turn.T @ (root.T @ right)) ** 2
    sizes = SIZES / max(float(np.mean(power)), 1e-300)
    grown = sizes[:, None] * power
    evidence = 0.5 * np.sum(sizes[:, None] * share / (1.0 + grown) - np.log1p(grown), axis=1)
    best = int(np.argmax(evidence))
    return Bent(float(evidence[best]), _held_out(by_window, prior, smooth / sizes[best]), float(sizes[best]))


def _freed(summed: Array, free: int) -> tuple[np.ndarray, np.ndarray]:
    """Products of the later columns, and with the residual, the first `free` eliminated."""
    length = np.sqrt(np.maximum(np.diagonal(summed)[:free], 1e-300))
    own = summed[:free, :free] / length[:, None] / length + 1e-10 * np.eye(free)
    cross = summed[:free, free:] / length[:, None]
    rest = summed[free:, free:] - cross.T @ np.linalg.solve(own, cross)
    return rest[:-1, :-1], rest[:-1, -1]


def _held_out(by_window: Array, prior: Array, own_prior: Array) -> float:
    """The fall of -log p on windows left out, less that of a fit without the curve."""
    fold, knots = np.arange(len(by_window)) % FOLDS, len(own_prior)
    smooth = np.zeros_like(prior)
    smooth[-1 - knots : -1, -1 - knots : -1] = own_prior
    whole = by_window.sum(axis=0)
    gained = 0.0
    for number in range(FOLDS):
        own = by_window[fold == number].sum(axis=0)
        rest = whole - own + prior
        with_curve, without = solved(rest + smooth, len(rest) - 1), solved(rest, len(rest) - 1 - knots)
        gained += _loss(own, without) - _loss(own, with_curve)
    return float(gained)


def solved(summed: Array, count: int) -> np.ndarray:
    """The best multiples (n - 1,) of the first `count` columns, the others at zero."""
    length = np.sqrt(np.maximum(np.diagonal(summed)[:count], 1e-300))
    own = summed[:count, :count] / length[:, None] / length + 1e-10 * np.eye(count)
    found = np.zeros(len(summed) - 1)
    found[:count] = np.linalg.solve(own, summed[:count, -1] / length) / length
    return found


def _loss(own: Array, size: Array) -> float:
    """Half the squares that multiples of columns leave."""
    return 0.5 * float(own[-1, -1] - 2.0 * size @ own[:-1, -1] + size @ own[:-1, :-1] @ size)

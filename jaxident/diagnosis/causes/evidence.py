"""The log evidence of sets of effects, on a table of answers that are linear about one fit.

With G and b the sums over windows of a table's products and cross products, and x what its columns are multiplied with,
normal about zero with the table's scale, the log evidence of a set by Laplace's method is

    1/2 b' (G + L)^-1 b - 1/2 log |I + L^-1/2 G L^-1/2| + log P(set),      L = diag(scale)^-2.

A column that asks for more than its scale widens it to that, once. The evidence takes the model for true. Where
something is missing in the model, some windows pay for an effect that the others do not want. So what an effect is
worth beside others is half of x' V^-1 x, where that is less, with

    V = (G + L)^-1 (J + L) (G + L)^-1,   J the sum over windows of s s',   s = b_i - G_i x their scores

(Huber 1967; White 1982, Econometrica 50; for posteriors Ribatet, Cooley and Davison 2012, Statistica Sinica 22).
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.causes.columns import LOW, NEUTRAL, Table
from jaxident.diagnosis.fit.refit import Solution
from jaxident.diagnosis.motion.linear import spread
from jaxident.effects.coordinates import NOMINAL, PLACES, SHAPES, SMOOTH, limits, sizes

CHANCE = float(np.log(0.03 / 0.97))
"""Prior log odds that an effect takes part: of some thirty in the catalogue a real robot shows one or two clearly."""
WRONG = -1e9
"""Log evidence of what cannot be: an effect whose sign would have to be the other one, or a fit that has not
arrived."""
_PLACE_NAMES = {place: pair for pair, place in PLACES.items()}


class Worth(NamedTuple):
    """gain: fall of -log p that an effect brings beside others, the model taken for true; evidence: its log evidence,
    windows that disagree considered."""

    gain: float
    evidence: float


class _Posterior(NamedTuple):
    """Columns that are free, in units of their scale (n,): mean (n,) and precision (n, n)."""

    columns: list[int]
    scale: Any
    mean: Any
    precision: Any


def _posterior(table: Table, chosen: Sequence[int]) -> _Posterior:
    """Of all columns of some options; those that would have the wrong sign stay at zero.

    A size beyond its prior's deviation widens that deviation to itself, once: a robot of another scale is no surprise.
    A Create's turn loss is twenty deviations of the catalogue's, which would cost 200 units of log evidence.
    """
    columns = [column for k in chosen for column in table.options[k].columns]
    whole, right = table.whole[np.ix_(columns, columns)], table.right[columns]
    scale, positive = table.scale[columns], table.positive[columns]
    _, mean, free = _positive_mean(whole, right, scale, np.arange(len(columns)), positive)
    scale[free] *= np.maximum(1.0, np.abs(mean))
    precision, mean, free = _positive_mean(whole, right, scale, free, positive)
    return _Posterior([columns[k] for k in free], scale[free], mean, precision)


def _positive_mean(whole: Array, right: Array, scale: Array, free: Array, positive: Array) -> tuple[Any, Any, Any]:
    """Precision and mean of the free columns, those left out that would have the wrong sign; and which are free."""
    precision = whole * scale[:, None] * scale + np.eye(len(scale))
    while len(free):
        mean = np.linalg.solve(precision[np.ix_(free, free)], right[free] * scale[free])
        wrong = (mean < 0.0) & positive[free]
        if not wrong.any():
            return precision[np.ix_(free, free)], mean, free
        free = free[~wrong]
    return np.zeros((0, 0)), np.zeros(0), free


def posterior_mean(table: Table, chosen: Sequence[int]) -> dict[int, float]:
    """What each column of some options is multiplied with, those left out that would have the wrong sign."""
    columns, scale, mean, _ = _posterior(table, chosen)
    return dict(zip(columns, (mean * scale).tolist(), strict=True))


def log_evidence(table: Table, chosen: Sequence[int]) -> float:
    """Of some options together, less that of none, the model taken for true."""
    if not chosen:
        return 0.0
    columns, _, mean, precision = _posterior(table, chosen)
    if not columns:
        return WRONG
    fall = 0.5 * float(mean @ precision @ mean)
    room = 0.5 * float(np.linalg.slogdet(precision)[1]) - np.log(2.0) * int(table.positive[columns].sum())
    return fall - room + sum(CHANCE - table.options[k].price for k in chosen)


def worth(table: Table, chosen: Sequence[int], option: int) -> Worth:
    """What one of some options is worth beside the others."""
    columns, scale, mean, precision = _posterior(table, chosen)
    own = [columns.index(column) for column in table.options[option].columns if column in columns]
    if not own:
        return Worth(0.0, WRONG)
    scores = (table.cross[:, columns] - table.products[:, columns][:, :, columns] @ (mean * scale)) * scale
    covariance = np.linalg.inv(precision)
    sandwich = (covariance @ (spread(scores) + np.eye(len(columns))) @ covariance)[np.ix_(own, own)]
    plain = covariance[np.ix_(own, own)]
    gain, honest = (0.5 * float(mean[own] @ np.linalg.solve(each, mean[own])) for each in (plain, sandwich))
    positive = int(table.positive[[columns[k] for k in own]].sum())
    room = -0.5 * float(np.linalg.slogdet(plain)[1]) - np.log(2.0) * positive
    return Worth(gain, min(gain, honest) - room + CHANCE - table.options[option].price)


def evidence_of(fit: Solution, count: int) -> float:
    """Log evidence of a fit with `count` effects, at the fit, but for what all fits under one noise law share; WRONG of
    one that a bound of the search has stopped: half a Create's log asked for five times the load in its last second,
    and its robot then left the room."""
    free = [k for k, place in enumerate(fit.places) if place >= len(NOMINAL)]
    if not free:
        return -fit.cost
    places = [fit.places[k] for k in free]
    if _stopped(fit, places):
        return WRONG
    # a limit has no distance from neutral, and what only shapes an effect no neutral value
    measured = [_PLACE_NAMES[place] not in SHAPES and _PLACE_NAMES[place][0] in SMOOTH for place in places]
    size = np.where(measured, fit.vector[places] - NEUTRAL[places], 0.0)
    scale = np.maximum(sizes()[places], np.abs(size))  # as in `_posterior`
    size = size / scale
    precision = np.linalg.inv(fit.covariance[np.ix_(free, free)]) * scale[:, None] * scale + np.eye(len(free))
    positive = int(np.sum(LOW[places] == NEUTRAL[places]))
    room = 0.5 * float(np.linalg.slogdet(precision)[1]) + 0.5 * float(size @ size) - np.log(2.0) * positive
    return -fit.cost - room + CHANCE * count


def _stopped(fit: Solution, places: Sequence[int]) -> bool:
    """Whether the size of an effect stands at a bound of the search at which the effect is not neutral."""
    low, high = limits()
    for place in places:
        value, bounds = fit.vector[place], (low[place], high[place])
        if _PLACE_NAMES[place] not in SHAPES and any(value == end != NEUTRAL[place] for end in bounds):
            return True
    return False

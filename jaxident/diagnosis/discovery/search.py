"""The laws that are discovered: one after the other, the one that brings most, until none is worth it.

What a curve is worth is the smaller of its log evidence, less the price of having looked at so many kinds, and what it
brings to stretches that it was not fitted to. The runs kept for judging have no part in this.
"""

import itertools
from typing import NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.causes.finding import Finding
from jaxident.diagnosis.causes.search_rounds import SURE
from jaxident.diagnosis.causes.settled import LIKELY, whiten
from jaxident.diagnosis.discovery.curves import Bent, bend
from jaxident.diagnosis.discovery.fit import (
    Bending,
    Curve,
    curve_columns,
    obeying,
    prior_of,
    refit_with,
    smoothness,
)
from jaxident.diagnosis.fit.prior import with_prior
from jaxident.diagnosis.fit.refit import Data, Solution
from jaxident.diagnosis.laws.candidates import candidates, of_wheel, path_of
from jaxident.diagnosis.laws.kinds import KINDS, Kind
from jaxident.diagnosis.laws.not_shown import not_shown
from jaxident.diagnosis.laws.wheel_angle import turnings
from jaxident.diagnosis.motion.linear import without_starts
from jaxident.diagnosis.motion.responses import respond
from jaxident.diagnosis.motion.windows import Windows
from jaxident.diagnosis.noise.sizing import size_noise
from jaxident.effects.law_arrays import acting
from jaxident.effects.law_kinds import MOST_LAWS

PRICE = float(np.log(len(KINDS)))
"""Of having looked at all kinds of laws."""
ALIKE = 0.9
"""Part of what the best curve brings from which on another kind is told with it. The product of both speeds, which two
kinds hold, brought 0.98 by the other one; other kinds at most 0.42 (three simulated robots)."""
MOST_SETS = 3
"""Of curves that a search follows. No other number was tried."""


class Worthy(NamedTuple):
    """A curve, and what it is worth in log evidence."""

    worth: float
    curve: Curve


def discover(finding: Finding) -> list[Bending]:
    """Fits with one curve, two and so on; none where nothing is worth it. Poses alone judge a curve. Kinds that these
    logs cannot show are not looked for (`not_shown`), and laws of a model that was given take room from the MOST_LAWS
    that a model may have.

    Where evidence hardly tells which curve comes first, the search goes on from each of these, and the set that is
    worth most is kept: one curve may stand for two others together.
    """
    windows = finding.data.windows._replace(wheels=None, turning=None)
    hidden = not_shown(finding.fit, windows)
    kinds = tuple(kind for kind in KINDS if not hidden.hides(kind))
    if not kinds or acting(windows.laws) == MOST_LAWS:
        return []
    begin = Bending(finding.fit, (), finding.fit.covariance, finding.law)
    sets = [_go_on(windows, begin, first, kinds) for first in _near(windows, begin, kinds)[:MOST_SETS]]
    return max(sets, key=lambda pair: pair[0])[1] if sets else []


def _go_on(windows: Windows, begin: Bending, first: Worthy, kinds: tuple[Kind, ...]) -> tuple[float, list[Bending]]:
    """What a first curve and the best ones beside it are worth, and fits with one of them, two and so on."""
    total, found, room = first.worth, [_with(windows, begin, first.curve)], MOST_LAWS - acting(windows.laws)
    while len(found) < room and (more := _near(windows, found[-1], kinds)):
        total += more[0].worth
        found.append(_with(windows, found[-1], more[0].curve))
    return total, found


def _with(windows: Windows, now: Bending, curve: Curve) -> Bending:
    """The fit with one curve more. The noise is sized again beside it: a law sized beside a gap takes the gap for
    slip."""
    data, _ = whiten(now.fit, windows, now.law)
    fit, curves, _ = refit_with(data, now.fit, (*now.curves, curve))
    responses = respond(np.exp(fit.vector[:2]), fit.linear.residual, windows)
    law = size_noise(fit.linear.residual, fit.linear.starts, windows, responses, LIKELY)
    return Bending(*refit_with(whiten(fit, windows, law)[0], fit, curves), law)


def _near(windows: Windows, now: Bending, kinds: tuple[Kind, ...]) -> list[Worthy]:
    """The curves of some kinds that bring most beside a fit, those within SURE of the best one, the best first."""
    found = worthy(whiten(now.fit, windows, now.law)[0], now.fit, now.curves, kinds)
    return [each for each in found if each.worth > found[0].worth - SURE]


def worthy(data: Data, fit: Solution, curves: tuple[Curve, ...], kinds: tuple[Kind, ...]) -> list[Worthy]:
    """The curves of some kinds that are worth SURE beside some others, about a fit that has these, the best first.
    Kinds that bring nearly as much as one are told with it."""
    responses = respond(np.exp(fit.vector[:2]), fit.linear.residual, data.windows)
    base, prior = _base(data, fit, curves)
    found: list[Worthy] = []
    path = path_of(fit, obeying(data.windows, curves))
    turning = turnings(data, fit, base, path, responses)
    periodic = (of_wheel(*pair, path, responses) for pair in turning)
    for each in itertools.chain(candidates(path, responses, kinds), periodic):
        if any(each.kind == curve.kind for curve in curves):
            continue
        bent = _beside(data, fit, base, prior, each.columns, prior_of(each))
        chance = 0.0 if each.turning is None else each.turning.by_chance
        worth = min(bent.evidence - PRICE, bent.held_out) - chance
        if worth > SURE:
            none = np.zeros(each.columns.shape[2])
            curve = Curve(each.kind, each.at, none, none, bent.variance, each.density, turning=each.turning)
            found.append(Worthy(worth, curve))
    return [
        one._replace(curve=one.curve._replace(alike=tuple(
            other.curve.kind for other in found if other is not one and other.worth > ALIKE * one.worth
        )))
        for one in sorted(found, key=lambda one: -one.worth)
    ]  # fmt: skip


def _base(data: Data, fit: Solution, curves: tuple[Curve, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Whitened columns (windows, numbers, n) of a fit and its curves free of start states, the residual last, and the
    products (n, n) that their priors add."""
    linear = fit.linear
    base = np.concatenate([linear.slopes, curve_columns(fit, data, curves), linear.residual[..., None]], axis=2)
    whitened, _ = without_starts(data.whitener, base, linear.starts)
    own, prior = len(fit.places), with_prior(np.zeros((whitened.shape[2],) * 2), fit.vector, data.windows)
    smooth, values = smoothness(curves), np.concatenate([np.zeros(0), *(curve.value for curve in curves)])
    prior[own:-1, own:-1] += smooth
    prior[own:-1, -1] -= smooth @ values
    return whitened, prior


def _beside(data: Data, fit: Solution, base: Array, prior: Array, columns: Array, smooth: Array) -> Bent:
    """What a curve of some columns and a roughness prior brings beside a base."""
    answers, _ = without_starts(data.whitener, columns, fit.linear.starts)
    whole = np.concatenate([base[..., :-1], answers, base[..., -1:]], axis=2)
    return bend(whole.transpose(0, 2, 1) @ whole, _spread_out(prior, len(smooth)), smooth)


def _spread_out(prior: Array, knots: int) -> np.ndarray:
    """A prior's products (n, n), the residual last, with so many columns before it that the prior says nothing of."""
    places = [*range(len(prior) - 1), len(prior) - 1 + knots]
    whole = np.zeros((len(prior) + knots,) * 2)
    whole[np.ix_(places, places)] = prior
    return whole

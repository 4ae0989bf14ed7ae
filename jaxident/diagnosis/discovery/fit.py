"""Curves fitted together with the nominal robot and its effects: Gauss-Newton steps, shortened until they help."""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.discovery.curves import precision, solved
from jaxident.diagnosis.fit.prior import unlikeliness, with_prior
from jaxident.diagnosis.fit.refit import Data, Solution, best_starts, covariance_from
from jaxident.diagnosis.laws.candidates import Candidate, Turning, columns_of, path_of
from jaxident.diagnosis.laws.kinds import Kind, nominal_part
from jaxident.diagnosis.motion.linear import Gram, Linear, gram, linearise
from jaxident.diagnosis.motion.responses import respond
from jaxident.diagnosis.motion.windows import Windows, obeying_laws
from jaxident.diagnosis.noise.law import Law
from jaxident.effects.coordinates import limits
from jaxident.effects.law_arrays import joined, laws_of
from jaxident.effects.law_kinds import TURNING, scaled
from jaxident.robot.model import Discovered

MOST_STEPS = 10
"""Of one fit. No other number was tried."""
ENOUGH = 0.05
"""Fall of -log p below which a fit has arrived, as in `causes.refit`."""
SHORTER = (1.0, 0.5, 0.2, 0.05)
"""Parts of a step that are tried, one after the other. No others were tried."""


class Curve(NamedTuple):
    """A discovered law for commands over their largest: knots along each of its signals, values there and their
    deviations (knots,), the variance of its roughness prior, and how many rows lie nearest to each knot; alike: other
    kinds of laws that would explain nearly as much; turning: of a law that goes by the angle of a wheel. Knots of a
    surface stand row by row."""

    kind: Kind
    at: tuple[Any, ...]
    value: Any
    deviation: Any
    variance: float
    density: Any
    alike: tuple[Kind, ...] = ()
    turning: Turning | None = None


class Bending(NamedTuple):
    """A fit of the nominal robot, its effects and some curves, the covariance of its free coordinates and then of the
    curves' values, and the noise law beside them."""

    fit: Solution
    curves: tuple[Curve, ...]
    covariance: Any
    law: Law


class _Around(NamedTuple):
    """What a step needs: linearisation and Gram matrices of slopes, curves' columns and residual; the summed products
    with all priors."""

    linear: Linear
    gram: Gram
    summed: Any


def obeying(windows: Windows, curves: tuple[Curve, ...]) -> Windows:
    """The windows of a robot that obeys some curves, too."""
    laws = laws_of([as_law(curve) for curve in curves])
    if laws is None:
        return windows
    laws = obeying_laws(windows, laws).laws
    for k, curve in enumerate(curves):
        if curve.turning is not None:
            laws.phase[k] = curve.turning.phase
    return windows._replace(laws=joined(windows.laws, laws))


def as_law(curve: Curve, largest: float = 1.0) -> Discovered:
    """A curve as a model holds it, in the user's unit."""
    kind, (at, *second), shape = curve.kind, curve.at, [len(knots) for knots in curve.at]
    value, deviation = (np.reshape(column, shape) for column in (curve.value, curve.deviation))
    turning = {} if curve.turning is None else {key: getattr(curve.turning, key) for key in TURNING}
    law = Discovered(kind.acts_on, kind.times, kind.signal, at, value, deviation, kind.second_signal,
                     second[0] if second else None, **turning)  # fmt: skip
    return scaled(law, largest)


def curve_columns(fit: Solution, data: Data, curves: tuple[Curve, ...]) -> np.ndarray:
    """Answers of the poses (windows, numbers, knots of all curves) about a fit that has these curves."""
    none = np.zeros((*fit.linear.residual.shape, 0))
    if not curves:
        return none
    responses = respond(np.exp(fit.vector[:2]), fit.linear.residual, data.windows)
    path = path_of(fit, obeying(data.windows, curves))
    columns = [columns_of(curve.kind, curve.at, path, responses, curve.turning) for curve in curves]
    return np.concatenate(columns, axis=2)


def prior_of(curve: Curve | Candidate) -> np.ndarray:
    """Prior precision (knots, knots) of a law of unit size, which has nothing that the nominal robot has where the
    robot was."""
    nominal = curve.density[:, None] * nominal_part(curve.kind, curve.at)
    return precision(curve.at, nominal, closed=curve.turning is not None)


def smoothness(curves: tuple[Curve, ...]) -> np.ndarray:
    """Prior precision (n, n) of the values of all curves, one after the other."""
    count = sum(len(curve.value) for curve in curves)
    whole, place = np.zeros((count, count)), 0
    for curve in curves:
        own = slice(place, place + len(curve.value))
        whole[own, own] = prior_of(curve) / curve.variance
        place += len(curve.value)
    return whole


def refit_with(data: Data, fit: Solution, curves: tuple[Curve, ...]) -> tuple[Solution, tuple[Curve, ...], np.ndarray]:
    """The fit nearest downhill of a fit and curves: nominal parameters, effects, start states and values at knots; and
    the covariance of all but start states."""
    low, high = (bound[fit.places] for bound in limits())
    smooth = smoothness(curves)
    starts, cost = best_starts(_obeying(data, curves), fit.vector, fit.starts, np.zeros_like(fit.starts))
    cost = cost + unlikeliness(fit.vector, data.windows) + _roughness(curves, smooth)
    now = fit._replace(starts=starts)
    around = _look(data, now, curves, smooth)
    for _ in range(MOST_STEPS):
        step = solved(around.summed, len(around.summed) - 1)
        for part in SHORTER:
            vector, bent, starts, there = _moved(data, now, curves, around, part * step, (low, high))
            there += _roughness(bent, smooth)
            if there < cost:
                break
        else:
            break
        gained, cost, curves = cost - there, there, bent
        now = now._replace(vector=vector, starts=starts)
        around = _look(data, now, curves, smooth)
        if gained < ENOUGH:
            break
    return _arrived(data, now._replace(linear=around.linear, cost=cost), curves, around)


def _obeying(data: Data, curves: tuple[Curve, ...]) -> Data:
    return data._replace(windows=obeying(data.windows, curves))


def _look(data: Data, now: Solution, curves: tuple[Curve, ...], smooth: Array) -> _Around:
    """The linearisation about a fit and its curves."""
    linear = linearise(now.vector, now.starts, obeying(data.windows, curves), now.places)
    columns = curve_columns(now._replace(linear=linear), data, curves)
    whole = np.concatenate([linear.slopes, columns, linear.residual[..., None]], axis=2)
    found = gram(data.whitener, whole, linear.starts)
    summed, own = with_prior(found.products.sum(axis=0), now.vector, data.windows), len(now.places)
    summed[own:-1, own:-1] += smooth
    summed[own:-1, -1] -= smooth @ _values(curves)
    return _Around(linear, found, summed)


def _moved(data: Data, now: Solution, curves, around: _Around, step: Array, bounds):
    """Vector, curves, starts and half the squares after a step, as far as the bounds let it."""
    own, vector = len(now.places), np.array(now.vector)
    vector[now.places] = np.clip(vector[now.places] + step[:own], *bounds)
    step = np.concatenate([vector[now.places] - now.vector[now.places], step[own:]])
    bent = _with_values(curves, _values(curves) + step[own:])
    moved = around.gram.solve[:, :, -1] - around.gram.solve[:, :, :-1] @ step
    starts, cost = best_starts(_obeying(data, bent), vector, now.starts, moved.T)
    return vector, bent, starts, cost + unlikeliness(vector, data.windows)


def _arrived(
    data: Data, fit: Solution, curves: tuple[Curve, ...], around: _Around
) -> tuple[Solution, tuple[Curve, ...], np.ndarray]:
    """The fit and its curves with their deviations, and the covariance of both."""
    own = len(fit.places)
    covariance = covariance_from(around.summed, fit.places, data.windows)
    spread = np.sqrt(np.maximum(np.diagonal(covariance)[own:], 0.0))
    pieces = np.split(spread, _ends(curves)[:-1])
    found = tuple(curve._replace(deviation=part) for curve, part in zip(curves, pieces, strict=True))
    return fit._replace(covariance=covariance[:own, :own]), found, covariance


def _ends(curves: tuple[Curve, ...]) -> np.ndarray:
    """Where the values of each curve end among those of all."""
    return np.cumsum([len(curve.value) for curve in curves])


def _values(curves: tuple[Curve, ...]) -> np.ndarray:
    return np.concatenate([curve.value for curve in curves])


def _with_values(curves: tuple[Curve, ...], values: Array) -> tuple[Curve, ...]:
    pieces = np.split(values, _ends(curves)[:-1])
    return tuple(curve._replace(value=part) for curve, part in zip(curves, pieces, strict=True))


def _roughness(curves: tuple[Curve, ...], smooth: Array) -> float:
    """-log p of the curves' values under their priors, but for a constant."""
    values = _values(curves)
    return 0.5 * float(values @ smooth @ values)

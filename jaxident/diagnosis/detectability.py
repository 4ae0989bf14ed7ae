"""What this input can tell apart: faint effects and none, replayed under the noise of these very logs and named.

To first order in the effects every statistic of the scores follows from one Gram matrix, so that thousands of replays
cost as much as one score (parametric bootstrap; Efron and Tibshirani 1993, chapter 6).
"""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.causes.columns import AMPLITUDE
from jaxident.diagnosis.causes.evidence import CHANCE
from jaxident.diagnosis.causes.points import differences, rim_differences, seeded, sizes_of
from jaxident.diagnosis.fit.refit import Data, Solution
from jaxident.diagnosis.motion.linear import gram, linearise, normal
from jaxident.diagnosis.motion.rims import untold
from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.coordinates import COORDINATES, PLACES, SMOOTH, from_catalogue, sizes, unit_factors

FAINT = 40.0
"""Expected gain of the replayed effects: two to three times what a claim asks for."""
DRAWS = 400
"""Replays of each effect; ten times as many of none."""


class Answers(NamedTuple):
    """products (n, n): Gram matrix of whitened answers of the poses, nominal parameters and start states projected out.
    own: by effect its columns, one per coordinate, or that at typical size where it has no derivative at neutral;
    scale: prior standard deviation of what each of these is multiplied with; parts: how much of each a faint effect
    has; typical: by effect that these logs may tell the column of its typical size."""

    products: Any
    own: dict[str, list[int]]
    scale: dict[str, Any]
    parts: dict[str, list[float]]
    typical: dict[str, int]


class Replay(NamedTuple):
    """named (1 + effects, 1 + effects): share of replays with an effect (row) that came out as another (column); first
    of both is none. effects: their names; those that this input does not show at all are left out."""

    effects: tuple[str, ...]
    named: Any


def answers(data: Data, nominal: Solution, largest: float) -> Answers:
    """How the poses answer to every effect; commands are over `largest`."""
    duration = float(data.windows.session[-1] + data.windows.t[-1, -1])
    sized = {name: [key for _, key in sizes_of(name)] for name in SMOOTH}
    smooth = {name: [PLACES[name, key] for key in keys] for name, keys in sized.items()}
    places = [place for own in smooth.values() for place in own]
    linear = linearise(nominal.vector, nominal.starts, data.windows, [*nominal.places, *places])
    usual = {name: _typical(name, nominal.vector, largest, duration) for name in COORDINATES}
    change = differences(data, nominal, [seeded(nominal.vector, name, size) for name, size in usual.items()])
    columns = np.concatenate([linear.slopes, change], axis=2)
    more = None
    if data.rims is not None:
        far = rim_differences(data, nominal, [seeded(nominal.vector, name, size) for name, size in usual.items()])
        more = data.of_rims(linear.rims, linear.rims.slopes, far)
    products = gram(data.whitener, columns, linear.starts, more).products.sum(axis=0)
    order = {place: k for k, place in enumerate(places)}
    hidden = untold(data.windows)
    typical = {name: len(places) + k for k, name in enumerate(COORDINATES) if name not in hidden}
    own = {name: [order[p] for p in smooth[name]] if name in smooth else [k] for name, k in typical.items()}
    parts = {name: [usual[name][key] for key in sized[name]] if name in sized else [1.0] for name in typical}
    prior = sizes()
    scale = {name: prior[smooth[name]] if name in smooth else np.array([AMPLITUDE]) for name in typical}
    return Answers(_without(products, len(nominal.places)), own, scale, parts, typical)


def visible(found: Answers) -> dict[str, float]:
    """The gain that each effect of typical size would have, nominal parameters refitted: what this input can show."""
    return {name: max(0.5 * float(found.products[k, k]), 0.0) for name, k in found.typical.items()}


def replay(found: Answers, seed: int = 0) -> Replay:
    """Faint effects, each as large as makes its expected gain FAINT, named under replayed noise as the search names
    them: by the largest log evidence, if that is above zero."""
    rng = np.random.default_rng(seed)
    gains = visible(found)
    names = tuple(name for name, gain in gains.items() if gain > 1e-3)
    faint = {name: found.products[:, found.own[name]] @ found.parts[name] for name in names}
    power = {name: 0.5 * float(faint[name][found.own[name]] @ found.parts[name]) for name in names}
    values, vectors = np.linalg.eigh(found.products)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    table = np.zeros((1 + len(names), 1 + len(names)))
    for row, hidden in enumerate(("", *names)):
        cross = root @ rng.normal(size=(len(values), DRAWS if hidden else 10 * DRAWS))
        if hidden:
            cross += np.sqrt(FAINT / max(power[hidden], 1e-12)) * faint[hidden][:, None]
        evidence = np.stack([_evidence(found, name, cross) for name in names])
        named = np.where(evidence.max(axis=0) > 0.0, 1 + evidence.argmax(axis=0), 0)
        table[row] = np.bincount(named, minlength=len(table)) / len(named)
    return Replay(names, table)


def _evidence(found: Answers, name: str, cross: Array) -> np.ndarray:
    """Log evidence of an effect (draws,), from products with the residual (n, draws), as in `causes.evidence`."""
    own, scale = found.own[name], found.scale[name]
    precision = found.products[np.ix_(own, own)] * scale[:, None] * scale + np.eye(len(own))
    right = cross[own] * scale[:, None]
    room = 0.5 * float(np.linalg.slogdet(precision)[1])
    return 0.5 * np.sum(right * np.linalg.solve(precision, right), axis=0) - room + CHANCE


def _typical(name: str, vector: Array, largest: float, duration: float) -> dict[str, float]:
    """The coordinates of an effect of a robot at its typical size."""
    typical, factors = CATALOGUE[name].typical(duration), unit_factors(name, largest)
    return from_catalogue(name, {key: value / factors[key] for key, value in typical.items()}, vector[:2])


def _without(products: Array, count: int) -> np.ndarray:
    """Products of the later columns with the first `count` projected out."""
    base = list(range(count))
    own, _, scale = normal(products, base)
    cross = products[:count, count:] / scale[:, None]
    return products[count:, count:] - cross.T @ np.linalg.solve(own, cross)

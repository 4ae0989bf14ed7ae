"""Which effect: scores of all from the nominal fit, full refits of the best, then a second and a third beside it."""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.coordinates import COORDINATES, PLACES, SHAPES, SMOOTH, from_catalogue, unit_factors
from jaxident.diagnosis.corrector import library, pursue
from jaxident.diagnosis.linear import explained, follow, gram, linearise, normal
from jaxident.diagnosis.noise import Law, size_noise, whitener_of
from jaxident.diagnosis.responses import Responses, respond
from jaxident.diagnosis.search import Data, Solution, refit
from jaxident.diagnosis.windows import Windows
from jaxident.effects.catalogue import CATALOGUE

REFITS, KEPT = 6, 4
"""Effects that are refitted first, look-alikes of the best on top, and how many of them again under the noise that the
best leaves."""
PENALTY = 4.0
"""Fall of -log p that each coordinate of an effect costs."""
ENOUGH = 9.0
"""Gain beyond the penalty that claims an effect: one in ten thousand for a single one, a few in a thousand of all."""
MOST_EFFECTS = 3


class Candidate(NamedTuple):
    """A set of effects refitted: its solution and its gain, the fall of -log p from the nominal fit."""

    effects: tuple[str, ...]
    solution: Solution
    gain: float

    @property
    def evidence(self) -> float:
        """Gain less the price of its coordinates."""
        return self.gain - PENALTY * sum(len(COORDINATES[name]) for name in self.effects)


class Finding(NamedTuple):
    """Where the search ended: data under the final noise law, the nominal fit, all candidates of every stage by their
    effects, the selected set, terms of the corrector with what each still explains, and their columns' products."""

    data: Data
    law: Law
    responses: Responses
    nominal: Solution
    candidates: dict[tuple[str, ...], Candidate]
    selected: tuple[str, ...]
    terms: list[tuple[Any, float]]
    scores: dict[str, float]


def search_effects(windows: Windows, use: Array, nominal: Solution, law: Law) -> Finding:
    """From the nominal fit under a noise law to a selected set; `use` (boolean, windows) are those that name."""
    data, responses = whiten(nominal, windows, use, law)
    nominal = refit(data, nominal.vector, nominal.starts, ())
    scores = score(data, nominal)
    found = {(): Candidate((), nominal, 0.0)}
    _try(found, data, nominal, _with_look_alikes(scores), ())
    best = max(found.values(), key=lambda c: c.evidence)
    again = size_noise(best.solution.linear.residual, best.solution.linear.starts, windows, responses, use)
    data, responses = whiten(best.solution, windows, use, again)
    found = _again(found, data)
    scores = score(data, found[()].solution)
    _try(found, data, found[()].solution, [n for n in _with_look_alikes(scores) if (n,) not in found], ())
    selected = _grow(found, data)
    solution = found[selected].solution
    again = size_noise(solution.linear.residual, solution.linear.starts, windows, responses, use)
    return Finding(
        data, again, responses, found[()].solution, found, selected, remaining(data, solution, responses), scores
    )


def whiten(solution: Solution, windows: Windows, use: Array, law: Law) -> tuple[Data, Responses]:
    """The data under a law, slip linearised about a solution."""
    responses = respond(np.exp(solution.vector[:2]), solution.linear.residual, windows)
    return Data(windows, whitener_of(law, windows, responses), use), responses


def _again(found: dict, data: Data) -> dict:
    """The best candidates under another noise law, from where they were."""
    nominal = refit(data, found[()].solution.vector, found[()].solution.starts, ())
    fresh = {(): Candidate((), nominal, 0.0)}
    order = sorted((effects for effects in found if effects), key=lambda effects: -found[effects].evidence)
    for effects in order[:KEPT]:
        candidate = found[effects]
        solution = refit(data, candidate.solution.vector, candidate.solution.starts, effects)
        fresh[effects] = Candidate(effects, solution, nominal.cost - solution.cost)
    return fresh


def _try(found: dict, data: Data, begin: Solution, names: list[str], beside: tuple[str, ...]) -> None:
    """Refit every named effect beside others from a solution, and keep what comes out."""
    cost = found[()].solution.cost
    for name in names:
        effects = (*beside, name)
        vector, starts = best_seed(data, begin, name)
        shapes = tuple(pair for pair in SHAPES if pair[0] == name)
        if shapes:  # what only shapes an effect is lost on it until its size is found
            first = refit(data, vector, starts, effects, shapes, most=4)
            vector, starts = first.vector, first.starts
        solution = refit(data, vector, starts, effects)
        if effects not in found or solution.cost < found[effects].solution.cost:
            found[effects] = Candidate(effects, solution, cost - solution.cost)


def _grow(found: dict, data: Data) -> tuple[str, ...]:
    """Effects accepted one after the other, each for a joint refit that is worth it."""
    selected: tuple[str, ...] = ()
    singles = sorted((c for e, c in found.items() if len(e) == 1), key=lambda c: -c.evidence)
    if singles and singles[0].evidence > ENOUGH:
        selected = singles[0].effects
    while selected and len(selected) < MOST_EFFECTS:
        now = found[selected]
        scores = score(data, now.solution)
        names = [n for n in _ranked(scores) if n not in selected and scores[n] > ENOUGH][:4]
        _try(found, data, now.solution, names, selected)
        more = [c for e, c in found.items() if len(e) == len(selected) + 1]
        best = max(more, key=lambda c: c.evidence, default=None)
        if best is None or best.evidence < now.evidence + ENOUGH:
            break
        selected = best.effects
    return selected


def seeds(name: str, windows: Windows) -> list[dict[str, float]]:
    """Points from which an effect without a derivative at neutral is looked for; one neutral point for the others."""
    if name == "input_saturation":
        return [{"level": level} for level in (0.9, 0.75, 0.6, 0.45, 0.3)]
    if name == "input_quantisation":
        return [{"step": step} for step in (0.03, 0.05, 0.08, 0.12, 0.17, 0.25, 0.35)]
    if name == "stiction":
        return [{"right": s, "left": s, "fade": fade} for s, fade in ((0.05, 0.05), (0.15, 0.05), (0.1, 0.15))]
    if name == "payload_change":
        last = float(windows.session[-1] + windows.t[-1, -1])
        return [{"loss": 0.1, "instant": last * part} for part in np.linspace(0.06, 0.94, 12)]
    if name == "lens_distortion":
        return [{"strength": 0.01}]
    return [{}]


def seeded(vector: Array, name: str, seed: dict[str, float]) -> np.ndarray:
    """A vector with an effect at a seed."""
    moved = np.array(vector)
    for key, value in seed.items():
        moved[PLACES[name, key]] = value
    return moved


def score(data: Data, solution: Solution) -> dict[str, float]:
    """What each effect promises to explain beyond a solution, its coordinates free: a linear prediction by the
    derivative at neutral, or by the difference that its best seed makes."""
    smooth = [
        PLACES[name, c.name] for name in SMOOTH for c in COORDINATES[name] if c.name not in ("centre_x", "centre_y")
    ]
    free = list(solution.places)
    linear = linearise(solution.vector, solution.starts, data.windows, [*free, *(p for p in smooth if p not in free)])
    places = [*free, *(p for p in smooth if p not in free)]
    jumps = [(name, seed) for name in COORDINATES if name not in SMOOTH and PLACES[name, COORDINATES[name][0].name] not in free
             for seed in seeds(name, data.windows)]  # fmt: skip
    vectors = (
        np.stack([seeded(solution.vector, *jump) for jump in jumps]) if jumps else np.zeros((0, len(solution.vector)))
    )
    moved = follow(vectors, np.broadcast_to(solution.starts, (len(vectors), *solution.starts.shape)), data.windows)
    change = np.moveaxis(linear.residual[None] - moved, 0, -1)
    columns = np.concatenate([linear.slopes, change, linear.residual[..., None]], axis=2)[data.use]
    products = gram(data.whitener[data.use], columns, linear.starts[data.use]).products.sum(axis=0)
    base = list(range(len(free)))
    place_of = {place: k for k, place in enumerate(places)}
    scores = {}
    for name in SMOOTH:
        own = [
            place_of[PLACES[name, c.name]]
            for c in COORDINATES[name]
            if (name, c.name) in PLACES and PLACES[name, c.name] in place_of
        ]
        own = [k for k in own if k >= len(free)]
        scores[name] = explained(products, base, own) if own else 0.0
    for k, (name, _) in enumerate(jumps):
        scores[name] = max(scores.get(name, 0.0), explained(products, base, [len(places) + k]))
    return scores


def best_seed(data: Data, solution: Solution, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Where to start the refit of one more effect: at neutral, or at the seed that promises most."""
    points = seeds(name, data.windows)
    if name in SMOOTH or len(points) == 1:
        return seeded(solution.vector, name, points[0]), solution.starts
    vectors = np.stack([seeded(solution.vector, name, seed) for seed in points])
    moved = follow(vectors, np.broadcast_to(solution.starts, (len(vectors), *solution.starts.shape)), data.windows)
    change = np.moveaxis(solution.linear.residual[None] - moved, 0, -1)
    columns = np.concatenate([solution.linear.slopes, change, solution.linear.residual[..., None]], axis=2)[data.use]
    products = gram(data.whitener[data.use], columns, solution.linear.starts[data.use]).products.sum(axis=0)
    base = list(range(len(solution.places)))
    gains = [explained(products, base, [len(base) + k]) for k in range(len(points))]
    return vectors[int(np.argmax(gains))], solution.starts


def _ranked(scores: dict[str, float]) -> list[str]:
    return sorted(scores, key=lambda name: -(scores[name] - PENALTY * len(COORDINATES[name])))


def _with_look_alikes(scores: dict[str, float]) -> list[str]:
    """The best by score, and what the catalogue says the first two are confused with."""
    best = _ranked(scores)[:REFITS]
    near = [other for name in best[:2] for other in CATALOGUE[name].confused_with if other in COORDINATES]
    return list(dict.fromkeys([*best, *near]))


def visible(data: Data, nominal: Solution, largest: float, duration: float) -> dict[str, float]:
    """The gain that each effect of the catalogue's typical size would have, nominal parameters refitted: what this
    input can show. Commands are over `largest`; duration [s] of all runs."""
    vectors = []
    for name in COORDINATES:
        typical = CATALOGUE[name].typical()
        if name == "payload_change":
            typical["instant"] = 0.5 * duration
        factors = unit_factors(name, largest)
        inner = {key: value / factors[key] for key, value in typical.items()}
        vectors.append(seeded(nominal.vector, name, from_catalogue(name, inner)))
    starts = np.broadcast_to(nominal.starts, (len(vectors), *nominal.starts.shape))
    change = np.moveaxis(nominal.linear.residual[None] - follow(np.stack(vectors), starts, data.windows), 0, -1)
    columns = np.concatenate([nominal.linear.slopes, change], axis=2)[data.use]
    products = gram(data.whitener[data.use], columns, nominal.linear.starts[data.use]).products.sum(axis=0)
    base = list(range(len(nominal.places)))
    return {name: _alone(products, base, len(base) + k) for k, name in enumerate(COORDINATES)}


def _alone(products: Array, base: list[int], column: int) -> float:
    """Half the squares of a column that others do not explain."""
    order = [*base, column]
    own = products[np.ix_(order, order)]
    matrix, right, _ = normal(own, base)
    return max(0.5 * float(own[-1, -1] - right @ np.linalg.solve(matrix, right)), 0.0)


def remaining(data: Data, solution: Solution, responses: Responses) -> list[tuple[Any, float]]:
    """Terms of the corrector that a solution leaves room for, each with the fall of -log p that it brings."""
    linear = solution.linear
    corrector = library(linear.residual, data.windows, responses)
    columns = np.concatenate([linear.slopes, corrector.columns, linear.residual[..., None]], axis=2)[data.use]
    products = gram(data.whitener[data.use], columns, linear.starts[data.use]).products.sum(axis=0)
    base = list(range(len(solution.places)))
    chosen = pursue(products, base, [len(base) + k for k in range(len(corrector.terms))])
    return [(corrector.terms[place - len(base)], gain) for place, gain in chosen]

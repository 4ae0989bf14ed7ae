"""What the best effects leave unexplained: terms of the corrector and rhythms of the wheels, beside a law of noise that
does not take them for slip."""

from typing import Any

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.causes.corrector import Term, library, pursue
from jaxident.diagnosis.causes.rhythm import rhythms
from jaxident.diagnosis.causes.search import Data, Solution
from jaxident.diagnosis.motion.linear import gram, normal
from jaxident.diagnosis.motion.responses import Responses
from jaxident.diagnosis.noise.law import Law, white_whitener, whitener_of
from jaxident.diagnosis.noise.sizing import size_noise

SIDES = ("right", "left")
UNEXPLAINED = 0.2
"""A gap is unknown where the corrector explains this share of it beyond the best set."""


def unexplained(
    data: Data, solution: Solution, responses: Responses, law: Law, sized: bool
) -> tuple[list[tuple[Term, float]], Law]:
    """Terms that a solution leaves room for, each with the fall of -log p that it brings, and the law beside them.

    A law sized beside a gap takes the gap for slip or a memory of the camera. So terms are first chosen as if the
    noise were white, the law is sized again at what they leave, and only then do they count; not so if not `sized`.
    """
    terms, answers = _terms(data, solution, responses)
    found, _ = _choose(data, whitener_of(law, data.windows, responses), solution, terms, answers)
    if sized and law != Law(law.position, law.heading):
        _, left = _choose(data, white_whitener(law, data.windows), solution, terms, answers)
        again = size_noise(left, solution.linear.starts, data.windows, responses, data.use)
        others, _ = _choose(data, whitener_of(again, data.windows, responses), solution, terms, answers)
        if sum(gain for _, gain in others) > sum(gain for _, gain in found):
            return others, again
    return found, law


def _terms(data: Data, solution: Solution, responses: Responses) -> tuple[list[Term], np.ndarray]:
    """All terms and their columns (windows, numbers, terms)."""
    corrector = library(solution.linear.residual, data.windows, responses)
    turning = rhythms(data, solution, responses)
    named = [
        Term("drive", f"once every {rhythm.period:.3f} m of the {side} wheel", rhythm.price)
        for rhythm, side in zip(turning, SIDES, strict=True)
    ]
    columns = np.concatenate([corrector.columns, np.stack([r.column for r in turning], axis=2)], axis=2)
    return [*corrector.terms, *named], columns


def _choose(data: Data, whitener: Array, solution: Solution, terms: list[Term], answers: Array) -> tuple[list, Any]:
    """The terms that count under a whitener, and the residuals that they and the solution's coordinates would leave."""
    linear, used, base = solution.linear, data.use, list(range(len(solution.places)))
    columns = np.concatenate([linear.slopes, answers, linear.residual[..., None]], axis=2)
    products = gram(whitener[used], columns[used], linear.starts[used]).products.sum(axis=0)
    candidates = [len(base) + k for k in range(len(terms))]
    found = pursue(products, base, candidates, np.array([term.price for term in terms]))
    free = [*base, *(place for place, _ in found)]
    own, cross, scale = normal(products, free)
    left = linear.residual - columns[..., free] @ (np.linalg.solve(own, cross) / scale)
    return [(terms[place - len(base)], gain) for place, gain in found], left

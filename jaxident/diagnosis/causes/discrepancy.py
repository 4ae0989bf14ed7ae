"""What the best effects leave unexplained: terms of the corrector and what turns with a wheel, beside a law of noise
that does not take them for slip."""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.causes.discrepancy_basis import WORTH, Term, library, pursue
from jaxident.diagnosis.fit.prior import with_prior
from jaxident.diagnosis.fit.refit import Data, Solution
from jaxident.diagnosis.laws.candidates import cosine_of, path_of
from jaxident.diagnosis.laws.wheel_angle import in_words, turnings
from jaxident.diagnosis.motion.linear import gram, left_over, normal, spread, without_starts
from jaxident.diagnosis.motion.responses import Responses
from jaxident.diagnosis.noise.law import Law, white_whitener, whitener_of
from jaxident.diagnosis.noise.sizing import size_noise

UNEXPLAINED = 0.2
"""Share of all that is explained which terms in no catalogue bring, from which on slip is not sized more finely and
channels are those of the error: it may be slip for want of a name."""


class Rest(NamedTuple):
    """What is predictable and in no named effect: terms with the fall of -log p that each brings, the answers of the
    poses to them (windows, numbers, terms), the noise law beside them, and the restricted log-likelihood with all of
    them free."""

    terms: list[tuple[Term, float]]
    answers: Any
    law: Law
    log_likelihood: float

    @property
    def gain(self) -> float:
        """Fall of -log p that all terms bring."""
        return sum(gain for _, gain in self.terms)

    @property
    def largest(self) -> float:
        """What the largest term brings."""
        return max((gain for _, gain in self.terms), default=0.0)


class Choice(NamedTuple):
    """Places of terms and the fall of -log p that each brings; the residuals (windows, numbers) that they and the
    solution's coordinates would leave; the restricted log-likelihood, all of them free."""

    found: list[tuple[int, float]]
    left: Any
    log_likelihood: float


def unexplained(
    data: Data, solution: Solution, responses: Responses, law: Law, sized: bool, memory_too: bool = True
) -> Rest:
    """What a solution leaves room for.

    A law sized beside a gap takes the gap for slip or a memory of the camera. So terms are first chosen as if the
    noise were white, the law is sized again at what they leave, and the terms that count then do so if they and that
    law are likelier than those under the law before; not so if not `sized`.
    """
    terms, answers = _terms(data, solution, responses)
    choice = _choose(data, whitener_of(law, data.windows, responses), solution, terms, answers)
    if sized and law != Law(law.position, law.heading):
        left = _choose(data, white_whitener(law, data.windows), solution, terms, answers).left
        again = size_noise(left, solution.linear.starts, data.windows, responses, memory_too=memory_too)
        other = _choose(data, whitener_of(again, data.windows, responses), solution, terms, answers)
        if other.log_likelihood > choice.log_likelihood:
            choice, law = other, again
    places = [place for place, _ in choice.found]
    found = [(terms[place], gain) for place, gain in choice.found]
    return Rest(found, answers[..., places], law, choice.log_likelihood)


def _terms(data: Data, solution: Solution, responses: Responses) -> tuple[list[Term], np.ndarray]:
    """All terms and their columns (windows, numbers, terms)."""
    corrector, linear = library(solution.linear.residual, data.windows, responses), solution.linear
    whole = np.concatenate([linear.slopes, linear.residual[..., None]], axis=2)
    white, _ = without_starts(data.whitener, whole, linear.starts)
    path = path_of(solution, data.windows)
    found = turnings(data, solution, white, path, responses)
    named = [Term(kind.site, in_words(kind, turning), turning.by_chance) for kind, turning in found]
    columns = [cosine_of(*pair, path, responses)[..., None] for pair in found]
    return [*corrector.terms, *named], np.concatenate([corrector.columns, *columns], axis=2)


def _choose(data: Data, whitener: Array, solution: Solution, terms: list[Term], answers: Array) -> Choice:
    """The terms that count under a whitener."""
    linear, base = solution.linear, list(range(len(solution.places)))
    columns = np.concatenate([linear.slopes, answers, linear.residual[..., None]], axis=2)
    by_window = gram(whitener, columns, linear.starts).products
    products = with_prior(by_window.sum(axis=0), solution.vector, data.windows)
    candidates = [len(base) + k for k in range(len(terms))]
    found = agreed(by_window, products, base, pursue(products, base, candidates, np.array([t.price for t in terms])))
    free = [*base, *(place for place, _ in found)]
    own, cross, scale = normal(products, free)
    left = linear.residual - columns[..., free] @ (np.linalg.solve(own, cross) / scale)
    volume = _log_volume(whitener, linear.starts)
    return Choice([(place - len(base), gain) for place, gain in found], left, volume - left_over(products, free))


def agreed(
    by_window: Array, products: Array, base: list[int], found: list[tuple[int, float]]
) -> list[tuple[int, float]]:
    """Terms on which windows agree, `base` columns free: half the square of each in the covariance that the spread of
    scores over windows gives (see `evidence`) is WORTH or more. by_window (windows, n, n), products (n, n): of all
    columns, the residual last. Each term has the smaller of that and of what it brings if the model is taken for
    true."""
    while found:
        free, last = [*base, *(place for place, _ in found)], len(products) - 1
        own, cross, scale = normal(products, free)
        size, inverse = np.linalg.solve(own, cross), np.linalg.inv(own)  # in units of the columns' lengths
        scores = (by_window[:, free, last] - by_window[:, free][:, :, free] @ (size / scale)) / scale
        variance = np.diagonal(inverse @ spread(scores) @ inverse)
        worth = (0.5 * size**2 / np.maximum(variance, 1e-300))[len(base) :]
        worst = int(np.argmin(worth))
        if worth[worst] >= WORTH:
            return [(place, min(gain, float(w))) for (place, gain), w in zip(found, worth, strict=True)]
        found = found[:worst] + found[worst + 1 :]
    return []


def _log_volume(whitener: Array, starts: Array) -> float:
    """What a law's restricted log-likelihood has besides the squares, from its whitener (windows, numbers, numbers) and
    the derivatives by start states (windows, numbers, 5)."""
    own = np.diagonal(whitener, axis1=1, axis2=2)
    answers = whitener @ starts
    length = np.linalg.norm(answers, axis=1, keepdims=True)
    length = np.where(length > 0.0, length, 1.0)  # a window without any pose
    unit = answers / length
    information = unit.transpose(0, 2, 1) @ unit + 1e-12 * np.eye(starts.shape[2])
    seen = np.log(own[own > 0.0]).sum()
    return float(seen - 0.5 * np.linalg.slogdet(information)[1].sum() - np.log(length).sum())

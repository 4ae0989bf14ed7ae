"""Which effect: scores of all from the nominal fit, full refits of the best, then a second and a third beside it."""

from collections.abc import Collection
from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.causes.scores import at_best_instant, beginnings, score
from jaxident.diagnosis.causes.search import Data, Solution, refit
from jaxident.diagnosis.causes.unexplained import unexplained
from jaxident.diagnosis.motion.coordinates import (
    COORDINATES,
    NOMINAL,
    SHAPES,
    STEPPED,
    free_places,
    neutral_vector,
)
from jaxident.diagnosis.motion.responses import Responses, respond
from jaxident.diagnosis.motion.windows import Windows
from jaxident.diagnosis.noise.law import Law, whitener_of
from jaxident.diagnosis.noise.sizing import WORTH, size_noise
from jaxident.effects.catalogue import CATALOGUE

REFITS, KEPT = 6, 4
"""Effects that are refitted first, look-alikes of the best on top, and how many of them again under the noise that the
best leaves."""
PENALTY = 4.0
"""Fall of -log p that each coordinate of an effect costs."""
ENOUGH = 9.0
"""Gain beyond the penalty that claims an effect. With it a coordinate that does nothing gains as much once in three
million times (chi-squared at 26), if the noise law is right; the rest is room for a law that is not quite."""
FORM, ELSEWHERE = 0.01, 0.001
"""Part of all that is explained which a further effect must bring at a site where the set has one already, and at
another: a robot's own form of an effect is never quite that of the catalogue, and what it leaves looks like another one
of the same site."""
MOST_EFFECTS, BESIDE = 3, 4
"""Effects in a set at most, and how many are refitted beside a set before one is accepted."""
LIKELY = 1.0
"""Gain for which slip enters the law that the gap is held against: a floor without slip that is as likely there as not
would be too low, and too sure."""


class Candidate(NamedTuple):
    """A set of effects refitted: its solution and its gain, the fall of -log p from the nominal fit."""

    effects: tuple[str, ...]
    solution: Solution
    gain: float

    @property
    def evidence(self) -> float:
        """Gain less the price of its coordinates, and of what may only be the form of others."""
        price = PENALTY * sum(len(COORDINATES[name]) for name in self.effects)
        return self.gain - price - form_price(self.effects) * max(self.gain, 0.0)


def form_price(effects: Collection[str]) -> float:
    """Part of all that is explained which a set must bring beside its first effect."""
    sites = [CATALOGUE[name].site for name in effects]
    distinct = len(set(sites))
    return FORM * (len(sites) - distinct) + ELSEWHERE * max(distinct - 1, 0)


class Finding(NamedTuple):
    """Where the search ended: data under the noise law of the search; the law beside the corrector's terms, and the
    likeliest one without them, which takes what they explain for noise; the nominal fit, all candidates of every stage
    by their effects, the selected set, and terms of the corrector with what each still explains."""

    data: Data
    law: Law
    likely: Law
    nominal: Solution
    candidates: dict[tuple[str, ...], Candidate]
    selected: tuple[str, ...]
    terms: list[tuple[Any, float]]

    @property
    def rest(self) -> float:
        """Fall of -log p that all terms bring beyond the selected set."""
        return sum(gain for _, gain in self.terms)

    @property
    def unexplained(self) -> float:
        """The terms' share of all that is explained."""
        return self.share(self.rest)

    def share(self, rest: float) -> float:
        """Share of some rest in it and what the selected set explains."""
        return rest / max(self.candidates[self.selected].gain + rest, 1e-9)


def search_effects(
    windows: Windows, use: Array, nominal: Solution, law: Law, *, sized: bool = True, without: Collection[str] = ()
) -> Finding:
    """From the nominal fit under a noise law to a selected set; `use` (boolean, windows) are those that name.

    The law is sized again at the best fit, for the nominal one takes what is missing for slip; not so if `sized` is
    False. Effects in `without` are left out, as if the catalogue had no word for them.
    """
    data, responses = whiten(nominal, windows, use, law)
    nominal = refit(data, nominal.vector, nominal.starts, ())
    scores = _scores(data, nominal, without)
    found: dict[tuple[str, ...], Candidate] = {(): Candidate((), nominal, 0.0)}
    _try(found, data, nominal, _with_look_alikes(scores), ())
    best = max(found.values(), key=lambda c: c.evidence)
    again = resized(best.solution, data, responses, law, sized)
    data, responses = whiten(best.solution, windows, use, again)
    found = _again(found, data)
    scores = _scores(data, found[()].solution, without)
    _try(found, data, found[()].solution, [n for n in _with_look_alikes(scores) if (n,) not in found], ())
    selected = _exchange(found, data, _grow(found, data, without), without)
    solution = found[selected].solution
    # once more even for the same set: the law before came from a fit under the nominal one's noise, which is too large
    again = resized(solution, data, responses, again, sized, LIKELY)
    terms, beside = unexplained(data, solution, responses, again, sized)
    return Finding(data, beside, again, found[()].solution, found, selected, terms)


def resized(solution: Solution, data: Data, responses: Responses, law: Law, sized: bool, worth: float = WORTH) -> Law:
    """The law sized at a solution, slip believed for some gain, or as it was."""
    if not sized:
        return law
    return size_noise(solution.linear.residual, solution.linear.starts, data.windows, responses, data.use, worth)


def whiten(solution: Solution, windows: Windows, use: Array, law: Law) -> tuple[Data, Responses]:
    """The data under a law, slip linearised about a solution."""
    responses = respond(np.exp(solution.vector[:2]), solution.linear.residual, windows)
    return Data(windows, whitener_of(law, windows, responses), use), responses


def _again(found: dict, data: Data) -> dict:
    """The best candidates under another noise law, from where they were."""
    nominal = refit(data, found[()].solution.vector, found[()].solution.starts, ())
    fresh: dict[tuple[str, ...], Candidate] = {(): Candidate((), nominal, 0.0)}
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
        for vector in beginnings(data, begin, name):
            solution = _refit_with_shapes(data, vector, begin.starts, effects)
            if effects not in found or solution.cost < found[effects].solution.cost:
                found[effects] = Candidate(effects, solution, cost - solution.cost)


def _refit_with_shapes(data: Data, vector: Array, starts: Array, effects: tuple[str, ...]) -> Solution:
    """A refit that first finds the size of the last effect: what only shapes it is lost until then."""
    shapes = tuple(pair for pair in SHAPES - STEPPED if pair[0] == effects[-1])
    if shapes:
        first = refit(data, vector, starts, effects, shapes, most=4)
        vector, starts = first.vector, first.starts
        if effects[-1] == "payload_change":
            vector = at_best_instant(data, first)
    return refit(data, vector, starts, effects)


def _grow(found: dict, data: Data, without: Collection[str]) -> tuple[str, ...]:
    """Effects accepted one after the other, each for a joint refit that is worth it."""
    selected: tuple[str, ...] = ()
    singles = sorted((c for e, c in found.items() if len(e) == 1), key=lambda c: -c.evidence)
    if singles and singles[0].evidence > ENOUGH:
        selected = singles[0].effects
    while selected and len(selected) < MOST_EFFECTS:
        now = found[selected]
        _one_more(found, data, selected, without)
        more = [c for e, c in found.items() if len(e) == len(selected) + 1]
        best = max(more, key=lambda c: c.evidence, default=None)
        if best is None or best.evidence < now.evidence + ENOUGH:
            break
        selected = best.effects
    return selected


def _one_more(found: dict, data: Data, selected: tuple[str, ...], without: Collection[str]) -> None:
    """Refit the effects that a set leaves most room for, each beside it."""
    solution = found[selected].solution
    scores = _scores(data, solution, without)
    names = [n for n in _ranked(scores) if n not in selected and scores[n] > ENOUGH][:BESIDE]
    _try(found, data, solution, names, selected)


def one_more(finding: Finding, selected: tuple[str, ...]) -> Finding:
    """The search with sets of one effect more than some set of it."""
    found = dict(finding.candidates)
    _one_more(found, finding.data, selected, ())
    return finding._replace(candidates=found)


def _exchange(found: dict, data: Data, selected: tuple[str, ...], without: Collection[str]) -> tuple[str, ...]:
    """The best set of several when each effect in turn is left out or gives way to another: the first was accepted
    without knowing the others."""
    if len(selected) < 2:
        return selected
    for name in selected:
        rest = tuple(other for other in selected if other != name)
        if not any(set(rest) == set(effects) for effects in found):
            solution = found[selected].solution
            vector = neutral_vector(solution.vector[: len(NOMINAL)])
            for place in free_places(rest):
                vector[place] = solution.vector[place]
            reduced = refit(data, vector, solution.starts, rest)
            found[rest] = Candidate(rest, reduced, found[()].solution.cost - reduced.cost)
        beside = next(effects for effects in found if set(rest) == set(effects))
        scores = _scores(data, found[beside].solution, (*without, *selected))
        known = [set(effects) for effects in found]
        names = [n for n in _ranked(scores)[:3] if scores[n] > ENOUGH and {*rest, n} not in known]
        _try(found, data, found[beside].solution, names, beside)
    # a larger set must be worth as much more as when sets grow
    return max(found.values(), key=lambda c: c.evidence - ENOUGH * len(c.effects)).effects


def _scores(data: Data, solution: Solution, without: Collection[str]) -> dict[str, float]:
    return {name: gain for name, gain in score(data, solution).items() if name not in without}


def _ranked(scores: dict[str, float]) -> list[str]:
    return sorted(scores, key=lambda name: -(scores[name] - PENALTY * len(COORDINATES[name])))


def _with_look_alikes(scores: dict[str, float]) -> list[str]:
    """The best by score, and what the catalogue says the first two are confused with."""
    best = _ranked(scores)[:REFITS]
    near = [other for name in best[:2] for other in CATALOGUE[name].confused_with if other in scores]
    return list(dict.fromkeys([*best, *near]))

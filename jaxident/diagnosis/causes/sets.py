"""Sets of effects: each refitted beside others, grown one by one, and exchanged where another is better."""

from collections.abc import Collection

from jaxident.array_types import Array
from jaxident.diagnosis.causes.candidates import ENOUGH, PENALTY, Candidate, Finding, value
from jaxident.diagnosis.causes.scores import at_best, beginnings, score
from jaxident.diagnosis.causes.search import Data, Solution, refit
from jaxident.effects.coordinates import (
    COORDINATES,
    NOMINAL,
    REACHED,
    SHAPES,
    STEPPED,
    free_places,
    neutral_vector,
)

MOST_EFFECTS, BESIDE = 3, 4
"""Effects in a set at most where a robot is searched alone, and how many are refitted beside a set before one is
accepted. With room for six, sets of five real robots shrank the gap on runs kept apart by 0.80 on average, with room
for three by 0.86."""


def refit_each(found: dict, data: Data, begin: Solution, names: list[str], beside: tuple[str, ...]) -> None:
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
    searched = next((pair for pair in REACHED if pair[0] == effects[-1]), None)
    if shapes or searched:
        first = refit(data, vector, starts, effects, shapes, most=4)
        vector, starts = first.vector, first.starts
        if searched:
            vector = at_best(data, first, searched)
    return refit(data, vector, starts, effects)


def grow(found: dict, data: Data, without: Collection[str]) -> tuple[str, ...]:
    """Effects accepted one after the other, each for a joint refit that is worth it."""
    selected: tuple[str, ...] = ()
    singles = sorted((c for e, c in found.items() if len(e) == 1), key=lambda c: -c.evidence)
    if singles and singles[0].evidence > ENOUGH:
        selected = singles[0].effects
    while selected and len(selected) < MOST_EFFECTS:
        _one_more(found, data, selected, without)
        more = [c for e, c in found.items() if len(e) == len(selected) + 1]
        best = max(more, key=lambda c: c.evidence, default=None)
        if best is None or best.evidence < found[selected].evidence + ENOUGH:
            break
        selected = best.effects
    return selected


def one_more(finding: Finding, selected: tuple[str, ...]) -> Finding:
    """The search with sets of one effect more than some set of it."""
    found = dict(finding.candidates)
    _one_more(found, finding.data, selected, ())
    return finding._replace(candidates=found)


def _one_more(found: dict, data: Data, selected: tuple[str, ...], without: Collection[str]) -> None:
    """Refit the effects that a set leaves most room for, each beside it."""
    solution = found[selected].solution
    scores = scores_of(data, solution, without)
    names = [n for n in ranked(scores) if n not in selected and scores[n] > ENOUGH][:BESIDE]
    refit_each(found, data, solution, names, selected)


def exchange(found: dict, data: Data, selected: tuple[str, ...], without: Collection[str]) -> tuple[str, ...]:
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
        scores = scores_of(data, found[beside].solution, (*without, *selected))
        known = [set(effects) for effects in found]
        names = [n for n in ranked(scores)[:3] if scores[n] > ENOUGH and {*rest, n} not in known]
        refit_each(found, data, found[beside].solution, names, beside)
    # a larger set must be worth as much more as when sets grow
    return max(found.values(), key=value).effects


def scores_of(data: Data, solution: Solution, without: Collection[str]) -> dict[str, float]:
    """What each effect promises beyond a solution, but those left out."""
    return {name: gain for name, gain in score(data, solution).items() if name not in without}


def ranked(scores: dict[str, float]) -> list[str]:
    """Effects, the most promising for the price of its coordinates first."""
    return sorted(scores, key=lambda name: -(scores[name] - PENALTY * len(COORDINATES[name])))

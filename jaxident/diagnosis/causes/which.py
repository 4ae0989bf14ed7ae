"""Which effect: scores of all from the nominal fit, full refits of the best, then a second and a third beside it."""

from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from jaxident.diagnosis.causes.candidates import ENOUGH, Candidate, Finding, value
from jaxident.diagnosis.causes.search import Data, Solution, refit
from jaxident.diagnosis.causes.sets import exchange, grow, ranked, refit_each, scores_of
from jaxident.diagnosis.causes.unexplained import UNEXPLAINED, unexplained
from jaxident.diagnosis.motion.responses import Responses, respond
from jaxident.diagnosis.motion.windows import Windows
from jaxident.diagnosis.noise.law import Law, is_quieter, whitener_of
from jaxident.diagnosis.noise.sizing import WORTH, size_noise
from jaxident.effects.catalogue import CATALOGUE

REFITS, KEPT = 6, 4
"""Effects that are refitted first, look-alikes of the best on top, and how many of them again under the noise that the
best leaves."""
TAKEN = 0.7
"""Part of some noise that is left beside one more effect where the law before took that effect for noise."""
LIKELY = 1.0
"""Gain for which slip enters the law that the gap is held against: a floor without slip that is as likely there as not
would be too low, and too sure."""


class Search(NamedTuple):
    """A stage of the search: candidates by their effects, the data under the law of this stage, and the set chosen."""

    found: dict[tuple[str, ...], Candidate]
    data: Data
    responses: Responses
    law: Law
    selected: tuple[str, ...]


def search_effects(
    windows: Windows, nominal: Solution, law: Law, *, sized: bool = True, without: Collection[str] = ()
) -> Finding:
    """From the nominal fit under a noise law to a selected set.

    The law is sized again at the best fit, for the nominal one takes what is missing for slip; not so if `sized` is
    False. Effects in `without` are left out, as if the catalogue had no word for them.
    """
    data, responses = whiten(nominal, windows, law)
    nominal = refit(data, nominal.vector, nominal.starts, ())
    scores = scores_of(data, nominal, without)
    found: dict[tuple[str, ...], Candidate] = {(): Candidate((), nominal, 0.0)}
    refit_each(found, data, nominal, _with_look_alikes(scores), ())
    best = max(found.values(), key=lambda c: c.evidence)
    again = resized(best.solution, data, responses, law, sized)
    data, responses = whiten(best.solution, windows, again)
    found = _again(found, data)
    scores = scores_of(data, found[()].solution, without)
    refit_each(found, data, found[()].solution, [n for n in _with_look_alikes(scores) if (n,) not in found], ())
    now = Search(found, data, responses, again, _choose(found, data, without))
    if sized:
        now = _beside_rival(now, without)
    return _defended(now, sized)


def _defended(now: Search, sized: bool) -> Finding:
    """What the set leaves, or a smaller one, if further effects are not worth what is left, unless that would leave so
    much that the gap is unknown; a set that does so itself claims none of its names, and stays as near as it is."""
    solution = now.found[now.selected].solution
    # once more even for the same set: the law before came from a fit under the nominal one's noise, which is too large
    likely = resized(solution, now.data, now.responses, now.law, sized, LIKELY)
    terms, beside = unexplained(now.data, solution, now.responses, likely, sized)
    finding = Finding(now.data, beside, likely, now.found[()].solution, now.found, now.selected, terms)
    if finding.unexplained > UNEXPLAINED:
        return finding
    smaller = [effects for effects in now.found if 0 < len(effects) < len(now.selected)]
    best = max([now.selected, *smaller], key=lambda effects: value(now.found[effects], finding.further))
    if best == now.selected:
        return finding
    less = _defended(now._replace(selected=best), sized)
    return finding if less.unexplained > UNEXPLAINED else less


def _beside_rival(now: Search, without: Collection[str]) -> Search:
    """The search once more under the noise beside the best set of one effect more, or beside a set of several itself,
    if that is much less: the noise so far had taken the last effect up, and left it too little to gain."""
    rival = _rival(now.found, now.selected) or now.found[now.selected]
    if len(rival.effects) < 2:
        return now
    law = resized(rival.solution, now.data, now.responses, now.law, sized=True)
    if not is_quieter(law, now.law, TAKEN):
        return now
    data, responses = whiten(rival.solution, now.data.windows, law)
    first = max((effects for effects in now.found if len(effects) == 1), key=lambda e: now.found[e].evidence)
    parts = [effects for effects in now.found if set(effects) <= set(rival.effects)]
    found = _again(now.found, data, [first, *parts])  # else sets alone might be left, and none to grow from
    return Search(found, data, responses, law, _choose(found, data, without))


def _choose(found: dict, data: Data, without: Collection[str]) -> tuple[str, ...]:
    """The set that grows from the best single effect, each of it exchanged where another is better."""
    return exchange(found, data, grow(found, data, without), without)


def resized(solution: Solution, data: Data, responses: Responses, law: Law, sized: bool, worth: float = WORTH) -> Law:
    """The law sized at a solution, slip believed for some gain, or as it was."""
    if not sized:
        return law
    return size_noise(solution.linear.residual, solution.linear.starts, data.windows, responses, worth)


def whiten(solution: Solution, windows: Windows, law: Law) -> tuple[Data, Responses]:
    """The data under a law, slip linearised about a solution."""
    responses = respond(np.exp(solution.vector[:2]), solution.linear.residual, windows)
    return Data(windows, whitener_of(law, windows, responses)), responses


def _again(found: dict, data: Data, also: Collection[tuple[str, ...]] = ()) -> dict:
    """The best candidates, and some others, under another noise law, from where they were."""
    nominal = refit(data, found[()].solution.vector, found[()].solution.starts, ())
    fresh: dict[tuple[str, ...], Candidate] = {(): Candidate((), nominal, 0.0)}
    order = sorted((effects for effects in found if effects), key=lambda effects: -found[effects].evidence)
    for effects in dict.fromkeys([*order[:KEPT], *(e for e in also if e)]):
        candidate = found[effects]
        solution = refit(data, candidate.solution.vector, candidate.solution.starts, effects)
        fresh[effects] = Candidate(effects, solution, nominal.cost - solution.cost)
    return fresh


def _rival(found: dict, selected: tuple[str, ...]) -> Candidate | None:
    """The best set of one effect more, if it is worth its coordinates, whatever its form may cost."""
    more = [c for e, c in found.items() if len(e) == len(selected) + 1 and set(selected) < set(e)]
    best = max(more, key=lambda c: c.gain - c.price, default=None)
    now = found[selected]
    return best if best is not None and best.gain - best.price > now.gain - now.price + ENOUGH else None


def _with_look_alikes(scores: dict[str, float]) -> list[str]:
    """The best by score, and what the catalogue says the first two are confused with."""
    best = ranked(scores)[:REFITS]
    near = [other for name in best[:2] for other in CATALOGUE[name].confused_with if other in scores]
    return list(dict.fromkeys([*best, *near]))

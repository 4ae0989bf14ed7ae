"""From the nominal fit to the effects that take part.

A table, the best set on it, its refit, the noise beside it, and again until all of it stands.

Noise begins as white as the camera's frames say. Too little noise may let effects in that are not there. They leave
once random slip is sized beside them. Too much noise, sized beside a gap, keeps effects out for good.
"""

from collections.abc import Collection

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.causes.columns import Table, answers_of, tabulate
from jaxident.diagnosis.causes.defence import defended, renamed
from jaxident.diagnosis.causes.discrepancy import Rest
from jaxident.diagnosis.causes.found import Found
from jaxident.diagnosis.causes.moves import Move, better, fit_options, ranked, stands
from jaxident.diagnosis.causes.search import MOST_EFFECTS, best_set
from jaxident.diagnosis.causes.settled import Settled, noise_beside, same_law, whiten
from jaxident.diagnosis.fit.nominal import fit_without_effects
from jaxident.diagnosis.fit.refit import Data, Solution, refit
from jaxident.diagnosis.motion.responses import respond
from jaxident.diagnosis.motion.rims import first_noise, untold
from jaxident.diagnosis.motion.windows import Windows
from jaxident.diagnosis.noise.law import Law, first_law
from jaxident.diagnosis.noise.sizing import size_noise
from jaxident.diagnosis.preparation.dropped_commands import Lost, find_lost
from jaxident.effects.coordinates import COORDINATES

MOST_ROUNDS, MOST_LAWS, MOST_REPAIRS = 16, 3, 4
"""Tables under one noise law, laws after the first, and times that lost commands are looked for: bounds of the cost.
On a robot that lost 10 % of its commands, two repairs had found 3 %."""
LAST_ROUNDS = 6
"""Tables at the end from which effects may leave, while no exchange is refitted any more. No other number was
tried."""
SINGLES = 8
"""Effects refitted alone before a second search. No other number was tried."""
SENT, TERMS = 13.0, 2.0
"""Log-likelihood for which lost commands are believed, and how many times what the largest term in no catalogue brings
they must bring: where something is missing that has no name, as much is made up easily."""


def search(windows: Windows, nominal: Solution, without: Collection[str] = (), law: Law | None = None) -> list[Found]:
    """The ends of a search for the effects of some windows, from a nominal fit. `without`: effects that the catalogue
    is to lack. A law that is given stays as it is.

    The search begins at white noise. Where its end leaves something, a second search begins at noise as the nominal fit
    leaves it. A nominal model misses a real robot by twenty times the camera's error, and a search that takes all of
    that for effects may lose its way. A third one begins at what both have found (`crossed`). `ends.best_end` chooses.
    Where all ends are worse than no effect at all, the only end has no effect. Where the robot coasts, with its effects
    too, the first end is the only one: its rates are to be held, and the search made again (`finding.find_effects`).

    Three beginnings for every end with three effects or more were tried. On a Husky's log, where the first end leaves
    nothing, an end without any effect then had more evidence: 185 mm off unseen runs, in place of 130.
    """
    begin, sized, without = Move(nominal, (), -nominal.cost), law is None, {*without, *untold(windows)}
    wheel = first_noise(nominal.linear.rims, np.exp(nominal.vector[:2]), windows)
    law = first_law(windows)._replace(wheel=wheel) if law is None else law
    ends = [first := climb(windows, nominal, begin, law, without, sized)]
    if sized and np.any(first.coasting):
        return ends
    if sized and (first.rest.terms or first.worse_than_none):
        responses = respond(np.exp(nominal.vector[:2]), nominal.linear.residual, windows)
        law = size_noise(nominal.linear.residual, nominal.linear.starts, windows, responses)._replace(wheel=wheel)
        single = best_single(windows, nominal, law, without)
        ends.append(climb(windows, nominal, single, law, without, memory_last=False))
        ends += crossed(windows, nominal, ends, without)
    ends = [each for each in ends if not each.worse_than_none]
    if not ends:
        ends = [climb(windows, nominal, begin, law, COORDINATES, sized, memory_last=False)]
    return ends


def crossed(windows: Windows, nominal: Solution, ends: list[Found], without: Collection[str]) -> list[Found]:
    """The end of a search that begins at the effects of one of two ends, under the noise law of the one with more
    evidence; none where both have the same effects, or the first has none.

    A search sizes the noise beside its effects, and looks for effects beside that noise: either may hold the other
    where it is. On two halves of a Create's log such a search ended 99 and 85 above the better of both in log evidence.
    It named the delay of the other Creates where that had a limit of the command's rate, and their turn loss.
    """
    worse, better = sorted(ends, key=lambda end: end.log_evidence)
    now = worse.settled.now
    if not now.effects or set(now.effects) == set(better.settled.now.effects):
        return []
    data = whiten(now.fit, windows, better.law)[0]
    fit = refit(data, now.fit.vector, now.fit.starts, now.effects)
    return [climb(windows, nominal, stands(fit, now.effects), better.law, without, memory_last=False)]


def climb(
    windows: Windows,
    nominal: Solution,
    now: Move,
    law: Law,
    without: Collection[str] = (),
    sized: bool = True,
    memory_last: bool = True,
) -> Found:
    """The search from a fit and a noise law, which is sized again beside what is found, unless not `sized`; a
    memory of the camera is believed in the end only, or from the beginning."""
    laws, repairs, last = 0, 0, not (sized and memory_last)
    rest: Rest | None = None
    lost: Lost | None = None
    while True:
        state = settle(windows, now, law, None if rest is None else rest.answers, without)
        now, before = state.now, rest
        likely, rest = noise_beside(state.data, now.fit, law, sized, last)
        if sized and laws < MOST_LAWS and not (before is not None and same_law(rest.law, law)):
            law, laws = rest.law, laws + 1
            continue
        if not last:
            last, laws = True, MOST_LAWS - 1
            likely, rest = noise_beside(state.data, now.fit, law, sized, last)
            if not same_law(rest.law, law):
                law = rest.law
                continue
        more = find_lost(state.data, now.fit) if repairs < MOST_REPAIRS else None
        if more is None or more.gain < max(SENT, TERMS * rest.largest):
            bare = fit_without_effects(state.data, nominal, now.fit, bool(rest.terms))
            return renamed(defended(Found(state, law, likely, rest, lost, bare)), without)
        share, gain = (0.0, 0.0) if lost is None else (lost.share, lost.gain)
        lost = more._replace(share=share + more.share, gain=gain + more.gain)
        windows, repairs, laws = windows._replace(command=more.arrived), repairs + 1, min(laws, MOST_LAWS - 1)


def best_single(windows: Windows, nominal: Solution, law: Law, without: Collection[str] = ()) -> Move:
    """The best of some refits with one effect, those that the nominal fit's table has first; the nominal fit if none is
    better. Beside a large effect that table misleads: a Create's speed falls by 40 % in turns."""
    data = whiten(nominal, windows, law)[0]
    now = stands(refit(data, nominal.vector, nominal.starts, ()), ())
    table = tabulate(data, now.fit, ())
    singles = [fit_options(data, table, now, [k]) for k, _ in ranked(table, [], without)[:SINGLES]]
    return max([now, *(each for each in singles if each is not None)], key=lambda each: each.evidence)


def settle(windows: Windows, now: Move, law: Law, rest: Array | None, without: Collection[str] = ()) -> Settled:
    """The search under one noise law: whatever the table or a refit has better is taken until nothing is."""
    data = whiten(now.fit, windows, law)[0]
    now = stands(refit(data, now.fit.vector, now.fit.starts, now.effects), now.effects)
    tried: dict[frozenset[str], float] = {frozenset(now.effects): 0.0}
    for number in range(MOST_ROUNDS):
        answers = answers_of(data, now.fit, now.effects)
        table = tabulate(data, now.fit, now.effects, rest, answers=answers)
        chosen = best_set(table, [table.here[name] for name in now.effects], without)
        found = _taken(data, table, now, chosen, tried)
        if found is None and number < MOST_ROUNDS - LAST_ROUNDS:
            found = better(data, table, now, tried, without)
        if found is None:
            break
        if found.effects != now.effects:
            tried = {effects: value + now.evidence - found.evidence for effects, value in tried.items()}
            tried[frozenset(found.effects)] = 0.0
        now = found
    else:  # the last fit has no table yet
        answers = answers_of(data, now.fit, now.effects)
        table = tabulate(data, now.fit, now.effects, rest, answers=answers)
    return Settled(now, data, table, tried, answers)


def _taken(data: Data, table: Table, now: Move, chosen: list[int], tried: dict[frozenset[str], float]) -> Move | None:
    """The set that the table promises, refitted; if that is no better, or was refitted before, the first better one
    with a single effect of those that join; at last the set without effects that are worth nothing. Effects leave
    without a better fit: their own windows speak against them."""
    here = [table.here[name] for name in now.effects]
    fresh = [k for k in chosen if k not in here]
    for each in [chosen, *([*here, k] for k in fresh)]:
        effects = frozenset(table.effects(each))
        if not fresh or effects in tried or len(each) > MOST_EFFECTS:
            continue
        found = fit_options(data, table, now, each)
        if found is not None:
            tried[effects] = found.evidence - now.evidence
            if tried[effects] > 0.0:
                return found
    kept = best_set(table, here, COORDINATES)
    return None if kept == here else fit_options(data, table, now, kept)

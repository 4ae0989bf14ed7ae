"""From the nominal fit to the effects that take part.

A table, the best set on it, its refit, the noise beside it, and again until all of it stands.

Noise begins as white as the camera's frames say. Too little noise may let effects in that are not there. They leave
once random slip is sized beside them. Too much noise, sized beside a gap, keeps effects out for good.
"""

from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.causes.columns import Table, answers_of, tabulate
from jaxident.diagnosis.causes.discrepancy import UNEXPLAINED, Rest
from jaxident.diagnosis.causes.discrepancy_basis import WORTH
from jaxident.diagnosis.causes.evidence import worth
from jaxident.diagnosis.causes.moves import Move, better, fit_options, ranked, stands, united
from jaxident.diagnosis.causes.search import MOST_EFFECTS, best_set
from jaxident.diagnosis.causes.settled import Settled, noise_beside, same_law, whiten
from jaxident.diagnosis.fit.nominal import coasts, fit_without_effects
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
SURE = 2.0
"""Log evidence from which an effect is named in the end: seven times as likely as not. No other value was tried."""
SENT, TERMS = 13.0, 2.0
"""Log-likelihood for which lost commands are believed, and how many times what the largest term in no catalogue brings
they must bring: where something is missing that has no name, as much is made up easily. Only the first ones
found must go by chance: those found after them went by the size of the change where commands were lost, too
(dependence up to 168)."""


class Found(NamedTuple):
    """Where a search ends: as it stands, the noise law, the likeliest law without the terms of `rest`, what is in no
    catalogue, the commands that were lost, None if none, and the fit without effects to the same data."""

    settled: Settled
    law: Law
    likely: Law
    rest: Rest
    lost: Lost | None
    nominal: Solution

    @property
    def worse_than_none(self) -> bool:
        """Whether no effect at all fits better under the same law: the search has lost its way. On a Husky's log it
        ended at a speed that settles in 14 ms."""
        return -self.nominal.cost > self.settled.now.evidence

    @property
    def coasting(self) -> np.ndarray:
        """Which speeds (2,) coast of the robot without effects and of that with them: a robot without its effects may
        seem to for want of these. A speed that settles at 0.54 1/s did, seen by a marker 3 cm off the axle."""
        windows, doubted = self.settled.data.windows, bool(self.rest.terms)
        return coasts(self.nominal, windows, doubted) & coasts(self.settled.now.fit, windows, doubted)

    @property
    def log_evidence(self) -> float:
        """Of effects, terms and noise law together."""
        now = self.settled.now
        return self.rest.log_likelihood + (now.evidence + now.fit.cost) - WORTH * len(self.rest.terms)


def search(windows: Windows, nominal: Solution, without: Collection[str] = (), law: Law | None = None) -> list[Found]:
    """The ends of a search for the effects of some windows, from a nominal fit. `without`: effects that the catalogue
    is to lack. A law that is given stays as it is.

    The search begins at white noise. Where its end leaves something, a second search begins at noise as the nominal fit
    leaves it (`ends.best_end` chooses). A nominal model misses a real robot by twenty times the camera's error, and a
    search that takes all of that for effects may lose its way. Where the two ends differ, a third search begins at the
    effects of both. Where all ends are worse than no effect at all, the only end has no effect. Where the robot coasts,
    with its effects too, the first end is the only one: its rates are to be held, and the search made again
    (`finding.find_effects`).
    """
    begin, sized, without = Move(nominal, (), -nominal.cost), law is None, {*without, *untold(windows)}
    wheel = first_noise(nominal.linear.rims, np.exp(nominal.vector[:2]), windows)
    law = first_law(windows)._replace(wheel=wheel) if law is None else law
    ends = [climb(windows, nominal, begin, law, without, sized)]
    if sized and np.any(ends[0].coasting):
        return ends
    if sized and (ends[0].rest.terms or ends[0].worse_than_none):
        responses = respond(np.exp(nominal.vector[:2]), nominal.linear.residual, windows)
        law = size_noise(nominal.linear.residual, nominal.linear.starts, windows, responses)._replace(wheel=wheel)
        single = best_single(windows, nominal, law, without)
        ends.append(climb(windows, nominal, single, law, without, memory_last=False))
        one, other = sorted(ends, key=lambda end: -end.log_evidence)
        both = united(one.settled.now, other.settled.now)
        if both.effects != one.settled.now.effects:
            ends.append(climb(windows, nominal, both, one.law, without, memory_last=False))
    ends = [each for each in ends if not each.worse_than_none]
    if not ends:
        ends = [climb(windows, nominal, begin, law, COORDINATES, sized, memory_last=False)]
    return ends


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
        if more is None or more.gain < max(SENT, TERMS * rest.largest) or (lost is None and not more.by_chance):
            bare = fit_without_effects(state.data, nominal, now.fit, bool(rest.terms))
            return defended(Found(state, law, likely, rest, lost, bare))
        earlier = more._replace(share=0.0, gain=0.0) if lost is None else lost
        share, gain = earlier.share + more.share, earlier.gain + more.gain
        lost = more._replace(share=share, gain=gain, dependence=earlier.dependence)
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


def defended(found: Found) -> Found:
    """The search without effects that the terms in no catalogue can stand in for.

    These were chosen beside the effects, so that none of them is one of those. Effects that are worth less than SURE
    once the terms are free were put together for what has no name. The table is then the one with the terms free.
    """
    owners = _owners(found)
    while True:
        state, rest = found.settled, found.rest
        data, now = state.data, state.now
        table = tabulate(data, now.fit, now.effects, rest.answers, free=True, owners=owners, answers=state.answers)
        here = [table.here[name] for name in now.effects]
        own = {k: worth(table, here, k).evidence for k in here}
        weakest = min(own, key=lambda k: own[k], default=None)
        if weakest is None or own[weakest] >= SURE:
            return found._replace(settled=state._replace(table=table, answers=None))
        owners = [name for name in owners if name != table.options[weakest].effect]
        fewer = fit_options(data, table, now, [k for k in here if k != weakest])
        assert fewer is not None  # no limit was set
        now, tried = fewer, {key: v + now.evidence - fewer.evidence for key, v in state.tried.items()}
        state = state._replace(now=now, tried=tried, answers=None)
        found = found._replace(settled=state, rest=noise_beside(data, now.fit, found.law, sized=False)[1])


def _owners(found: Found) -> list[str]:
    """Effects beside which all terms in no catalogue bring less than a fifth of what these and the effect bring: such
    an effect has all but its form.

    A robot that keeps one speed loses it in turns as `turn_loss` says, or by a constant times |w|: its log cannot tell
    these apart. A name that explains as much comes first. A Create's turn loss brings 294, all terms beside it 34.
    Where a heading has an error that no catalogue lists, a tilt of the camera brings 6364, and terms beside it 2163.
    """
    (now, data, _, _, answers), rest = found.settled, found.rest
    table = tabulate(data, now.fit, now.effects, rest.answers, answers=answers)
    here = [table.here[name] for name in now.effects]
    gains = {name: worth(table, here, table.here[name]).gain for name in now.effects}
    return [name for name, gain in gains.items() if rest.gain < UNEXPLAINED * (gain + rest.gain)]

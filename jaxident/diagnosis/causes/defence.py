"""Names against terms in no catalogue, at the end of a search: a name that terms can stand in for leaves, and a term
that a name can stand in for gets this name."""

from collections.abc import Collection

import numpy as np

from jaxident.diagnosis.causes.columns import answers_of, tabulate
from jaxident.diagnosis.causes.discrepancy import UNEXPLAINED
from jaxident.diagnosis.causes.evidence import worth
from jaxident.diagnosis.causes.found import Found
from jaxident.diagnosis.causes.moves import Move, fit_options, ranked
from jaxident.diagnosis.causes.search import MOST_EFFECTS
from jaxident.diagnosis.causes.settled import noise_beside

SURE = 2.0
"""Log evidence from which an effect is named in the end: seven times as likely as not. No other value was tried."""


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
        found = _at(found, fewer)


def renamed(found: Found, without: Collection[str] = ()) -> Found:
    """The search with names in the places of terms, where effects, terms and noise law are then likelier together.

    A name that was put together for what has no name may keep a true one out. Once it has left, a term stands where the
    true name could. On a sealed robot whose heading has an error that no catalogue lists, a term worth 238 was its loss
    of speed in turns.
    """
    before = found
    while (better := _one_renamed(found, without)) is not None:
        found = better
    if found is before:
        return found
    now = found.settled.now
    return found._replace(likely=noise_beside(found.settled.data, now.fit, found.law)[0])


def _one_renamed(found: Found, without: Collection[str]) -> Found | None:
    """The same with a name in place of the first term for which one is likelier, the largest term first; None where
    there is no such term. The other terms are free meanwhile."""
    state, rest, now = found.settled, found.rest, found.settled.now
    if not rest.terms or len(now.effects) == MOST_EFFECTS:
        return None
    answers = answers_of(state.data, now.fit, now.effects)
    for place in sorted(range(len(rest.terms)), key=lambda k: -rest.terms[k][1]):
        others = np.delete(rest.answers, place, axis=2)
        table = tabulate(state.data, now.fit, now.effects, others, free=True, answers=answers)
        here = [table.here[name] for name in now.effects]
        best = next((k for k, _ in ranked(table, here, without)), None)
        if best is None or worth(table, [*here, best], best).evidence < SURE:
            continue
        more = fit_options(state.data, table, now, [*here, best])
        assert more is not None  # no limit was set
        other = defended(_at(found, more))
        if other.log_evidence > found.log_evidence:
            return other
    return None


def _at(found: Found, move: Move) -> Found:
    """The search at another fit, and what that leaves without a name under the same law."""
    left = noise_beside(found.settled.data, move.fit, found.law, sized=False)[1]
    return found._replace(settled=found.settled.at(move), rest=left)


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

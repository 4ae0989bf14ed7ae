"""Where a search ends: the selected set with its fit, what it is worth beside its neighbours, and what it leaves."""

from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from jaxident.diagnosis.causes.columns import Table
from jaxident.diagnosis.causes.discrepancy import Rest
from jaxident.diagnosis.causes.ends import best_end
from jaxident.diagnosis.causes.evidence import WRONG, Worth, evidence_of, worth
from jaxident.diagnosis.causes.moves import stands
from jaxident.diagnosis.causes.search import joining
from jaxident.diagnosis.causes.search_rounds import TERMS, Found, climb, search
from jaxident.diagnosis.causes.settled import Settled
from jaxident.diagnosis.fit.nominal import coasts, hold_rates
from jaxident.diagnosis.fit.refit import Data, Solution, refit
from jaxident.diagnosis.motion.rims import untold
from jaxident.diagnosis.noise.law import Law
from jaxident.diagnosis.preparation.prepare import Prepared, repaired

CLAIMED = 9.0
"""Log-likelihood from which an effect is claimed that shows in the frames or in the noise law: normal noise reaches it
once in ten thousand logs."""

Values = dict[frozenset[str], float]
"""Log evidence of sets of effects, less that of the selected one."""


class Entrant(NamedTuple):
    """An effect of the selected set, or one that could join it, or stand in for (`instead`) one of it: the fall of
    -log p that it brings beside the others, and its log evidence."""

    effect: str
    instead: str
    gain: float
    evidence: float


class Finding(NamedTuple):
    """data: windows under the noise law of the search. law: that beside what is in no catalogue; likely: the likeliest
    one without, which takes that for noise. nominal: the fit without effects; fit: that of the selected set. values: of
    the selected set and its neighbours. rest: what is predictable and in no named effect. table: the answers of the
    poses about the fit."""

    data: Data
    law: Law
    likely: Law
    nominal: Solution
    fit: Solution
    selected: tuple[str, ...]
    values: Values
    rest: Rest
    table: Table

    @property
    def gain(self) -> float:
        """Fall of -log p from the nominal fit to that of the selected set."""
        return max(self.nominal.cost - self.fit.cost, 0.0)

    @property
    def unexplained(self) -> float:
        """The rest's share of all that is explained."""
        return self.share(self.rest.gain)

    def share(self, rest: float) -> float:
        """Share of some rest in it and what the selected set explains."""
        return rest / max(self.gain + rest, 1e-9)

    @property
    def further(self) -> float:
        """Log-likelihood for which an effect beside others is claimed that shows in the frames or in the noise law:
        where something is missing that has no name, as much is made up easily."""
        return max(CLAIMED, TERMS * self.rest.largest) if self.selected else CLAIMED

    def evidence(self, name: str) -> float:
        """Log evidence of one effect of the selected set beside the others; 0 of one that the table has not."""
        here = [self.table.here[each] for each in self.selected if each in self.table.here]
        return worth(self.table, here, self.table.here[name]).evidence if name in self.table.here else 0.0

    def entrants(self, alike: Collection[str] = ()) -> list[Entrant]:
        """The selected effects, the best option of every other to join them, and those of some look-alikes to stand in
        for one."""
        table, here = self.table, [self.table.here[name] for name in self.selected]
        found = [Entrant(table.options[k].effect, "", *worth(table, here, k)) for k in here]
        found += _best_entrants(table, here, "")
        for old in here:
            base = [k for k in here if k != old]
            found += [e for e in _best_entrants(table, base, table.options[old].effect) if e.effect in alike]
        return found


def find_effects(prepared: Prepared, without: Collection[str] = (), law: Law | None = None) -> tuple[Prepared, Finding]:
    """The search on prepared windows, and these with the commands that arrived where some were lost. `without`: effects
    that the catalogue is to lack. A noise law that is given, that of a simulator, stays as it is. Where a robot coasts,
    its rates are held, and the search is made again; then they are let go, if it does not coast with what was found."""
    found, free = best_end(prepared, search(prepared.windows, prepared.nominal, without, law)), prepared
    while law is None and np.any(found.coasting):
        windows, nominal = hold_rates(prepared.windows, found.coasting, prepared.told)
        prepared = prepared._replace(windows=windows, nominal=nominal)
        found = best_end(prepared, search(windows, nominal, without, law))
    if prepared is not free and (other := let_go(free, found, without)) is not None:
        prepared, found = free, other
    if found.lost is not None:
        prepared = repaired(prepared, found.lost)
    return prepared, finding_of(prepared, found, without)


def let_go(prepared: Prepared, held: Found, without: Collection[str] = ()) -> Found | None:
    """The search from where one with held rates ended, on windows that hold none; None where the robot coasts all the
    same. A large effect may hide how a robot settles, and be found only while its rates are held."""
    windows, now = prepared.windows, held.settled.now
    fit = refit(held.settled.data._replace(windows=windows), now.fit.vector, now.fit.starts, now.effects)
    if not now.effects or np.any(coasts(fit, windows, bool(held.rest.terms))):
        return None
    found = climb(windows, prepared.nominal, stands(fit, now.effects), held.law, without, memory_last=False)
    return None if np.any(found.coasting) or found.worse_than_none else found


def finding_of(prepared: Prepared, found: Found, without: Collection[str] = ()) -> Finding:
    """The finding of a search that has ended."""
    settled = found.settled
    nominal = found.nominal if settled.now.effects else settled.now.fit
    values = neighbours(settled, nominal, {*without, *untold(settled.data.windows)})
    return Finding(settled.data, found.law, found.likely, nominal, settled.now.fit, settled.now.effects, values,
                   found.rest, settled.table)  # fmt: skip


def neighbours(settled: Settled, nominal: Solution, without: Collection[str] = ()) -> Values:
    """Values of the selected set, of the same without one effect, with one more, with one exchanged, and of none.

    Where such a set was refitted its own fit counts, less by as much as windows disagree on what is exchanged.
    """
    now, table = settled.now, settled.table
    here = [table.here[name] for name in now.effects]
    own = {k: worth(table, here, k) for k in here}
    found: Values = {frozenset(): evidence_of(nominal, 0) - now.evidence, frozenset(now.effects): 0.0}
    for k in joining(table, here, without):
        key, value = frozenset({*now.effects, table.options[k].effect}), worth(table, [*here, k], k).evidence
        value = min(value, settled.tried.get(key, 0.0), 0.0)
        found[key] = max(found.get(key, WRONG), value)
    for old in here:
        base = [k for k in here if k != old]
        found[frozenset(table.effects(base))] = -own[old].evidence
        for k in joining(table, base, {*without, *now.effects}):
            key, there = frozenset(table.effects([*base, k])), worth(table, [*base, k], k)
            found[key] = max(found.get(key, WRONG), min(there.evidence - own[old].evidence, 0.0))
        agreed = _agreement(own[old])
        tried = {
            key: v for key, v in settled.tried.items() if len(key) == len(here) and key >= set(table.effects(base))
        }
        found |= {key: min(agreed * value, 0.0) for key, value in tried.items()}
    return found


def _best_entrants(table: Table, base: list[int], instead: str) -> list[Entrant]:
    """The best option of each effect beside some others."""
    best: dict[str, Entrant] = {}
    for k in joining(table, base, {instead}):
        each = Entrant(table.options[k].effect, instead, *worth(table, [*base, k], k))
        if each.effect not in best or each.evidence > best[each.effect].evidence:
            best[each.effect] = each
    return list(best.values())


def _agreement(own: Worth) -> float:
    """Part of what an effect gains that windows agree on."""
    return float(np.clip(own.evidence / max(own.gain, 1e-9), 0.0, 1.0))

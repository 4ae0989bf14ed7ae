"""Named effects that the runs kept for judging refuse. They fit the runs that named them, but the model predicts runs
that no fit saw better without them: a corrected model that has them would be worse than none on tomorrow's log."""

from collections.abc import Collection, Mapping

from jaxident.array_types import Array
from jaxident.diagnosis.account.models import LOST
from jaxident.diagnosis.account.shrink import LOW, taken
from jaxident.diagnosis.causes.columns import tabulate
from jaxident.diagnosis.causes.finding import Finding
from jaxident.diagnosis.causes.moves import stands
from jaxident.diagnosis.causes.settled import noise_beside, whiten
from jaxident.diagnosis.fit.nominal import fit_without_effects
from jaxident.diagnosis.fit.refit import refit
from jaxident.diagnosis.preparation.judging import Judged
from jaxident.effects.coordinates import NOMINAL, PLACES, neutral_vector

TURNS = 2
"""Fits and laws of noise found in turns. No other number was tried."""


def refused(
    judged: Mapping[frozenset[str], Judged], players: tuple[str, ...], last: Judged, unit: Array, seed: int
) -> tuple[str, ...]:
    """Effects of `players` that the judging rows refuse, in their order.

    A smaller set of effects beats a larger one if it predicts the judging rows better, with a probability of 95 %. From
    all players on, the largest set that beats the present one takes its place (of equally large ones the best), until
    none does. judged: every set that the account has, by its effects; last: the model with all players, and with
    discovered laws if any; unit (3,): the camera's variances [m^2, m^2, rad^2]. Lost commands are never refused: single
    jumps of the command show them."""
    kept, now = frozenset(players), last
    while True:
        surely = []
        for fewer in (each for each in judged if each < kept and LOST not in kept - each):
            share, p_value = taken(now.error, judged[fewer].error, now.error**2 / unit, unit, seed)
            surely += [(len(fewer), share, fewer)] if p_value < LOW else []
        if not surely:
            return tuple(name for name in players if name not in kept)
        kept = max(surely, key=lambda each: each[:2])[2]
        now = judged[kept]


def finding_without(finding: Finding, refused: Collection[str]) -> Finding:
    """The finding without some effects: the others refitted, the noise sized beside them, and what is then left.

    The noise law was sized beside the effects that leave, so fit and law are found twice in turns. Of sets of effects
    only the one that stays and the empty one are compared: the judging rows decided about the others."""
    names = tuple(name for name in finding.selected if name not in refused)
    vector = neutral_vector(finding.nominal.vector[: len(NOMINAL)])
    places = [place for (name, _), place in PLACES.items() if name in names]
    vector[places] = finding.fit.vector[places]
    law = finding.law
    for _ in range(TURNS):
        data, _ = whiten(finding.nominal, finding.data.windows, law)
        now = stands(refit(data, vector, finding.nominal.starts, names), names)
        likely, rest = noise_beside(data, now.fit, law)
        law, vector = rest.law, now.fit.vector
    nominal = fit_without_effects(data, finding.nominal, now.fit, bool(rest.terms))
    values = {frozenset(): stands(nominal, ()).evidence - now.evidence, frozenset(names): 0.0}
    table = tabulate(data, now.fit, names, rest.answers)
    return Finding(data, law, likely, nominal, now.fit, names, values, rest, table)

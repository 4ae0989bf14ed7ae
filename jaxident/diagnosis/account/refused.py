"""Effects that the runs kept for judging refuse: they fit the runs that named them, and the model with them predicts
runs that no fit saw surely worse. A corrected model that harms is of no use on tomorrow's log."""

from collections.abc import Collection, Mapping

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.account.judging import Judged
from jaxident.diagnosis.account.models import LOST
from jaxident.diagnosis.account.shrink import LOW, RESAMPLES, blocks
from jaxident.diagnosis.causes.columns import tabulate
from jaxident.diagnosis.causes.finding import Finding
from jaxident.diagnosis.causes.moves import stands
from jaxident.diagnosis.causes.settled import Settled, noise_beside, whiten
from jaxident.diagnosis.fit.refit import refit
from jaxident.effects.coordinates import NOMINAL, PLACES, neutral_vector


def taken(before: Judged, after: Judged, total: Array, unit: Array, seed: int) -> tuple[float, float]:
    """The share of the total that one model takes away from another's error on the judging rows, and how likely it
    takes none; total (starts, 3): squares over the camera's variances `unit` (3,)."""
    gained, whole = np.mean((before.error**2 - after.error**2) / unit, axis=1), np.mean(total, axis=1)
    kept = np.isfinite(gained) & np.isfinite(whole)
    if not kept.any() or not np.isfinite(after.error[np.isfinite(before.error)]).all():
        return 0.0, 1.0
    gained, whole = gained[kept], whole[kept]
    drawn = gained[blocks(np.random.default_rng(seed), len(gained), RESAMPLES)].mean(axis=1)
    return float(gained.mean() / whole.mean()), float(np.mean(drawn <= 0.0))


def refused(
    judged: Mapping[frozenset[str], Judged], players: tuple[str, ...], last: Judged, unit: Array, seed: int
) -> tuple[str, ...]:
    """Effects of `players` without which the judging rows are predicted better, 95 % surely: while a smaller set
    does, the largest of such sets is taken, and of equally large ones the best. `last`: how the model with all of them,
    and discovered laws, does. Lost commands stay: single jumps of the command show them."""
    kept, now = frozenset(players), last
    while True:
        surely = []
        for fewer in (each for each in judged if each < kept and LOST not in kept - each):
            share, p_value = taken(now, judged[fewer], now.error**2 / unit, unit, seed)
            surely += [(len(fewer), share, fewer)] if p_value < LOW else []
        if not surely:
            return tuple(name for name in players if name not in kept)
        kept = max(surely, key=lambda each: each[:2])[2]
        now = judged[kept]


def finding_without(finding: Finding, refused: Collection[str]) -> Finding:
    """The finding without some effects: the others refitted, the noise sized beside them, and what is then left."""
    names = tuple(name for name in finding.selected if name not in refused)
    vector = neutral_vector(finding.nominal.vector[: len(NOMINAL)])
    places = [place for (name, _), place in PLACES.items() if name in names]
    vector[places] = finding.fit.vector[places]
    law = finding.law
    for _ in range(2):  # the noise was sized beside the effects that leave
        data, _ = whiten(finding.nominal, finding.data.windows, law)
        now = stands(refit(data, vector, finding.nominal.starts, names), names)
        state = Settled(now, data, tabulate(data, now.fit, names), {})
        likely, rest = noise_beside(state, law, sized=True)
        law, vector = rest.law, now.fit.vector
    nominal = refit(data, finding.nominal.vector, finding.nominal.starts, ())
    values = {frozenset(): stands(nominal, ()).evidence - now.evidence, frozenset(names): 0.0}
    table = tabulate(data, now.fit, names, rest.answers)
    return Finding(data, law, likely, nominal, now.fit, names, values, rest, table)

"""Which discovered curves the judging runs confirm, and how much of the error each takes away there."""

import dataclasses
from typing import NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.account.judging import Judged, judge_model
from jaxident.diagnosis.account.models import Corrected, corrected_of
from jaxident.diagnosis.account.shrink import LOW, RESAMPLES, blocks
from jaxident.diagnosis.account.sized import beside, sized_corrected, with_curves
from jaxident.diagnosis.causes.finding import Finding
from jaxident.diagnosis.discovery.candidates import Kind
from jaxident.diagnosis.discovery.fit import Bending, as_law
from jaxident.diagnosis.discovery.forms import Form, form_of
from jaxident.diagnosis.discovery.search import discover
from jaxident.diagnosis.noise.doubt import Draws
from jaxident.diagnosis.noise.law import deviations
from jaxident.diagnosis.prepare import Prepared
from jaxident.robot.model import Discovered, Model


class Shown(NamedTuple):
    """A discovered law in the user's unit, the rows that lie nearest to each of its knots, the share of the refitted
    nominal model's error that it takes away, the probability that it takes none away, and what it looks like."""

    kind: Kind
    law: Discovered
    density: tuple[int, ...]
    share: float
    p_value: float
    form: Form | None


class Confirmed(NamedTuple):
    """Curves that the judging rows confirm. whole: the corrected model with them, and judged there; named: the model
    with the named effects alone, under the same noise law, of which there are draws."""

    bending: Bending
    whole: Corrected
    judged: Judged
    named: Corrected
    draws: Draws

    @property
    def model(self) -> Model:
        """The corrected model."""
        return self.whole.model


def confirm(prepared: Prepared, finding: Finding, direct: dict, seed: int) -> Confirmed | None:
    """The most curves, in the order in which they were found, that take error away on the judging rows, 95 % surely;
    None if none do. The judging rows only accept or refuse: they change no number of a curve."""
    for bending in reversed(discover(finding)):
        whole, draws = sized_corrected(prepared, beside(finding, bending), direct, seed, bending)
        named = corrected_of(prepared, finding, whole.law, direct)
        judged, before = judge_model(whole.model, prepared), judge_model(_plain(named.model), prepared)
        unit = deviations(whole.law) ** 2
        share, p_value = _taken(before, judged, before.error**2 / unit, unit, seed)
        if share > 0.0 and p_value < LOW:
            return Confirmed(bending, whole, judged, named, draws)
    return None


def each_law(prepared: Prepared, found: Confirmed, total: Array, unit: Array, seed: int) -> tuple[Shown, ...]:
    """Every law with what switching it off would bring back, all else alike; total (starts, 3): squares of the refitted
    nominal model over the camera's variances `unit` (3,)."""
    shown = []
    for k, curve in enumerate(found.bending.curves):
        without = with_curves(found.whole, found.bending, prepared.largest, but=k)
        share, p_value = _taken(judge_model(_plain(without.model), prepared), found.judged, total, unit, seed)
        law = as_law(curve, prepared.largest)
        density = tuple(int(n) for n in curve.density)
        shown.append(Shown(curve.kind, law, density, share, p_value, form_of(curve, law)))
    return tuple(shown)


def _taken(before: Judged, after: Judged, total: Array, unit: Array, seed: int) -> tuple[float, float]:
    """The share of the total that one model takes away from another's error, and how likely it takes none."""
    gained, whole = np.mean((before.error**2 - after.error**2) / unit, axis=1), np.mean(total, axis=1)
    kept = np.isfinite(gained) & np.isfinite(whole)
    if not kept.any() or not np.isfinite(after.error[np.isfinite(before.error)]).all():
        return 0.0, 1.0
    gained, whole = gained[kept], whole[kept]
    drawn = gained[blocks(np.random.default_rng(seed), len(gained), RESAMPLES)].mean(axis=1)
    return float(gained.mean() / whole.mean()), float(np.mean(drawn <= 0.0))


def _plain(model: Model) -> Model:
    """The model without its covariance, which costs a run for each of its directions."""
    return dataclasses.replace(model, covariance=None, parameter_order=())

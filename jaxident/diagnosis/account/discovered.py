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
    nominal model's error that it takes away beside the laws before it, the probability that it takes none away, and
    what it looks like."""

    kind: Kind
    law: Discovered
    density: tuple[int, ...]
    share: float
    p_value: float
    form: Form | None


class Confirmed(NamedTuple):
    """Curves that the judging rows confirm, each with the fit in which it came last. whole: the corrected model with
    all of them, and judged there; named: the model with the named effects alone, under the same noise law, of which
    there are draws; before: how that one does."""

    steps: list[Bending]
    whole: Corrected
    judged: Judged
    named: Corrected
    before: Judged
    draws: Draws

    @property
    def model(self) -> Model:
        """The corrected model."""
        return self.whole.model


def confirm(prepared: Prepared, finding: Finding, direct: dict, seed: int) -> Confirmed | None:
    """The most curves, in the order in which they were found, that take error away on the judging rows, 95 % surely;
    None if none do. The judging rows only accept or refuse: they change no number of a curve."""
    steps = discover(finding)
    while steps:
        whole, draws = sized_corrected(prepared, beside(finding, steps[-1]), direct, seed, steps[-1])
        named = corrected_of(prepared, finding, whole.law, direct)
        judged, before = judge_model(whole.model, prepared), judge_model(_plain(named.model), prepared)
        unit = deviations(whole.law) ** 2
        share, p_value = _taken(before, judged, before.error**2 / unit, unit, seed)
        if share > 0.0 and p_value < LOW:
            return Confirmed(steps, whole, judged, named, before, draws)
        steps = steps[:-1]
    return None


def each_law(
    prepared: Prepared, finding: Finding, found: Confirmed, total: Array, unit: Array, seed: int
) -> tuple[Shown, ...]:
    """Every law with what it takes away beside those that were found before it, all else refitted; total (starts, 3):
    squares of the refitted nominal model over the camera's variances `unit` (3,)."""
    shown, last = [], found.before
    for k, step in enumerate(found.steps, 1):
        if k == len(found.steps):
            now = found.judged
        else:
            part = corrected_of(prepared, beside(finding, step), found.whole.law, found.whole.direct)
            now = judge_model(_plain(with_curves(part, step, prepared.largest).model), prepared)
        share, p_value = _taken(last, now, total, unit, seed)
        curve, last = found.steps[-1].curves[k - 1], now
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

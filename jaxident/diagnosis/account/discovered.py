"""Which discovered curves the judging runs confirm, and how much of the error each takes away there."""

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

from jaxident.array_types import Array
from jaxident.diagnosis.account.models import Corrected, corrected_of
from jaxident.diagnosis.account.shrink import LOW, taken
from jaxident.diagnosis.account.sized import beside, sized_corrected
from jaxident.diagnosis.causes.finding import Finding
from jaxident.diagnosis.discovery.fit import Bending, as_law
from jaxident.diagnosis.discovery.forms import Form, form_of
from jaxident.diagnosis.discovery.search import discover
from jaxident.diagnosis.laws.kinds import Kind
from jaxident.diagnosis.noise.law import deviations
from jaxident.diagnosis.noise.variance_uncertainty import Draws
from jaxident.diagnosis.preparation.judging import Judged, judge_model
from jaxident.diagnosis.preparation.prepare import Prepared
from jaxident.robot.model import Discovered, Model


class Shown(NamedTuple):
    """A discovered law in the user's unit, the rows that lie nearest to each of its knots, the share of the refitted
    nominal model's error that it takes away beside the laws before it, the probability that it takes none away, and
    what it looks like; alike: other kinds of laws that would explain nearly as much."""

    kind: Kind
    law: Discovered
    density: tuple[int, ...]
    share: float
    p_value: float
    form: Form | None
    alike: tuple[Kind, ...] = ()


class Confirmed(NamedTuple):
    """Curves that the judging rows confirm, as fitted together. whole: the corrected model with them; named: with the
    named effects alone, under the same noise law, of which there are draws. steps: how the model does there without
    curves, with the first, with the first two and so on."""

    bending: Bending
    whole: Corrected
    named: Corrected
    draws: Draws
    steps: list[Judged]

    @property
    def model(self) -> Model:
        """The corrected model."""
        return self.whole.model


def confirm(prepared: Prepared, finding: Finding, direct: dict, seed: int, plain: Corrected) -> Confirmed | None:
    """The most curves, in the order in which they were found, that the judging rows confirm; None if none.

    The judging rows accept or refuse (`confirms`): they change no number of a curve. plain: the corrected model without
    curves.
    """
    steps: list[Judged] = []
    found, confirmed = None, 0
    for bending in discover(finding):
        steps = steps or [judge_model(_plain(plain.model), prepared)]
        whole, draws = sized_corrected(prepared, beside(finding, bending), direct, seed, bending)
        steps = [*steps, judge_model(_plain(whole.model), prepared)]
        if confirms([step.error for step in steps], confirmed, deviations(whole.law) ** 2, seed):
            confirmed = len(steps) - 1
            named = corrected_of(prepared, finding, whole.law, direct)
            found = Confirmed(bending, whole, named, draws, steps)
    return found


def confirms(errors: Sequence[Array], confirmed: int, unit: Array, seed: int) -> bool:
    """Whether the last of some curves is confirmed. errors (starts, 3) without curves, with the first, with the first
    two and so on; confirmed: how many of them are; unit (3,): the camera's variances.

    Beside those that are confirmed it takes error away, 95 % surely. Two halves of one law may do so together only: the
    second then takes some away beside the first.
    """
    (share, p_value), (more, _) = (
        taken(before, errors[-1], errors[0] ** 2 / unit, unit, seed) for before in (errors[confirmed], errors[-2])
    )
    return min(share, more) > 0.0 and p_value < LOW


def each_law(prepared: Prepared, found: Confirmed, total: Array, unit: Array, seed: int) -> tuple[Shown, ...]:
    """Every law with what it takes away beside those that were found before it, all else refitted; total (starts, 3):
    squares of the refitted nominal model over the camera's variances `unit` (3,)."""
    shown = []
    for curve, before, after in zip(found.bending.curves, found.steps[:-1], found.steps[1:], strict=True):
        share, p_value = taken(before.error, after.error, total, unit, seed)
        law = as_law(curve, prepared.largest)
        density = tuple(map(int, curve.density))
        shown.append(Shown(curve.kind, law, density, share, p_value, form_of(law, density), curve.alike))
    return tuple(shown)


def _plain(model: Model) -> Model:
    """The model without its covariance, which costs a run for each of its directions."""
    return dataclasses.replace(model, covariance=None, parameter_order=())

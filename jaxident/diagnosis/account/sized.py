"""The corrected model with the noise law that the account takes for it, with discovered curves or without."""

import dataclasses

import numpy as np

from jaxident.diagnosis.account.models import Corrected, corrected_of
from jaxident.diagnosis.account.slip_check import slip_seen
from jaxident.diagnosis.causes.discrepancy import UNEXPLAINED
from jaxident.diagnosis.causes.finding import Finding
from jaxident.diagnosis.discovery.fit import Bending, as_law
from jaxident.diagnosis.motion.responses import respond
from jaxident.diagnosis.noise.law import Law, less_slip
from jaxident.diagnosis.noise.likelihood import Amounts, Sized, sample
from jaxident.diagnosis.noise.variance_uncertainty import Draws, draw_laws, sizes_by_memory
from jaxident.diagnosis.preparation.prepare import Prepared
from jaxident.diagnosis.preparation.translate import slopes_of
from jaxident.effects.coordinates import COORDINATES
from jaxident.effects.law_kinds import value_name, value_scale
from jaxident.robot.model import Model

REPLAYS = 500
"""Laws of noise, and robots, drawn as likely as the fit leaves them."""


def sized_corrected(
    prepared: Prepared, finding: Finding, direct: dict, seed: int, bending: Bending | None = None
) -> tuple[Corrected, Draws]:
    """The corrected model, and draws of noise laws as likely as its own, with no more slip than it leaves room for."""
    law, draws = _laws(finding, seed)
    corrected = with_curves(corrected_of(prepared, finding, law, direct), bending, prepared.largest)
    factor = slip_seen(corrected.model, prepared, law)
    if factor == 1.0:
        return corrected, draws
    law = less_slip(law, factor)
    return with_curves(corrected_of(prepared, finding, law, direct), bending, prepared.largest), draws.less_slip(factor)


def with_curves(corrected: Corrected, bending: Bending | None, largest: float) -> Corrected:
    """The corrected model with curves beside the laws that it has, and the covariance of its parameters and the curves'
    values."""
    if bending is None:
        return corrected
    kept = (*corrected.model.discovered, *(as_law(curve, largest) for curve in bending.curves))
    order, covariance = _covariance(bending, corrected.model, largest)
    model = dataclasses.replace(corrected.model, discovered=kept, parameter_order=order, covariance=covariance)
    return corrected._replace(model=model)


def _covariance(bending: Bending, model: Model, largest: float) -> tuple[tuple[str, ...], np.ndarray]:
    """Names and covariance of a model's parameters and its curves' values, in the user's units."""
    effects = [effect for effect in model.effects if effect.name in COORDINATES]
    names, slope = slopes_of(bending.fit, effects, largest)
    kinds = [curve.kind for curve in bending.curves for _ in curve.value]
    units = [value_scale(kind.acts_on, kind.times, largest) for kind in kinds]
    own, (rows, columns) = len(units), slope.shape
    whole = np.zeros((rows + own, columns + own))
    whole[:rows, :columns], whole[rows:, columns:] = slope, np.diag(units)
    first = len(model.discovered)
    values = [value_name(k, knot) for k, curve in enumerate(bending.curves, first) for knot in range(len(curve.value))]
    return (*names, *values), whole @ bending.covariance @ whole.T


def beside(finding: Finding, bending: Bending) -> Finding:
    """The finding as refitted with curves, its noise sized beside them."""
    return finding._replace(fit=bending.fit, law=bending.law, likely=bending.law)


def _laws(finding: Finding, seed: int) -> tuple[Law, Draws]:
    """The law that the floor takes, and draws of laws as likely. Slip's memory is sized finely, unless something
    is left unexplained, which slip would take up."""
    best, windows = finding.fit, finding.data.windows
    fitted = respond(np.exp(best.vector[:2]), best.linear.residual, windows)
    given = sample(best.linear.residual, best.linear.starts, windows, fitted)
    unknown = finding.unexplained > UNEXPLAINED
    sizes = [Sized(finding.law, 0.0, Amounts(()))] if unknown else sizes_by_memory(finding.likely, given)
    likeliest = max(sizes, key=lambda sized: sized.log_likelihood).law
    return likeliest, draw_laws(sizes, given, REPLAYS, seed)

"""Is slip as large as the noise law says? Held against what the corrected model misses by on the rows that fit.

A law is sized within windows. Where a robot slips otherwise than it says (a Husky's speed does not walk as far in a
second as its poses shake from frame to frame), it can foretell more at the horizon than there is at all. Noise never
leaves more than the whole error, so that slip is then taken back to it. Judging rows are not looked at.
"""

import dataclasses

import numpy as np

from jaxident.diagnosis.account.shrink import RESAMPLES, blocks
from jaxident.diagnosis.noise.law import Law, deviations
from jaxident.diagnosis.preparation.judging import judge_model, on_fitted, some_of
from jaxident.diagnosis.preparation.prepare import Prepared
from jaxident.robot.model import Model
from jaxident.robot.noise import Noise

SURE = 1.5
"""Standard errors of the mean square by which the law must foretell too much; chance alone does in one case of 15. At
1.5 as at 3, the floor's interval lies above the error on 1 of 38 simulated robots."""
FOR_PARAMETERS = 50
"""Starts that are predicted once for every parameter besides. No other number was tried."""
ROUNDS, NEAR = 6, 0.02
"""Steps in which slip is taken back, and the part of the error to which they go."""


def slip_seen(model: Model, prepared: Prepared, law: Law) -> float:
    """The part of the slip's variances that the errors of a model with this law leave room for: 1 unless they speak
    clearly against it."""
    if law.slip is None or not len(prepared.naming.row):
        return 1.0
    bare, unit = dataclasses.replace(model, covariance=None, parameter_order=()), deviations(law) ** 2
    fitted = on_fitted(prepared)
    judged = judge_model(bare, fitted)
    kept = np.isfinite(judged.error).all(axis=1)
    if not kept.any():
        return 1.0
    squares = np.mean(judged.error[kept] ** 2 / unit, axis=1)
    resampled = squares[blocks(np.random.default_rng(0), len(squares), RESAMPLES)].mean(axis=1)
    seen, foretold, doubt = float(np.mean(squares)), _foretold(judged, kept, unit), SURE * float(np.std(resampled))
    if foretold <= seen + doubt:
        return 1.0
    seen += _taken_by_fit(model, fitted, unit)
    if foretold <= seen + doubt:
        return 1.0
    factor = 1.0
    for _ in range(ROUNDS):
        factor *= max(seen - 1.0, NEAR) / max(foretold - 1.0, NEAR)
        foretold = _foretold(judge_model(with_slip(bare, factor), fitted), kept, unit)
        if abs(foretold / seen - 1.0) < NEAR:
            break
    return min(factor, 1.0)


def _taken_by_fit(model: Model, fitted: Prepared, unit) -> float:
    """What a fit to the same rows takes from their mean error over the camera's variances: as much as its parameters
    could move it by."""
    slopes = judge_model(model, fitted._replace(judging=some_of(fitted.judging, FOR_PARAMETERS))).slopes
    found = np.sum(slopes**2, axis=0) / unit
    return float(np.mean(found[np.isfinite(found).all(axis=1)])) if np.isfinite(found).all(axis=1).any() else 0.0


def _foretold(judged, kept, unit) -> float:
    """Mean expected squares over the camera's variances, by camera, start state and slip."""
    return 1.0 + float(np.mean(sum(judged.squares)[kept] / unit))


def with_slip(model: Model, factor: float) -> Model:
    """The model with that part of its slip's variances."""
    noise = model.noise or Noise()
    along, heading = (float(d) * factor**0.5 for d in (noise.slip_along, noise.slip_heading))
    return dataclasses.replace(model, noise=noise._replace(slip_along=along, slip_heading=heading))

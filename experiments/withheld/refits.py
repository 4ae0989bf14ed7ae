"""The simple way with nothing spared but calibration: every effect of the catalogue fitted in full, the best held-out
error wins."""

import numpy as np

from jaxident.diagnosis.causes.candidates import Candidate
from jaxident.diagnosis.causes.search import Data, refit
from jaxident.diagnosis.causes.sets import refit_each
from jaxident.diagnosis.extent.gap import early_inverse, last_errors
from jaxident.diagnosis.extent.measure import judging_windows, settled
from jaxident.effects.coordinates import COORDINATES
from jaxident.diagnosis.noise.law import first_law, white_whitener
from jaxident.diagnosis.prepare import BURN, prepare
from jaxident.log import Log


def refit_errors(runs: list[Log]) -> dict[str, float]:
    """Mean squared pose error over the camera's variance at the horizon, on runs that served no fit, of the nominal
    model ("") and of it with each effect of the catalogue that has coordinates; least squares, white camera noise."""
    prepared = prepare(runs, None)
    windows = prepared.windows
    law = first_law(windows)
    data = Data(windows, white_whitener(law, windows), prepared.naming)
    nominal = refit(data, prepared.nominal.vector, prepared.nominal.starts, ())
    found = {(): Candidate((), nominal, 0.0)}
    refit_each(found, data, nominal, list(COORDINATES), ())
    apart = judging_windows(prepared, len(windows.step))
    responses, _, starts = settled(nominal.vector, apart, law)
    vectors = np.stack([candidate.solution.vector for candidate in found.values()])
    lanes = np.tile(starts, (len(vectors), 1, 1))
    errors = last_errors(vectors, lanes, apart, law, early_inverse(law, apart, responses, BURN))
    means = np.mean(errors[:, np.asarray(apart.seen)[-1]] ** 2, axis=(1, 2))
    means = np.where(np.isfinite(means), means, np.inf)  # a model that ran away predicts nothing
    return {"".join(effects): float(mean) for effects, mean in zip(found, means, strict=True)}

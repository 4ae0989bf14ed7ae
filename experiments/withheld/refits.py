"""The simple way with nothing spared but calibration: every effect of the catalogue fitted in full, the best held-out
error wins."""

import numpy as np

from jaxident.diagnosis.account.judging import judge_model
from jaxident.diagnosis.causes.candidates import Candidate
from jaxident.diagnosis.causes.search import Data, refit
from jaxident.diagnosis.causes.sets import refit_each
from jaxident.diagnosis.noise.law import deviations, first_law, white_whitener
from jaxident.diagnosis.prepare import prepare
from jaxident.diagnosis.translate import to_model
from jaxident.effects.coordinates import COORDINATES
from jaxident.log import Log


def refit_errors(runs: list[Log]) -> dict[str, float]:
    """Mean squared pose error over the camera's variance at the horizon, on runs that served no fit, of the nominal
    model ("") and of it with each effect of the catalogue that has coordinates; least squares, white camera noise."""
    prepared = prepare(runs, None)
    windows = prepared.windows
    law = first_law(windows)
    data = Data(windows, white_whitener(law, windows))
    nominal = refit(data, prepared.nominal.vector, prepared.nominal.starts, ())
    found = {(): Candidate((), nominal, 0.0)}
    refit_each(found, data, nominal, list(COORDINATES), ())
    models = [to_model(prepared, c.solution.vector, law, effects) for effects, c in found.items()]
    means = [np.mean(judge_model(model, prepared).error ** 2 / deviations(law) ** 2) for model in models]
    means = np.where(np.isfinite(means), means, np.inf)  # a model that ran away predicts nothing
    return {"".join(effects): float(mean) for effects, mean in zip(found, means, strict=True)}

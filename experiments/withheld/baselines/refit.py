"""The simple way with nothing spared but calibration: every effect of the catalogue fitted in full, the best held-out
error wins."""

import numpy as np

from jaxident.diagnosis.causes.columns import tabulate
from jaxident.diagnosis.causes.evidence import log_evidence
from jaxident.diagnosis.causes.moves import fit_options, stands
from jaxident.diagnosis.fit.refit import Data, Solution, refit
from jaxident.diagnosis.noise.law import deviations, first_law, white_whitener
from jaxident.diagnosis.preparation.judging import judge_model
from jaxident.diagnosis.preparation.prepare import prepare
from jaxident.diagnosis.preparation.translate import to_model
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
    found = {"": nominal, **each_alone(data, nominal)}
    models = [to_model(prepared, fit.vector, law, (name,) if name else ()) for name, fit in found.items()]
    means = [np.mean(judge_model(model, prepared).error ** 2 / deviations(law) ** 2) for model in models]
    means = np.where(np.isfinite(means), means, np.inf)  # a model that ran away predicts nothing
    return {name: float(mean) for name, mean in zip(found, means, strict=True)}


def each_alone(data: Data, nominal: Solution) -> dict[str, Solution]:
    """The fit with each effect alone, from the point of its grid that promises most beside the nominal one."""
    table, now, found = tabulate(data, nominal, ()), stands(nominal, ()), {}
    for name in COORDINATES:
        options = [k for k, option in enumerate(table.options) if option.effect == name]
        move = fit_options(data, table, now, [max(options, key=lambda k: log_evidence(table, [k]))])
        if move is not None:
            found[name] = move.fit
    return found

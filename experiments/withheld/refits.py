"""The simple way with nothing spared but calibration: every effect of the catalogue fitted in full, the best held-out
error wins."""

import numpy as np

from jaxident.diagnosis.causes.candidates import Candidate
from jaxident.diagnosis.causes.search import Data, refit
from jaxident.diagnosis.causes.which import refit_each
from jaxident.diagnosis.extent.gap import last_errors, settle
from jaxident.diagnosis.extent.measure import judging_windows
from jaxident.diagnosis.motion.coordinates import COORDINATES
from jaxident.diagnosis.noise.law import first_law, white_whitener
from jaxident.diagnosis.prepare import BURN, first_starts, prepare
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
    inverse = white_whitener(law, apart) ** 2
    vectors = np.stack([candidate.solution.vector for candidate in found.values()])
    starts = settle(nominal.vector, first_starts(apart), apart, inverse)
    early = inverse[:, : 3 * BURN, : 3 * BURN]
    errors = last_errors(vectors, np.tile(starts, (len(vectors), 1, 1)), apart, law, early)
    means = np.nanmean(errors**2, axis=(1, 2))
    return {"".join(effects): float(mean) for effects, mean in zip(found, means, strict=True)}

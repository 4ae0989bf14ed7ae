"""Which of several ends of a search is taken, where a search was made from several beginnings.

Log evidence alone does not tell. A noise law with much slip, and terms that the corrected model lacks, may explain
poses as well as effects do. On a Husky's log two ends differed by 37 in 41000. The one with more evidence missed unseen
runs by 0.50 m within a second, the other by 0.15 m. So ends are asked what a user asks of the model: to foretell poses.
There the rows that fit only just told: by 1.0 or by 1.2 standard errors, as the runs that fit were chosen. On seven
other pairs of ends, three of them of Creates, evidence was not overruled.
"""

from collections.abc import Sequence

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.causes.search_rounds import Found
from jaxident.diagnosis.noise.law import first_law
from jaxident.diagnosis.preparation.judging import judge_model, on_fitted
from jaxident.diagnosis.preparation.prepare import Prepared
from jaxident.diagnosis.preparation.translate import to_model

CLEARLY = 1.0
"""Standard errors by which an end must foretell better than that with more evidence: chance alone does in one case of
six, where both foretell alike. No other value was tried."""


def best_end(prepared: Prepared, ends: Sequence[Found]) -> Found:
    """The end with the highest log evidence, or one that foretells better the rows that fit. Judging rows are not
    looked at. Where no row that fits can be foretold evidence decides alone."""
    first, *others = sorted(ends, key=lambda end: -end.log_evidence)
    if not others or not len(prepared.naming.row):
        return first
    fitted = on_fitted(prepared)
    best, squares = first, misses(fitted, first)
    for end in others:
        if foretells_better(own := misses(fitted, end), squares):
            best, squares = end, own
    return best


def misses(fitted: Prepared, end: Found) -> np.ndarray:
    """Mean squares (starts,) over the camera's variances of what an end's effects and likeliest noise law, all that the
    corrected model has, miss at the horizon; infinite where they foretell nothing finite."""
    now, camera = end.settled.now, first_law(fitted.windows)
    errors = judge_model(to_model(fitted, now.fit.vector, end.likely, now.effects, {}), fitted).error
    squares = np.mean((errors / [camera.position, camera.position, camera.heading]) ** 2, axis=1)
    return np.where(np.isfinite(squares), squares, np.inf)


def foretells_better(own: Array, other: Array) -> bool:
    """Whether one end, by its squares (starts,), runs away from fewer starts than another, or from as many and misses
    less from the others, the mean difference more than CLEARLY standard errors."""
    runaways = int(np.sum(np.isinf(own))), int(np.sum(np.isinf(other)))
    if runaways[0] != runaways[1]:
        return runaways[0] < runaways[1]
    both = np.isfinite(own) & np.isfinite(other)
    apart = own[both] - other[both]
    return len(apart) > 1 and bool(np.mean(apart) < -CLEARLY * np.std(apart, ddof=1) / np.sqrt(len(apart)))

"""Where a search stands under one noise law, and which law is the likeliest there."""

from typing import NamedTuple

import numpy as np

from jaxident.diagnosis.causes.columns import Answers, Table
from jaxident.diagnosis.causes.discrepancy import Rest, unexplained
from jaxident.diagnosis.causes.moves import Move
from jaxident.diagnosis.fit.refit import Data, Solution
from jaxident.diagnosis.motion.responses import Responses, respond
from jaxident.diagnosis.motion.rims import rims_of, sized_noise
from jaxident.diagnosis.motion.windows import Windows
from jaxident.diagnosis.noise.law import Law, variances_of, whitener_of
from jaxident.diagnosis.noise.sizing import size_noise

SAME = 0.2
"""Difference of the logarithms of variances below which two laws are one: a tenth of a deviation. No other value was
tried."""
LIKELY = 1.0
"""Gain for which slip enters the law that the gap is held against: a floor without slip that is as likely there as not
would be too low, and too sure."""


class Settled(NamedTuple):
    """Where a search stands under one noise law: the fit and its effects, the data, the table there, the log evidence,
    less that of the fit, of sets that were refitted, and the answers that the table is made from."""

    now: Move
    data: Data
    table: Table
    tried: dict[frozenset[str], float]
    answers: Answers | None = None


def noise_beside(data: Data, fit: Solution, law: Law, sized: bool = True, memory_too: bool = True) -> tuple[Law, Rest]:
    """The likeliest law at a fit, and what is in no catalogue with the law beside it."""
    responses = respond(np.exp(fit.vector[:2]), fit.linear.residual, data.windows)
    if sized:
        residual, starts = fit.linear.residual, fit.linear.starts
        law = size_noise(residual, starts, data.windows, responses, LIKELY, memory_too)
    rest = unexplained(data, fit, responses, law, sized, memory_too)
    if sized and data.rims is not None:
        rest = rest._replace(law=rest.law._replace(wheel=sized_noise(data.rims, fit.linear.rims, data.windows)))
    return law, rest


def same_law(one: Law, other: Law) -> bool:
    """Whether two laws have the same parts, about as large."""
    if (one.slip_time, one.coloured_time) != (other.slip_time, other.coloured_time):
        return False
    wheels = [(one.wheel**2, other.wheel**2)] if one.wheel and other.wheel else []
    pairs = [*zip(variances_of(one), variances_of(other), strict=True), *wheels]
    return all(abs(np.log(max(a, 1e-300) / max(b, 1e-300))) < SAME for a, b in pairs)


def whiten(solution: Solution, windows: Windows, law: Law) -> tuple[Data, Responses]:
    """The data under a law, slip linearised about a solution."""
    rates = np.exp(solution.vector[:2])
    responses = respond(rates, solution.linear.residual, windows)
    rims = rims_of(solution.linear.rims, rates, law.wheel, windows)
    return Data(windows, whitener_of(law, windows, responses), rims), responses

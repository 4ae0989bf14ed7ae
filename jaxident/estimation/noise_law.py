"""Which noise law the data ask for: white camera error where the residuals are white, else the likeliest law."""

import jax
import numpy as np

from jaxident.array_types import Array
from jaxident.errors import InputError
from jaxident.estimation.maximum_likelihood import Fit, begin, fit_from
from jaxident.estimation.parameters import Law, names
from jaxident.estimation.residual_tests import whiteness
from jaxident.estimation.runs import Runs

NOISE_LAWS = {
    "white": Law(),
    "ar1": Law(memory=True),
    "slip": Law(slip=True),
    "slip-ar1": Law(memory=True, slip=True),
}
"""White camera error; with a memory; white and random slip; both."""

ROUNDING = 1e-8
"""Camera errors [m], [rad] below this are none: what is left of data without noise is rounding, and never white."""
WHITE = 30.6
"""Largest sum of squared residual correlations, 15 of them, of white residuals: chi-squared, 1 in 100."""


def fit_law(runs: Runs, d_max: Array, noise_law: str, coupling: bool) -> tuple[Fit, Law]:
    """The fit under a named law, or under the one that "auto" finds, as NumPy arrays: what follows is small, and each
    operation on a JAX array would be compiled by itself.

    "auto" keeps white camera error if the residuals of that fit are white or rounding; otherwise it adds a memory or
    slip, and where that leaves them coloured too, both. Of what it has tried it takes the lowest Bayesian information
    criterion (Schwarz 1978).
    """
    if noise_law not in (*NOISE_LAWS, "auto"):
        raise InputError(f"noise law {noise_law!r}: choose from {', '.join((*NOISE_LAWS, 'auto'))}")
    beginning = begin(runs, d_max)
    tried: list[tuple[Fit, Law]] = []
    for laws in (("white",), ("ar1", "slip"), ("slip-ar1",)) if noise_law == "auto" else ((noise_law,),):
        for law in (NOISE_LAWS[name]._replace(coupling=coupling) for name in laws):
            tried.append((jax.device_get(fit_from(beginning, runs, d_max, law)), law))
        fit, law = min(tried, key=lambda pair: criterion(pair[0], pair[1], 3 * int(np.sum(runs.seen))))
        if bool(fit.ok) and colour(fit, runs) < WHITE:
            break
    return fit, law


def colour(fit: Fit, runs: Runs) -> float:
    """Sum of squared correlations of a fit's residuals, below WHITE where they are white; 0 where they are rounding."""
    if max(fit.robot.noise.position, fit.robot.noise.heading) < ROUNDING:
        return 0.0
    return float(np.sum(whiteness(np.asarray(fit.innovations.normalised), np.asarray(runs.seen))))


def criterion(fit: Fit, law: Law, count: int) -> float:
    """Bayesian information criterion of a fit to `count` numbers; infinite where the fit failed."""
    value = -2.0 * float(fit.log_likelihood) + len(names(law)) * np.log(count)
    return value if bool(fit.ok) and np.isfinite(value) else np.inf

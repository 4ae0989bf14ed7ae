"""Which noise law the data ask for: white camera error where the residuals are white, else the likeliest law."""

import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array
from jaxident.errors import InputError
from jaxident.estimation.poses.maximum_likelihood import Beginning, Fit, begin, numbers_in
from jaxident.estimation.poses.parameters import Law, names
from jaxident.estimation.poses.prior import RATE, SIGNS, Prior, coasting, middle_gain, prior_of
from jaxident.estimation.poses.residual_tests import whiteness
from jaxident.estimation.poses.runs import Runs
from jaxident.estimation.poses.stepwise import fit_stepwise

NOISE_LAWS = {
    "white": Law(),
    "ar1": Law(memory=True),
    "slip": Law(slip=True),
    "slip-ar1": Law(memory=True, slip=True),
}
"""White camera error; with a memory; white and random slip; both."""

ROUNDING = 1e-8
"""Camera errors [m], [rad] below this are none: what is left of data without noise is rounding, and never white."""
CLEAR = 3.0
"""Standard deviations from zero from which on a gain has a sign."""
AS_LIKELY = 1.0
"""Fall of log p by which a search that arrived may end below one that did not."""
WHITE = 30.6
"""Largest sum of squared residual correlations, 15 of them, of white residuals: chi-squared, 1 in 100."""


def fit_law(runs: Runs, d_max: Array, noise_law: str, coupling: bool) -> tuple[Fit, Law]:
    """The fit under a named law, or under the one that "auto" finds, as NumPy arrays: what follows is small, and each
    operation on a JAX array would be compiled by itself.

    "auto" keeps white camera error if the residuals of that fit are white or rounding; otherwise it adds a memory or
    slip, and where that leaves them coloured too, both. Of what it has tried it takes the lowest Bayesian information
    criterion (Schwarz 1978). A fit of a robot that coasts is made again; see `settling_fit`. Runs with wheel speeds are
    fitted to both sensors.
    """
    if noise_law not in (*NOISE_LAWS, "auto"):
        raise InputError(f"noise law {noise_law!r}: choose from {', '.join((*NOISE_LAWS, 'auto'))}")
    beginning, prior = begin(runs, d_max), prior_of(runs)
    terms = {"coupling": coupling, "wheels": runs.wheels is not None}
    tried: list[tuple[Fit, Law]] = []
    for kinds in (("white",), ("ar1", "slip"), ("slip-ar1",)) if noise_law == "auto" else ((noise_law,),):
        for law in (NOISE_LAWS[name]._replace(**terms) for name in kinds):
            fit, beginning = fit_twice(beginning, runs, d_max, law, prior)
            tried.append((fit, law))
        fit, law = likeliest(tried, runs)
        if bool(fit.ok) and colour(fit, runs) < WHITE:
            break
    both = NOISE_LAWS["slip-ar1"]._replace(**terms)
    laws = [law] if noise_law != "auto" or law == both else [law, both]
    return settling_fit(beginning, runs, d_max, laws, fit) or (fit, law)


def fit_twice(beginning: Beginning, runs: Runs, d_max: Array, law: Law, prior: Prior) -> tuple[Fit, Beginning]:
    """The fit from a beginning, and that beginning. Where the search does not arrive, one from the prior's middle takes
    its place if it is as likely; under slip one search is long enough."""
    fit = fit_stepwise(beginning, runs, d_max, law, prior)
    if bool(fit.ok) or law.slip:
        return fit, beginning
    nothing = beginning.estimate._replace(gain=middle_gain(prior), dead_zone=jnp.zeros(2))
    nothing = nothing._replace(rate=jnp.array([RATE, RATE]))  # of `jnp.full` the type is weak: one program more
    middle = beginning._replace(estimate=nothing)
    other = fit_stepwise(middle, runs, d_max, law, prior)
    least = float(fit.log_likelihood) - (AS_LIKELY if bool(other.ok) else 0.0)
    return (other, middle) if float(other.log_likelihood) >= least else (fit, beginning)


def settling_fit(beginning: Beginning, runs: Runs, d_max: Array, laws: list[Law], fit: Fit) -> tuple[Fit, Law] | None:
    """The likeliest fit under some laws, with its law, in which rates are held at the prior's middle where a fit has a
    robot that coasts; None where it does not coast, or no such fit arrives.

    A run's start speed is free. A robot that coasts keeps it, and so has a speed of its own for each run. Over many
    short runs that explains whatever the law has no noise for, by a few units of -log p a run: far more than a weak
    prior weighs. So a rate below any robot's counts only where the law is right and the commands move the robot.
    """
    held = coasts(fit, runs)
    if not np.any(held):
        return None
    estimate, prior = beginning.estimate, prior_of(runs)._replace(held=jnp.asarray(held))
    rate = jnp.where(held, RATE, jnp.asarray(fit.robot.drive.rate))
    estimate = estimate._replace(rate=rate, gain=jnp.asarray(middle_gain(prior)), dead_zone=jnp.zeros(2))
    begin = beginning._replace(estimate=estimate)
    tried = [(fit_stepwise(begin, runs, d_max, law, prior), law) for law in laws]
    found = likeliest(tried, runs)
    return found if bool(found[0].ok) else None


def coasts(fit: Fit, runs: Runs) -> np.ndarray:
    """Which of both speeds (2,) coast: at a rate below all but 2.5 % of robots', too slow to settle within the longest
    run, and either under residuals that are coloured or by gains whose signs are not clearly a differential drive's."""
    rate, gain = np.array(fit.robot.drive.rate, float), np.array(fit.robot.drive.gain, float)
    deviation = np.sqrt(np.diagonal(np.asarray(fit.covariance))[2:6]).reshape(2, 2)
    time = np.cumsum(np.broadcast_to(np.asarray(runs.step), runs.seen.shape), axis=1)
    longest = float(np.max(np.where(np.asarray(runs.seen), time, 0.0)))
    driven = np.all(np.array(SIGNS) * gain > CLEAR * deviation, axis=1)
    return coasting(rate, longest, driven, colour(fit, runs) >= WHITE)


def likeliest(tried: list[tuple[Fit, Law]], runs: Runs) -> tuple[Fit, Law]:
    """The fit and law of the lowest criterion."""
    return min(tried, key=lambda pair: criterion(pair[0], pair[1], int(numbers_in(runs, pair[1]))))


def colour(fit: Fit, runs: Runs) -> float:
    """Sum of squared correlations of a fit's residuals, below WHITE where they are white; 0 where they are rounding."""
    if max(fit.robot.noise.position, fit.robot.noise.heading) < ROUNDING:
        return 0.0
    return float(np.sum(whiteness(np.asarray(fit.innovations.normalised), np.asarray(runs.seen))))


def criterion(fit: Fit, law: Law, count: int) -> float:
    """Bayesian information criterion of a fit to `count` numbers; infinite where the fit failed."""
    value = -2.0 * float(fit.log_likelihood) + len(names(law)) * np.log(count)
    return value if bool(fit.ok) and np.isfinite(value) else np.inf

"""The paper's method on one log: start values from the setup time (section VI), then the recursion (15)-(18)."""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Increment, Wheels
from jaxident.estimation.increments import recursive
from jaxident.estimation.increments.initialise import Setup, initialise
from jaxident.estimation.increments.least_squares import full_covariance
from jaxident.estimation.increments.observations import observe_log, tail
from jaxident.log import Log
from jaxident.robot.model import difference_vector


class History(NamedTuple):
    """The recursion after each sample (samples,): parameters in DIFFERENCE_ORDER and their standard deviations, each
    (samples, 12), and what the sample taught."""

    parameters: Any
    standard_deviation: Any
    used: Any


@partial(jax.jit, static_argnames=("setup_rows", "reading"))
def identify_recursively(log: Log, setup_rows: int, d_max: Array, forgetting: Array, reading: str):
    """Section VI on the first rows, then the recursion over the rest: pure, for one log of arrays (samples,).

    Returns the last estimate, the setup, the history and residuals after the setup, and the covariance (12, 12).
    """
    observations = observe_log(log)
    early = jax.tree.map(lambda column: column[: setup_rows - 1], observations)
    setup = initialise(early, d_max=d_max, reading=reading)
    estimate = recursive.start(setup.difference, setup.dead_zone, early, d_max, forgetting)
    late = tail(observations, setup_rows - 1)
    estimate, (steps, info) = recursive.run(estimate, late)
    variance = _noise_variance(info, setup)
    parameters, deviations = jax.vmap(lambda one: _summary(one, variance))(steps)
    history = History(parameters, deviations, info.used)
    covariance = parameter_covariance(estimate, variance)
    residuals = Increment(*(jnp.where(info.used, e, jnp.nan) for e in info.error))
    return estimate, setup, history, residuals, covariance


def _noise_variance(info: recursive.Info, setup: Setup) -> Increment:
    """Variance of each equation's error, from the normalised prediction errors; the setup's where none followed."""
    used = jnp.sum(info.used)
    return Increment(
        *(
            jnp.where(used > 0, jnp.sum(jnp.where(info.used, e**2 / s, 0.0)) / jnp.maximum(used, 1), w**2)
            for e, s, w in zip(info.error, info.scale, setup.weight, strict=True)
        )
    )


def parameter_covariance(estimate: recursive.Estimate, variance: Increment) -> Array:
    """Covariance (12, 12) in DIFFERENCE_ORDER: that of both equations' unknowns, carried to first order.

    The dead zones enter as the unbounded average: at a bound the clipped one would claim to be certain.
    """

    def from_unknowns(unknowns):
        length, turn = (e._replace(unknowns=u) for e, u in zip((estimate.length, estimate.turn), unknowns, strict=True))
        moved = estimate._replace(length=length, turn=turn)
        ratios = recursive.dead_zone_ratios(moved)
        average = Wheels(*(0.5 * (first + second) for first, second in zip(*ratios, strict=True)))
        return difference_vector(*recursive.parameters(moved._replace(dead_zone=average)))

    unknowns = (estimate.length.unknowns, estimate.turn.unknowns)
    slopes = jax.jacfwd(from_unknowns)(unknowns)
    total = 0.0
    for slope, equation, v in zip(slopes, (estimate.length, estimate.turn), variance, strict=True):
        columns = jnp.stack(slope, axis=-1)
        total = total + v * columns @ full_covariance(equation) @ columns.T
    return total


def _summary(estimate: recursive.Estimate, variance: Increment) -> tuple[Array, Array]:
    return difference_vector(*recursive.parameters(estimate)), jnp.sqrt(
        jnp.maximum(jnp.diagonal(parameter_covariance(estimate, variance)), 0.0)
    )

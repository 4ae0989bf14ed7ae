"""The estimate of `maximum_likelihood` for one log that a user waits for: the same search, step by step from Python.

A program of a whole fit takes 5 to 10 s to compile, for each noise law. Here all laws share the programs of a step and
of the end. The likelihood has two, with slip and without. In both the camera's error has a memory; under a law without
one nothing of it is left at the next row.
"""

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array
from jaxident.estimation.poses.curvature import START_STATES, Local, Point, at_best_deviations, sums_at
from jaxident.estimation.poses.likelihood import Innovations
from jaxident.estimation.poses.maximum_likelihood import (
    MOST_STEPS,
    OF_RUNS,
    Beginning,
    Fit,
    first_point,
    fit_of,
)
from jaxident.estimation.poses.parameters import Law, Robot, names
from jaxident.estimation.poses.prior import Prior
from jaxident.estimation.poses.runs import Runs
from jaxident.estimation.poses.scoring import Damping, Search, advance, first_search, walking
from jaxident.estimation.poses.starter import Start
from jaxident.programs import kept_program
from jaxident.robot.drive import Physical
from jaxident.robot.noise import Noise
from jaxident.robot.wheel_sensor import WheelSensor

NOTHING = -100.0
"""Logarithm of a correlation time [s] that has passed before the next row, however soon that comes, and of a density of
slip that is none. Below -350 their squares would be 0, and derivatives no numbers."""


def fit_stepwise(beginning: Beginning, runs: Runs, d_max: Array, law: Law, prior: Prior) -> Fit:
    """What `fit_from` gives, as NumPy arrays."""
    wide = law._replace(memory=True, slip=True)
    kept = np.isin(names(wide), names(law))
    held, goes_on = jnp.asarray(~kept), True
    search = _begun(beginning, runs, wide, held)
    while goes_on:
        there, local, _ = _look_from(search.proposed, runs, wide, law.slip)
        search, goes_on = _step(search, there, local, d_max, wide, prior, held)
    *_, found = _look_from(search.point, runs, wide, law.slip)
    fit = jax.device_get(_ended(search, found, runs, wide, prior, held))
    noise = fit.robot.noise
    noise = noise._replace(
        correlation_time=noise.correlation_time if law.memory else None,
        slip_along=noise.slip_along if law.slip else 0.0,
        slip_heading=noise.slip_heading if law.slip else 0.0,
    )
    return fit._replace(
        robot=fit.robot._replace(noise=noise), covariance=fit.covariance[kept][:, kept],
        prior_share=fit.prior_share[kept],
    )  # fmt: skip


def _look_from(point: Point, runs: Runs, wide: Law, slip: bool) -> tuple[Point, Local, Innovations]:
    """What `_look` finds at a point of a wide law. Without slip it looks as a law without does, and all derivatives by
    the unknowns of slip are 0."""
    if slip:
        return _look(point, runs, wide)
    law, shared = wide._replace(slip=False), np.array(point.shared)
    own, size = np.flatnonzero(np.isin(names(wide), names(law))), len(shared)
    there, local, found = jax.device_get(_look(point._replace(shared=shared[own]), runs, law))
    shared[own] = there.shared
    gradient, curvature = np.zeros(size), np.zeros((size, size))
    between = np.zeros((len(there.starts), size, START_STATES))
    gradient[own], curvature[np.ix_(own, own)], between[:, own] = local.gradient.shared, local.shared, local.between
    local = local._replace(gradient=local.gradient._replace(shared=gradient), shared=curvature, between=between)
    return there._replace(shared=shared), local, found


@kept_program(Beginning, Start, *OF_RUNS, Search, Point, Local, Damping, static=("wide",))
def _begun(beginning: Beginning, runs: Runs, wide: Law, held: Array) -> Search:
    """A search from a beginning, `held` unknowns (unknowns,) at NOTHING."""
    point = first_point(beginning, runs, wide)
    return first_search(point._replace(shared=jnp.where(held, NOTHING, point.shared)), wide)


@kept_program(*OF_RUNS, Point, Local, Innovations, static=("law",))
def _look(point: Point, runs: Runs, law: Law) -> tuple[Point, Local, Innovations]:
    """The point with the deviations of white errors at their best, what the runs say there, and the innovations at the
    point as given."""
    sums = sums_at(point, runs, law)
    return *at_best_deviations(point, sums, law), sums.found


@kept_program(Search, Point, Local, Damping, Prior, static=("wide",))
def _step(
    search: Search, there: Point, local: Local, d_max: Array, wide: Law, prior: Prior, held: Array
) -> tuple[Search, Array]:
    """The search one step on, and whether it goes on."""
    search = advance(search, there, local, wide, d_max, prior, held)
    return search, walking(search, MOST_STEPS)


@kept_program(*OF_RUNS, Search, Point, Local, Damping, Innovations, Prior, Fit, Robot, Physical, Noise, WheelSensor,
              static=("wide",))  # fmt: skip
def _ended(search: Search, found: Innovations, runs: Runs, wide: Law, prior: Prior, held: Array) -> Fit:
    """The fit where a search has ended."""
    return fit_of(search, found, runs, wide, prior, held)

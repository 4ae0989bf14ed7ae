"""Maximum likelihood on camera poses: whole runs, several at once, under one of several noise laws."""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array
from jaxident.estimation.likelihood import Innovations, innovations
from jaxident.estimation.parameters import Law, Robot, from_vector, to_vector
from jaxident.estimation.runs import Runs, cut_windows, run_axes
from jaxident.estimation.scoring import Point, Search, covariance_at, search_from
from jaxident.estimation.starter import first_estimate, start_states
from jaxident.robot.drive import Physical
from jaxident.robot.noise import Noise

WINDOW = 200
"""Rows of the windows that the starter fits: long enough for a slow pole, too short for slip to pile up."""
MOST_STEPS = 60
WHITE = Law()


class Fit(NamedTuple):
    """A maximum-likelihood estimate.

    robot: drive, dead zones and noise law. starts (runs, 5): states x, y, theta, v, w at the first row of each run.
    covariance (unknowns, unknowns) in the order of `parameters.names(law)`, natural units. log_likelihood: of the
    measured poses. innovations (runs, 3, rows): normalised, and their log variances. ok: the search arrived, everything
    is finite, and there are more numbers than unknowns. steps: of the search.
    """

    robot: Robot
    starts: Any
    covariance: Any
    log_likelihood: Any
    innovations: Innovations
    ok: Any
    steps: Any


def start_point(runs: Runs, d_max: Array, law: Law, window: int = WINDOW) -> Point:
    """Where the search begins: the starter's estimate on windows of the runs, its residuals as camera noise."""
    windows = cut_windows(runs, min(window, runs.seen.shape[1]))
    start = first_estimate(windows, d_max)
    per_run = windows.seen.shape[0] // runs.seen.shape[0]
    states = start_states(start, windows)[::per_run]
    step = jnp.mean(runs.step)
    position, heading = jnp.maximum(start.residual, 1e-9)
    lag = 1.0 / step
    noise = Noise(position, heading, 2.0 * step, 0.1 * position * lag**1.5, 0.1 * heading * lag**1.5)
    coupling = jnp.zeros(2) if law.coupling else None
    return Point(to_vector(Robot(Physical(start.rate, start.gain, coupling), start.dead_zone, noise), law), states)


@partial(jax.jit, static_argnames=("law", "window"))
def fit_runs(runs: Runs, d_max: Array, law: Law = WHITE, window: int = WINDOW) -> Fit:
    """The estimate from runs (runs, rows) under a law, from the data alone; pure, maps over trials.

    d_max: largest dead zone [unit of the command]. A fit that fails comes back finite where it stopped, ok False.
    """
    return fit_from(start_point(runs, d_max, law, window), runs, d_max, law)


def fit_from(point: Point, runs: Runs, d_max: Array, law: Law) -> Fit:
    """The estimate by a search from a given point."""
    search = search_from(point, runs, law, d_max, MOST_STEPS)
    covariance = covariance_at(search.point, search.local, law)
    found = jax.vmap(lambda start, run: innovations(search.point.shared, start, run, law), in_axes=(0, run_axes(runs)))(
        search.point.starts, runs
    )
    return Fit(
        robot=from_vector(search.point.shared, law),
        starts=search.point.starts,
        covariance=covariance,
        log_likelihood=-search.local.value - 1.5 * jnp.sum(runs.seen) * jnp.log(2.0 * jnp.pi),
        innovations=found,
        ok=search.arrived & _regular(search, covariance, runs),
        steps=search.steps,
    )


def _regular(search: Search, covariance: Array, runs: Runs) -> Array:
    """Whether everything is finite and there are more numbers than unknowns."""
    finite = [jnp.all(jnp.isfinite(part)) for part in (*search.point, search.local.value, covariance)]
    unknowns = search.point.shared.size + search.point.starts.size
    return jnp.all(jnp.stack(finite)) & (3 * jnp.sum(runs.seen) > unknowns)

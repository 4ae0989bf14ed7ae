"""Maximum likelihood on camera poses: whole runs, several at once, under one of several noise laws and a weak prior."""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Pose, Wheels
from jaxident.estimation.poses.covariance import posterior_at
from jaxident.estimation.poses.curvature import Point, local_at
from jaxident.estimation.poses.likelihood import Innovations, innovations
from jaxident.estimation.poses.parameters import Law, Robot, from_vector, names, to_vector
from jaxident.estimation.poses.prior import Prior, prior_of
from jaxident.estimation.poses.runs import WINDOW, Runs, cut_windows, run_axes
from jaxident.estimation.poses.scoring import Search, search_from, with_prior
from jaxident.estimation.poses.starter import Start, channels, first_estimate, start_states
from jaxident.estimation.poses.wheel_likelihood import first_sensor
from jaxident.numerics import in_blocks
from jaxident.programs import kept_program
from jaxident.robot.drive import Physical
from jaxident.robot.noise import Noise
from jaxident.robot.wheel_sensor import WheelSensor

MOST_STEPS = 100
BLOCK = 4
"""Trials of a batch whose starters run at once: the paths of more leave the second-level cache."""
WHITE = Law()
OF_RUNS = Runs, Wheels, Pose


class Fit(NamedTuple):
    """A maximum-likelihood estimate.

    robot: drive, dead zones and noise law. starts (runs, 5): states x, y, theta, v, w at the first row of each run.
    covariance (unknowns, unknowns) in the order of `parameters.names(law)`, natural units, from poses and prior.
    log_likelihood: of the measured poses. innovations (runs, 3, rows): normalised, and their log variances. ok: the
    search arrived, everything is finite, and there are more numbers than unknowns. steps: of the search. prior: the one
    used; prior_share (unknowns,): how much of each variance is the prior's.
    """

    robot: Robot
    starts: Any
    covariance: Any
    log_likelihood: Any
    innovations: Innovations
    ok: Any
    steps: Any
    prior: Any = None
    prior_share: Any = None


class Beginning(NamedTuple):
    """Where searches begin, whatever the law: the starter's estimate, and states (runs, 5) at each run's first row."""

    estimate: Start
    starts: Any


@kept_program(Beginning, Start, *OF_RUNS)
def begin(runs: Runs, d_max: Array) -> Beginning:
    """The starter's estimate on windows of the runs (runs, rows)."""
    return in_blocks(_begin, BLOCK)(runs, jnp.asarray(d_max))


def _begin(runs: Runs, d_max: Array) -> Beginning:
    windows = cut_windows(runs, min(WINDOW, runs.seen.shape[1]))
    pair = channels(windows)
    estimate = first_estimate(pair, windows, d_max)
    per_run = windows.seen.shape[0] // runs.seen.shape[0]
    return Beginning(estimate, start_states(estimate, pair, windows)[::per_run])


def first_point(beginning: Beginning, runs: Runs, law: Law) -> Point:
    """The point of a beginning under a law: residuals as camera noise, a memory of two steps [s], slip that adds a
    tenth of the residual per step, wheels as their speeds tell beside that robot's."""
    estimate, starts = beginning
    position, heading = jnp.maximum(estimate.residual, 1e-9)
    slip = 0.1 / jnp.mean(runs.step) ** 1.5
    noise = Noise(position, heading, 2.0 * jnp.mean(runs.step), slip * position, slip * heading)
    drive = Physical(estimate.rate, estimate.gain, jnp.zeros(2) if law.coupling else None)
    robot = Robot(drive, estimate.dead_zone, noise)
    if law.wheels:
        robot = robot._replace(wheels=first_sensor(robot, starts, runs))
    return Point(to_vector(robot, law), starts)


def fit_runs(runs: Runs, d_max: Array, law: Law = WHITE, prior: Prior | None = None) -> Fit:
    """The estimate from runs (runs, rows) under a law and a prior, by default the weak one; pure, maps over trials.

    d_max: largest dead zone [unit of the command]. A fit that fails comes back finite where it stopped, ok False.
    """
    return fit_from(begin(runs, d_max), runs, d_max, law, prior_of(runs) if prior is None else prior)


@kept_program(Beginning, Start, *OF_RUNS, Prior, Fit, Robot, Physical, Noise, WheelSensor, Innovations, static=("law",))
def fit_from(beginning: Beginning, runs: Runs, d_max: Array, law: Law, prior: Prior) -> Fit:
    """The estimate by a search from a given beginning."""
    search = search_from(first_point(beginning, runs, law), runs, law, d_max, MOST_STEPS, prior)
    found = jax.vmap(lambda start, run: innovations(search.point.shared, start, run, law), in_axes=(0, run_axes(runs)))(
        search.point.starts, runs
    )
    return fit_of(search, found, runs, law, prior, jnp.zeros(len(names(law)), bool))


def fit_of(search: Search, found: Innovations, runs: Runs, law: Law, prior: Prior, held: Array) -> Fit:
    """The estimate where a search has ended with some innovations. The curvature of `held` unknowns (unknowns,), of
    which the runs say nothing, is taken for 1."""
    known = search.local._replace(shared=search.local.shared + jnp.diag(jnp.where(held, 1.0, 0.0)))
    covariance, share = posterior_at(search.point, known, law, prior)
    value = with_prior(search.local, search.point.shared, law, prior, -1.0).value
    return Fit(
        robot=from_vector(search.point.shared, law),
        starts=search.point.starts,
        covariance=covariance,
        log_likelihood=-value - 0.5 * numbers_in(runs, law) * jnp.log(2.0 * jnp.pi),
        innovations=found,
        ok=search.arrived & _regular(search, covariance, runs, held),
        steps=search.steps,
        prior=prior,
        prior_share=share,
    )


@partial(jax.jit, static_argnames=("law",))
def uncertain_as_by(fit: Fit, runs: Runs, law: Law) -> Fit:
    """The fit where it is, with the covariance and the prior's share that some runs (runs, rows) by themselves give."""
    point = Point(to_vector(fit.robot, law), fit.starts)
    local = with_prior(local_at(point, runs, law), point.shared, law, fit.prior)
    covariance, share = posterior_at(point, local, law, fit.prior)
    return fit._replace(covariance=covariance, prior_share=share)


def _regular(search: Search, covariance: Array, runs: Runs, held: Array) -> Array:
    """Whether everything is finite and there are more numbers than unknowns that are not held (unknowns,)."""
    finite = [jnp.all(jnp.isfinite(part)) for part in (*search.point, search.local.value, covariance)]
    with_a_pose = jnp.sum(jnp.any(runs.seen, axis=1))
    unknowns = jnp.sum(~held) + search.point.starts.shape[1] * with_a_pose
    return jnp.all(jnp.stack(finite)) & (3 * jnp.sum(runs.seen) > unknowns)


def numbers_in(runs: Runs, law: Law) -> Array:
    """How many measured numbers a law explains: three of each pose, and with wheels each wheel speed."""
    poses = 3 * jnp.sum(runs.seen)
    return poses + jnp.sum(jnp.stack(runs.turning)) if law.wheels else poses

"""How likely measured poses are, sample by sample: prediction errors with unit variance where the model is right.

-log p = sum over measured poses of (z^2 + log s) / 2 + constant, z = innovation / sqrt(s), s its variance. Without
slip the states follow from the start state alone; the innovation of white camera error is then the pose error, and
that of AR(1) error is e_k - rho e_j, rho = exp(-(t_k - t_j) / tau), s = sd^2 (1 - rho^2), j the last pose seen before.
Measured wheel speeds add terms of the same form (`wheel_likelihood`).
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Pose, State, StateVector, Unknowns, Wheels
from jaxident.estimation.poses.filter import filter_run
from jaxident.estimation.poses.parameters import Law, from_vector
from jaxident.estimation.poses.runs import Runs, row_times
from jaxident.estimation.poses.wheel_likelihood import wheel_residuals
from jaxident.numerics import wrap
from jaxident.robot.dead_zone import effective_command
from jaxident.robot.drive import force, hold
from jaxident.robot.simulate import run_forces


class Innovations(NamedTuple):
    """Normalised innovations and logarithms of their variances, each (3, rows) for x, y, theta; 0 where unseen.
    turning, turning_log_variance (2, rows): the same of both wheels' speeds, None without them."""

    normalised: Any
    log_variance: Any
    turning: Any = None
    turning_log_variance: Any = None


def innovations(vector: Unknowns, start: StateVector, run: Runs, law: Law) -> Innovations:
    """Innovations of one run (rows,) from its start state (5,) = x, y, theta, v, w at the first row."""
    robot = from_vector(vector, law)
    pull = force(robot.drive, effective_command(Wheels(*run.command), robot.dead_zone))
    solution = hold(robot.drive, run.step if jnp.ndim(run.step) == 0 else run.step[:-1])
    turning = wheel_residuals(robot, run_forces(solution, pull, State(*start)), run) if law.wheels else (None, None)
    if law.slip:
        return Innovations(*filter_run(solution, pull, State(*start), robot.noise, run), *turning)
    pose = run_forces(solution, pull, State(*start)).pose
    error = pose_error(run.pose, pose)
    sd = jnp.stack([robot.noise.position, robot.noise.position, robot.noise.heading])[:, None]
    log_variance = 2.0 * jnp.log(sd) + jnp.zeros_like(error)
    if law.memory:
        last, memory = _memory(run, robot.noise.correlation_time)
        fresh = 1.0 - memory**2
        error = (error - memory * error[:, last]) / jnp.sqrt(fresh)
        log_variance = log_variance + jnp.log(fresh)
    return Innovations(*(jnp.where(run.seen, value, 0.0) for value in (error / sd, log_variance)), *turning)


def pose_error(measured: Pose, pose: Pose) -> Array:
    """Measured minus modelled pose (3, ...) [m, m, rad], the heading wrapped."""
    return jnp.stack([measured.x - pose.x, measured.y - pose.y, wrap(measured.theta - pose.theta)])


def negative_log_likelihood(found: Innovations) -> Array:
    """-log p of the measured poses without its constant 3 n log(2 pi) / 2."""
    return 0.5 * jnp.sum(found.normalised**2 + found.log_variance)


def _memory(run: Runs, correlation_time: Array) -> tuple[Array, Array]:
    """For each row (rows,) the last row seen before it and how much of its camera error is left; 0 for the first."""
    rows = jnp.arange(run.seen.shape[0])
    last = jax.lax.cummax(jnp.where(run.seen, rows, -1))
    last = jnp.concatenate([jnp.full(1, -1), last[:-1]])
    time = row_times(run)
    since = time - time[jnp.maximum(last, 0)]
    usable = (last >= 0) & run.seen
    left = jnp.where(usable, jnp.exp(-jnp.where(usable, since, 1.0) / correlation_time), 0.0)
    return jnp.maximum(last, 0), left

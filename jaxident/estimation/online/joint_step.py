"""State and parameters carried together over one step: the prediction of the joint extended Kalman filter."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax.scipy.stats import norm

from jaxident.array_types import Array, PerWheel, PoseVector, State, Wheels
from jaxident.estimation.poses.filter import Belief, advance_with_slopes, dense
from jaxident.numerics import wrap
from jaxident.robot.drive import Force, Physical, hold
from jaxident.robot.noise import Noise

PARAMETERS = 8
"""The belief ends with two log rates, four gains and two dead zones, as `parameters.to_vector` orders them."""
SENSOR_AT = slice(-PARAMETERS - 2, -PARAMETERS)
"""Where the logarithms of radius and track stand in a belief with wheel speeds."""
SMALLEST_WIDTH = 1e-9


class Drift(NamedTuple):
    """How parameters may change: a memory [s], and variances (PARAMETERS,) that they never exceed."""

    memory: Any
    widest: Any


def advance_belief(
    belief: Belief, command: PerWheel, step: Array, noise: Noise, coupling: Any, drift: Drift | None
) -> Belief:
    """The belief one step [s] later under a held command (2,); `coupling` (2,) is known, or None.

    The parameters stay and become less certain: their covariance grows by exp(step / memory), up to the widest. With
    drift None it does not grow, and dead zones are taken at their mean width: the mean is then that of a free run.
    """
    mean, covariance = belief
    unknowns = mean[-PARAMETERS:]
    gain = unknowns[2:6].reshape(2, 2)
    width_deviation = jnp.sqrt(jnp.maximum(jnp.diagonal(covariance)[-2:], 0.0))
    passed, by_width = expected_output(command, unknowns[6:], 0.0 if drift is None else width_deviation)
    pull = jnp.sum(gain * passed, axis=1)

    def moved(log_rate):
        solution = hold(Physical(jnp.exp(log_rate), gain, coupling), step)
        after, slopes = advance_with_slopes(State(*mean[:5]), Force(*pull), solution)
        state = jnp.stack(after)
        return state, (state, dense(slopes.by_state), dense(slopes.by_pull))

    by_rate, (state, by_state, by_pull) = jax.jacfwd(moved, has_aux=True)(unknowns[:2])
    by_gain = (by_pull[:, :, None] * passed).reshape(5, 4)
    by_unknowns = jnp.concatenate([by_rate, by_gain, (by_pull @ gain) * by_width], axis=1)
    transition = jnp.eye(len(mean)).at[:5, :5].set(by_state).at[:5, -PARAMETERS:].set(by_unknowns)
    entry = by_pull * (jnp.stack([noise.slip_along, noise.slip_heading]) / jnp.sqrt(step))
    mean = mean.at[:5].set(state)
    fresh = jnp.zeros(len(mean))
    if noise.correlation_time is not None:
        left, errors = jnp.exp(-step / noise.correlation_time), jnp.arange(5, 8)
        transition = transition.at[errors, errors].set(left)
        camera = jnp.stack([noise.position, noise.position, noise.heading]) ** 2
        mean, fresh = mean.at[5:8].multiply(left), fresh.at[5:8].set((1.0 - left**2) * camera)
    covariance = transition @ covariance @ transition.T + jnp.diag(fresh)
    covariance = covariance.at[:5, :5].add(entry @ entry.T)
    return Belief(mean, covariance if drift is None else _forget(covariance, step, drift))


def expected_output(command: PerWheel, width: PerWheel, deviation: PerWheel) -> tuple[PerWheel, PerWheel]:
    """Mean output of dead zones of Gaussian width, and its mean slope by the width; all (2,).

    For u > 0 and z = (u - D) / s: s (z Phi(z) + phi(z)) and -Phi(z), odd in u. An uncertain edge near a level has
    neither a slope of -1 nor of 0: a linearisation at the mean width would bias every step there.
    """
    deviation = jnp.maximum(deviation, SMALLEST_WIDTH)
    clear = (jnp.abs(command) - width) / deviation
    share = norm.cdf(clear)
    side = jnp.sign(command)
    return side * deviation * (clear * share + norm.pdf(clear)), -side * share


def take_in_pose(
    belief: Belief, pose: PoseVector, seen: Array, noise: Noise, limit: float
) -> tuple[Belief, PoseVector]:
    """The belief after a pose (3,), and its innovations (3,) over their standard deviations; 0 where unseen. Beyond
    `limit` deviations an innovation counts no more than one of that size (Huber 1964).

    The rule is that of `filter.take_in`, which goes entry by entry; here one belief has up to 18 states."""
    mean, covariance = belief
    memory = noise.correlation_time is not None
    normalised = []
    for k, sd in enumerate((noise.position, noise.position, noise.heading)):
        shared = covariance[:, k] + covariance[:, 5 + k] if memory else covariance[:, k]
        variance = shared[k] + shared[5 + k] if memory else shared[k] + sd**2
        error = pose[k] - (mean[k] + mean[5 + k] if memory else mean[k])
        error = wrap(error) if k == 2 else error
        gain, size = jnp.where(seen, shared / variance, 0.0), jnp.sqrt(variance)
        mean = mean + gain * jnp.clip(error, -limit * size, limit * size)
        covariance = covariance - gain[:, None] * shared
        normalised.append(jnp.where(seen, error / size, 0.0))
    return Belief(mean, covariance), jnp.stack(normalised)


def take_in_wheels(
    belief: Belief, wheel_noise: Array, noise: Noise, speeds: Wheels, held: Array, later: Array, limit: float
) -> Belief:
    """The belief after both wheel speeds of a row `held` [s] after the last, each alone where the other is missing
    (NaN); `later`: whether it counts. Beyond `limit` deviations an innovation counts no more than one of that size.

    Random slip comes after the wheel: it moves the robot's speeds away from the drive's, which the wheels show, by
    density^2 / (2 rate) in the long run, and for a time of 1 / rate. That counts as noise of the wheels, as large as
    makes so many rows say as much as one: density^2 / (rate^2 held).
    """
    mean, covariance = belief
    rates = jnp.exp(mean[-PARAMETERS : 2 - PARAMETERS])
    slips = jnp.stack([noise.slip_along, noise.slip_heading]) ** 2 / (2.0 * rates)
    slips = slips * jnp.maximum(2.0 / (rates * held), 1.0)
    for side, speed in ((1.0, speeds.right), (-1.0, speeds.left)):
        radius, track = jnp.exp(mean[SENSOR_AT])
        across = side * 0.5 * track / radius
        expected = mean[3] / radius + across * mean[4]
        weights = jnp.stack([1.0 / radius, across])
        row = jnp.zeros_like(mean).at[3:5].set(weights).at[SENSOR_AT].set(jnp.stack([-expected, across * mean[4]]))
        seen = jnp.isfinite(speed) & later
        shared = covariance @ row
        variance = row @ shared + wheel_noise**2 + jnp.sum(weights**2 * slips)
        size = jnp.sqrt(variance)
        error = jnp.clip(jnp.where(seen, speed, 0.0) - expected, -limit * size, limit * size)
        gain = jnp.where(seen, shared / variance, 0.0)
        mean, covariance = mean + gain * error, covariance - gain[:, None] * shared
    return Belief(mean, covariance)


def _forget(covariance: Array, step: Array, drift: Drift) -> Array:
    """The covariance with that of the parameters grown by the memory, no variance beyond the widest."""
    own = covariance[-PARAMETERS:, -PARAMETERS:]
    growth = jnp.expm1(step / drift.memory)
    variance = jnp.diagonal(own)
    room = jnp.clip(drift.widest - variance, 0.0, growth * variance)
    scale = jnp.sqrt(room / jnp.maximum(variance, 1e-300))
    return covariance.at[-PARAMETERS:, -PARAMETERS:].add(own * scale * scale[:, None])

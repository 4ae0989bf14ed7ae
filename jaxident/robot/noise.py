"""What is random: slip of the wheels and error of the camera, drawn once as unit noise and scaled afterwards.

Drawing unit noise apart from its scale gives every noise level and every estimator the same random numbers, which
sharpens comparisons and saves most of the cost.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Pose
from jaxident.robot.drive import Force


class Noise(NamedTuple):
    """The noise law.

    position [m], heading [rad]: standard deviation of the camera's error. correlation_time [s]: that of the camera
    error, a first-order autoregression exp(-t / tau); None for white error. slip_along [m/s^1.5], slip_heading
    [rad/s^1.5]: root spectral density of a random acceleration, drawn for each step and held over it.
    """

    position: Any = 0.0
    heading: Any = 0.0
    correlation_time: Any = None
    slip_along: Any = 0.0
    slip_heading: Any = 0.0


class UnitNoise(NamedTuple):
    """Independent standard normal draws, each (samples,): camera error in x, y, heading; slip along, in heading."""

    x: Any
    y: Any
    theta: Any
    along: Any
    heading: Any


def draw_noise(key: Array, samples: int) -> UnitNoise:
    """Unit noise for a run; the same key gives the same draws at every noise level.

    Hot: drawn in single precision, which takes half the time and cuts a draw at 1e-7 of a standard deviation; one run
    (samples,) from one key, so that a run's noise does not depend on which others are drawn beside it.
    """
    draws = (jax.random.normal(k, (samples,), jnp.float32) for k in jax.random.split(key, 5))
    return UnitNoise(*(draw.astype(float) for draw in draws))


def slip(noise: Noise, unit: UnitNoise, step: Array) -> Force:
    """Random acceleration per step: root density over the root of the step [s], so that its sum does not depend
    on how time is cut."""
    scale = 1.0 / jnp.sqrt(step)
    return Force(noise.slip_along * scale * unit.along, noise.slip_heading * scale * unit.heading)


def observe(pose: Pose, noise: Noise, unit: UnitNoise, step: Array) -> Pose:
    """What the camera reports of poses (samples,); step [s] scalar, or (samples - 1,) between the rows."""
    error = Pose(unit.x, unit.y, unit.theta)
    if noise.correlation_time is not None:
        error = Pose(*(correlated(draw, step, noise.correlation_time) for draw in error))
    return Pose(
        pose.x + noise.position * error.x,
        pose.y + noise.position * error.y,
        pose.theta + noise.heading * error.theta,
    )


def correlated(unit: Array, step: Array, time: Array) -> Array:
    """Stationary first-order autoregression of unit variance from unit noise (samples,), its correlation time in
    seconds; step [s] scalar, or (samples - 1,) between the rows."""
    memory = jnp.exp(-jnp.broadcast_to(step, (len(unit) - 1,)) / time)

    def advance(last, now):
        correlation, draw = now
        value = correlation * last + jnp.sqrt(1.0 - correlation**2) * draw
        return value, value

    _, rest = jax.lax.scan(advance, unit[0], (memory, unit[1:]))
    return jnp.concatenate([unit[:1], rest])

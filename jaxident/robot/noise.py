"""What is random: slip of the wheels and error of the camera, drawn once as unit noise and scaled afterwards.

Drawing unit noise apart from its scale gives every noise level and every estimator the same random numbers, which
sharpens comparisons and saves most of the cost.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Pose, Samples
from jaxident.robot.drive import Force


class Noise(NamedTuple):
    """The noise law: error of the camera, and random slip of the wheels.

    Slip is a random acceleration, drawn for each step and held over it. A memory is a first-order autoregression,
    exp(-t / tau).

    Attributes:
        position: standard deviation of the camera's error in x and in y [m].
        heading: that in heading [rad].
        correlation_time: memory of the camera's error [s], None for white error.
        slip_along: root spectral density of the acceleration along the heading [m/s^1.5].
        slip_heading: that of the turn's acceleration [rad/s^1.5].
        slip_time: memory of the acceleration [s], which keeps its density at low frequency; None for one that is white.
        white_position: part of the camera's error that has no memory where the rest has one [m], None for none.
        white_heading: the same in heading [rad].
    """

    position: Any = 0.0
    heading: Any = 0.0
    correlation_time: Any = None
    slip_along: Any = 0.0
    slip_heading: Any = 0.0
    slip_time: Any = None
    white_position: Any = None
    white_heading: Any = None


WHITE = 2
"""What a run's key is folded with for draws of its white camera error beside one with a memory."""


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
    """Random acceleration per step [s], scalar or (samples,): root density over the root of the step, so that its sum
    does not depend on how time is cut; with a memory, an autoregression of that density at low frequency."""
    if noise.slip_time is None:
        scale = 1.0 / jnp.sqrt(step)
        return Force(noise.slip_along * scale * unit.along, noise.slip_heading * scale * unit.heading)
    scale, between = 1.0 / jnp.sqrt(2.0 * noise.slip_time), step if jnp.ndim(step) == 0 else step[:-1]
    along, heading = (correlated(draw, between, noise.slip_time) for draw in (unit.along, unit.heading))
    return Force(noise.slip_along * scale * along, noise.slip_heading * scale * heading)


def observe(pose: Pose, noise: Noise, unit: UnitNoise, step: Array, white: UnitNoise | None = None) -> Pose:
    """What the camera reports of poses (samples,); step [s] scalar, or (samples - 1,) between the rows. white: draws of
    the part without memory where the law has one beside a part with (`draw_white`)."""
    error = Pose(unit.x, unit.y, unit.theta)
    sizes = Pose(noise.position, noise.position, noise.heading)
    if noise.correlation_time is not None:
        error = Pose(*(correlated(draw, step, noise.correlation_time) for draw in error))
    if white is None:
        return Pose(*(p + s * e for p, s, e in zip(pose, sizes, error, strict=True)))
    own = Pose(noise.white_position, noise.white_position, noise.white_heading)
    parts = zip(pose, sizes, own, error, (white.x, white.y, white.theta), strict=True)
    return Pose(*(p + jnp.sqrt(s**2 - w**2) * e + w * d for p, s, w, e, d in parts))


def draw_white(noise: Noise, key: Array, samples: int) -> UnitNoise | None:
    """Draws of the part of the camera's error that has no memory where another part has one; None without."""
    if noise.correlation_time is None or noise.white_position is None:
        return None
    return draw_noise(jax.random.fold_in(key, WHITE), samples)


def correlated(unit: Samples, step: Array, time: Array) -> Samples:
    """Stationary first-order autoregression of unit variance from unit noise (samples,), its correlation time in
    seconds; step [s] scalar, or (samples - 1,) between the rows."""
    memory = jnp.exp(-jnp.broadcast_to(step, (len(unit) - 1,)) / time)

    def advance(last, now):
        correlation, draw = now
        value = correlation * last + jnp.sqrt(1.0 - correlation**2) * draw
        return value, value

    _, rest = jax.lax.scan(advance, unit[0], (memory, unit[1:]))
    return jnp.concatenate([unit[:1], rest])

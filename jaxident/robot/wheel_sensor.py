"""The wheel speeds that a robot measures itself: its second sensor, beside the camera.

The rim of a wheel runs at the speed that the motors give it: v + w track / 2 on the right, v - w track / 2 on the left,
with v and w as the drive alone makes them. Random slip comes after the wheel: it moves the robot, not the wheel.
"""

from typing import Any, NamedTuple

import jax

from jaxident.array_types import Array, Wheels

WHEELS_KEY = 7
"""What a run's key is folded with for draws of the wheel speeds' noise."""


class WheelSensor(NamedTuple):
    """radius [m] of the wheels; track [m], the distance between them by which turns show: on a robot that slides in
    turns the effective one, wider than the built one; noise [rad/s]: standard deviation of a measured speed, white."""

    radius: Any
    track: Any
    noise: Any = 0.0


def wheel_rates(sensor: WheelSensor, v: Array, w: Array) -> Wheels:
    """How fast both wheels turn [rad/s] at a speed v [m/s] and a turn rate w [rad/s] of the drive:

    (v +- w track / 2) / radius; same shape as v."""
    across = 0.5 * w * sensor.track
    return Wheels((v + across) / sensor.radius, (v - across) / sensor.radius)


def measure_wheels(sensor: WheelSensor, v: Array, w: Array, key: Array | None = None) -> Wheels:
    """What the sensor reports (samples,) [rad/s]; without a key it makes no error."""
    true = wheel_rates(sensor, v, w)
    if key is None:
        return true
    keys = jax.random.split(jax.random.fold_in(key, WHEELS_KEY))
    return Wheels(*(rate + sensor.noise * jax.random.normal(k, rate.shape) for rate, k in zip(true, keys, strict=True)))

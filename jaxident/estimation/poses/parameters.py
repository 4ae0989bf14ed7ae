"""The unknowns of the likelihood as one vector, and the noise law that says which of them there are."""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Unknowns
from jaxident.robot.drive import Physical
from jaxident.robot.noise import Noise
from jaxident.robot.wheel_sensor import WheelSensor


class Law(NamedTuple):
    """Which terms the model has: coupling of the two speeds, camera error with a memory (AR(1)), random slip, and wheel
    speeds as a second sensor."""

    coupling: bool = False
    memory: bool = False
    slip: bool = False
    wheels: bool = False


class Robot(NamedTuple):
    """What a vector of unknowns stands for: drive, dead zones (2,), noise law, and the sensor of wheel speeds."""

    drive: Physical
    dead_zone: Any
    noise: Noise
    wheels: Any = None


NAMES = (
    "rate_1", "rate_2", "gain_11", "gain_12", "gain_21", "gain_22", "dead_zone_r", "dead_zone_l",
    "coupling_1", "coupling_2", "position", "heading", "correlation_time", "slip_along", "slip_heading",
    "wheel_radius", "wheel_track", "wheel_noise",
)  # fmt: skip
"""All unknowns in the order of the vector; a law keeps some of them."""

_LOGARITHMIC = ("rate_1", "rate_2", *NAMES[10:])
LOWEST = {"rate": 1e-4, "position": 1e-9, "heading": 1e-9, "correlation_time": 1e-4, "slip_along": 1e-7,
           "slip_heading": 1e-7, "wheel_radius": 1e-5, "wheel_track": 1e-4, "wheel_noise": 1e-9}  # fmt: skip
HIGHEST = {"rate": 1e3, "position": 1e3, "heading": 1e2, "correlation_time": 1e3, "slip_along": 1e3,
            "slip_heading": 1e3, "wheel_radius": 1e3, "wheel_track": 1e3, "wheel_noise": 1e5}  # fmt: skip
"""Between what a search may visit, by name or what is before its number: 1/s, m, rad, s, m/s^0.5, rad/s^0.5,
m, m, rad/s."""


def names(law: Law) -> tuple[str, ...]:
    """The unknowns that a law has, in the order of its vector."""
    left_out = (
        (() if law.coupling else ("coupling_1", "coupling_2"))
        + (() if law.memory else ("correlation_time",))
        + (() if law.slip else ("slip_along", "slip_heading"))
        + (() if law.wheels else ("wheel_radius", "wheel_track", "wheel_noise"))
    )
    return tuple(name for name in NAMES if name not in left_out)


def is_logarithmic(law: Law) -> Array:
    """Boolean (unknowns,): which unknowns stand in the vector as their logarithm."""
    return jnp.array([name in _LOGARITHMIC for name in names(law)])


@partial(jax.jit, static_argnames="law")
def to_vector(robot: Robot, law: Law) -> Unknowns:
    """The vector (unknowns,) of a robot; terms that the law has not are left out. One program: its first call
    takes 0.07 s, operation by operation 0.6 s."""
    coupling = (0.0, 0.0) if robot.drive.coupling is None else robot.drive.coupling
    noise = robot.noise
    time = 1.0 if noise.correlation_time is None else noise.correlation_time
    sensor = WheelSensor(1.0, 1.0, 1.0) if robot.wheels is None else robot.wheels
    values = [
        *jnp.log(jnp.asarray(robot.drive.rate)), *jnp.ravel(jnp.asarray(robot.drive.gain)),
        *jnp.asarray(robot.dead_zone), *jnp.asarray(coupling),
        *jnp.log(jnp.stack([jnp.asarray(v) for v in (noise.position, noise.heading, time)])),
        *jnp.log(jnp.maximum(jnp.stack([jnp.asarray(v) for v in (noise.slip_along, noise.slip_heading)]), 1e-300)),
        *jnp.log(jnp.maximum(jnp.stack([jnp.asarray(v) for v in sensor]), 1e-300)),
    ]  # fmt: skip
    kept = names(law)
    low, high = bounds(law, jnp.inf)
    return jnp.clip(jnp.stack([v for name, v in zip(NAMES, values, strict=True) if name in kept]), low, high)


def from_vector(vector: Unknowns, law: Law) -> Robot:
    """The robot of a vector (unknowns,)."""
    found = dict(zip(names(law), vector, strict=True))
    value = {name: jnp.exp(v) if name in _LOGARITHMIC else v for name, v in found.items()}
    drive = Physical(
        (value["rate_1"], value["rate_2"]),
        ((value["gain_11"], value["gain_12"]), (value["gain_21"], value["gain_22"])),
        (value["coupling_1"], value["coupling_2"]) if law.coupling else None,
    )
    noise = Noise(
        value["position"],
        value["heading"],
        value.get("correlation_time"),
        value.get("slip_along", 0.0),
        value.get("slip_heading", 0.0),
    )
    sensor = WheelSensor(*(value[f"wheel_{name}"] for name in WheelSensor._fields)) if law.wheels else None
    return Robot(drive, (value["dead_zone_r"], value["dead_zone_l"]), noise, sensor)


def bounds(law: Law, d_max: Array) -> tuple[Unknowns, Unknowns]:
    """Lowest and highest vector (unknowns,) that a search may visit; dead zones end at d_max."""

    def limits(table: dict[str, float], free: float, dead_zone: Array) -> Array:
        def limit(name: str) -> Array:
            if name.startswith("dead_zone"):
                return jnp.asarray(dead_zone, float)
            value = table.get(name.removesuffix("_1").removesuffix("_2"))
            return jnp.asarray(free if value is None else jnp.log(value))

        return jnp.stack([limit(name) for name in names(law)])

    return limits(LOWEST, -jnp.inf, 0.0), limits(HIGHEST, jnp.inf, d_max)

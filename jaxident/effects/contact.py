"""Between the wheels and the ground."""

import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array
from jaxident.effects import statements
from jaxident.effects.effect import (
    ALONG,
    BOTH,
    LATERAL,
    UNIT,
    Coordinate,
    EffectRecord,
    Parameter,
    Search,
    Transform,
    positive,
    signed,
)
from jaxident.effects.signals import Grip, Motion, Skid
from jaxident.numerics import safe_divide, sin_cos
from jaxident.robot.drive import Force

SHORTEST = 1e-4
"""Spin [s] of a wheel below which poses cannot tell it from none, and say nothing about it."""


def traction_limit(push: Array, limit: Array) -> Array:
    """L tanh(c / L): what of a wheel's net push c (command less the command that holds its speed) the ground takes."""
    inverse = jnp.where(jnp.isfinite(limit), 1.0 / limit, 0.0)
    return jnp.where(inverse > 0.0, safe_divide(jnp.tanh(push * inverse), inverse, 0.0), push)


def skid(excess: Array, start: Array, middle: Array, step: Array, limit: Array, spin: Array) -> Skid:
    """How a dry wheel slides over a step [s]: where its net push c is beyond L, it turns faster than the ground by e,
    tau e' = c -+ L - e, until e is 0 again.

    excess: e at the start. start, middle: c there and in the middle of the step. spin: tau [s], the inertia of the
    wheel; without any it slides just while c is beyond L. A wheel that comes to roll within the step does so when a
    straight line between both ends says.
    """
    spinning = spin > 0.0
    excess = jnp.where(spinning, excess, 0.0)
    begins = jnp.where(jnp.abs(start) > limit, jnp.sign(start), 0.0)
    direction = jnp.where(excess != 0.0, jnp.sign(excess), begins)
    level = direction * jnp.where(jnp.isfinite(limit), limit, 0.0)
    first, mean = start - level, middle - level
    kept = jnp.exp(-step / jnp.where(spinning, spin, 1.0))
    after = jnp.where(spinning, mean + (excess - mean) * kept, 2.0 * mean - first)
    before = jnp.where(excess != 0.0, excess, jnp.where(spinning, (1.0 - kept) * first, first))
    slides = direction * after > 0.0
    ended = safe_divide(jnp.abs(before), jnp.abs(before) + jnp.abs(after), 0.0)
    return Skid(direction, jnp.where(slides, 1.0, ended * jnp.abs(direction)), jnp.where(slides, after, 0.0))


def lost_push(push: Array, yielded: Array, limit: Array, dry: Array, sliding: Skid) -> Array:
    """What the ground takes of a net push less the push [unit]: `yielded` under a tyre that yields; under a dry one
    that slides it takes the limit."""
    level = jnp.where(jnp.isfinite(limit), limit, 0.0)
    return (1.0 - dry) * yielded + dry * sliding.part * (sliding.direction * level - push)


def _slide(excess, start, middle, step, limit, dry, spin) -> Skid:
    """A tyre that only yields, or motors without more current, let no wheel slide."""
    return skid(excess, start, middle, step, jnp.where(dry > 0.0, limit, jnp.inf), spin)


def _lost(push: Array, sliding: Skid, limit: Array, dry: Array, spin: Array) -> Array:
    return lost_push(push, traction_limit(push, limit) - push, limit, dry, sliding)


def _limit(inverse_square: Array) -> Array:
    """Infinite where there is none."""
    limited = inverse_square > 0.0
    return jnp.where(limited, jnp.sqrt(1.0 / jnp.where(limited, inverse_square, 1.0)), jnp.inf)


def _slide_fast(excess, start, middle, step, inverse_square, dry, spin) -> Skid:
    return _slide(excess, start, middle, step, _limit(inverse_square), dry, spin)


def _lost_fast(push: Array, sliding: Skid, inverse_square: Array, dry: Array, spin: Array) -> Array:
    return lost_push(push, traction_loss(push, inverse_square), _limit(inverse_square), dry, sliding)


def traction_loss(push: Array, inverse_square: Array) -> Array:
    """L tanh(c / L) - c, smooth in 1 / L^2."""
    square = inverse_square * push * push
    small = square < 0.05
    root = jnp.sqrt(jnp.where(small, 1.0, square))
    series = square * (-1.0 / 3.0 + square * (2.0 / 15.0 + square * (-17.0 / 315.0 + square * 62.0 / 2835.0)))
    return push * jnp.where(small, series, jnp.tanh(root) / root - 1.0)


def _to_limit(coordinates) -> dict[str, float]:
    square = max(coordinates["inverse_square"], 0.0)
    spin = float(coordinates["spin"]) if coordinates["spin"] > SHORTEST else 0.0
    limit = float(1.0 / np.sqrt(square)) if square > 0.0 else float("inf")
    return {"limit": limit, "dry": float(coordinates["dry"]), "spin": spin}


def _from_limit(parameters) -> dict[str, float]:
    shape = {key: parameters.get(key, 0.0) for key in ("dry", "spin")}
    return {"inverse_square": parameters["limit"] ** -2, **shape}


def lateral_slip(v: Array, w: Array, slip: Array) -> Array:
    """Speed to the left [m/s]: -c v w, outwards in curves."""
    return -slip * v * w


def slope(motion: Motion, acceleration: Array, direction: Array) -> Force:
    """v' += g cos(theta - theta_0): g of gravity along the fall line, which runs down towards theta_0."""
    _, cosine = sin_cos(motion.theta - direction)
    return Force(acceleration * cosine, jnp.zeros_like(cosine))


def slope_by_components(motion: Motion, x: Array, y: Array) -> Force:
    """`slope` by the components of g along both axes of the field."""
    sine, cosine = sin_cos(motion.theta)
    return Force(x * cosine + y * sine, jnp.zeros_like(cosine))


def _to_slope(coordinates) -> dict[str, float]:
    x, y = coordinates["x"], coordinates["y"]
    return {"acceleration": float(np.hypot(x, y)), "direction": float(np.arctan2(y, x))}


def _from_slope(parameters) -> dict[str, float]:
    g, angle = parameters["acceleration"], parameters["direction"]
    return {"x": g * np.cos(angle), "y": g * np.sin(angle)}


RECORDS = (
    EffectRecord(
        name="traction_limit", site="contact", stage="grip", step=statements.GRIP, quantity="push limit",
        words="the wheels push no harder than their grip on the floor, or the motors' current, allows",
        equation="per wheel c = m - n -> L tanh(c / L); dry: c, beyond +-L +-L until e = 0, tau e' = c -+ L - e",
        source="Pacejka 2012, Tire and Vehicle Dynamics, ch. 4 (smooth saturation of the tyre force); dry: Coulomb "
               "friction under a wheel with inertia",
        parameters=(Parameter("limit", UNIT, float("inf"), (0.2, 2.0), 0.5, least=0.0, above=True),
                    Parameter("dry", "", 0.0, (0.0, 1.0), 0.0, least=0.0, most=1.0, shape=True,
                              forms=("a tyre that yields", "a dry tyre that slides")),
                    Parameter("spin", "s", 0.0, (0.0, 0.1), 0.0, least=0.0, shape=True)),
        channels=BOTH,
        act=Grip(_slide, _lost), fast=Grip(_slide_fast, _lost_fast), confused_with=("motor_lag",), smooth=False,
        grid=(2.0, 1.0, 0.7, 0.5, 0.3, 0.2), sharp=True,
        search=Search((positive("inverse_square", 100.0),
                       Coordinate("dry", 0.0, 0.0, 1.0, 1.0, shape=True, stepped=True),
                       Coordinate("spin", 0.0, 0.0, 0.3, 0.02, shape=True)), Transform(_to_limit, _from_limit),
                      lambda _: [{}, {"inverse_square": 2.0, "dry": 1.0, "spin": 0.02}]),
    ),
    EffectRecord(
        name="lateral_slip", site="contact", stage="side", step=statements.LATERAL, quantity="side slip",
        words="the robot drifts outwards in curves",
        equation="sideways speed -c v w",
        kinds=(("speed sideways", "v", "w"),),
        source="Wong 2008, Theory of Ground Vehicles, ch. 5 (cornering stiffness)",
        parameters=(Parameter("slip", "s", 0.0, (0.0, 0.1), 0.03),), channels=(LATERAL,),
        act=lateral_slip, confused_with=("marker_offset",),
        search=Search((signed("slip", 0.5),), on_speeds=True),
    ),
    EffectRecord(
        name="slope", site="contact", stage="body", step=statements.SLOPE, quantity="tilted floor",
        words="the floor is not level",
        equation="v' += g cos(theta - theta_0)",
        kinds=(("acceleration along", "cos heading", "x", "y"), ("acceleration along", "sin heading", "x", "y"),
               ("acceleration along", "1", "heading")),
        source="gravity on a tilted floor: 0.1 m/s^2 is 0.6 degrees",
        parameters=(Parameter("acceleration", "m/s^2", 0.0, (0.0, 0.5), 0.05),
                    Parameter("direction", "rad", 0.0, (-3.15, 3.15), 0.7, shape=True)),
        channels=(ALONG,),
        act=slope, fast=slope_by_components,
        search=Search((signed("x", 3.0, accelerates=0), signed("y", 3.0, accelerates=0)),
                      Transform(_to_slope, _from_slope)),
    ),
)  # fmt: skip
"""The effects of this site."""

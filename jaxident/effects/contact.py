"""Between the wheels and the ground."""

from typing import Any, NamedTuple

import jax.numpy as jnp

from jaxident.array_types import Array
from jaxident.effects.entry import ALONG, BOTH, LATERAL, UNIT, Entry, Parameter
from jaxident.numerics import safe_divide, sin_cos
from jaxident.robot.drive import Force


class Skid(NamedTuple):
    """How a wheel slides over a substep: its direction, 1, -1 or 0 while it rolls; the part of the substep that it does
    so; and how much faster than the ground it turns afterwards [unit]."""

    direction: Any
    part: Any
    excess: Any


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


def lateral_slip(v: Array, w: Array, slip: Array) -> Array:
    """Speed to the left [m/s]: -c v w, outwards in curves."""
    return -slip * v * w


def slope(theta: Array, acceleration: Array, direction: Array) -> Force:
    """v' += g cos(theta - theta_0): g of gravity along the fall line, which runs down towards theta_0."""
    _, cosine = sin_cos(theta - direction)
    return Force(acceleration * cosine, jnp.zeros_like(cosine))


ENTRIES = (
    Entry("traction_limit", "contact",
          "per wheel c = m - n -> L tanh(c / L); dry: c, beyond +-L +-L until e = 0, tau e' = c -+ L - e",
          (Parameter("limit", UNIT, float("inf"), (0.2, 2.0), 0.5, least=0.0, above=True),
           Parameter("dry", "", 0.0, (0.0, 1.0), 0.0, least=0.0, most=1.0, shape=True),
           Parameter("spin", "s", 0.0, (0.0, 0.1), 0.0, least=0.0, shape=True)), BOTH, ("motor_lag",),
          "Pacejka 2012, Tire and Vehicle Dynamics, ch. 4 (smooth saturation of the tyre force); dry: Coulomb friction "
          "under a wheel with inertia", smooth=False, grid=(2.0, 1.0, 0.7, 0.5, 0.3, 0.2)),
    Entry("lateral_slip", "contact", "sideways speed -c v w", (Parameter("slip", "s", 0.0, (0.0, 0.1), 0.03),),
          (LATERAL,), ("marker_offset",), "Wong 2008, Theory of Ground Vehicles, ch. 5 (cornering stiffness)"),
    Entry("slope", "contact", "v' += g cos(theta - theta_0)",
          (Parameter("acceleration", "m/s^2", 0.0, (0.0, 0.5), 0.05),
           Parameter("direction", "rad", 0.0, (-3.15, 3.15), 0.7, shape=True)), (ALONG,), (),
          "gravity on a tilted floor: 0.1 m/s^2 is 0.6 degrees"),
)  # fmt: skip
"""Rows of the catalogue for this site."""

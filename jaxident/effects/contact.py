"""Between the wheels and the ground."""

import jax.numpy as jnp

from jaxident.array_types import Array
from jaxident.effects.entry import ALONG, BOTH, LATERAL, UNIT, Entry, Parameter
from jaxident.numerics import safe_divide, sin_cos
from jaxident.robot.drive import Force


def traction_limit(push: Array, limit: Array) -> Array:
    """L tanh(c / L): what of a wheel's net push c (command less the command that holds its speed) the ground takes."""
    inverse = jnp.where(jnp.isfinite(limit), 1.0 / limit, 0.0)
    return jnp.where(inverse > 0.0, safe_divide(jnp.tanh(push * inverse), inverse, 0.0), push)


def lateral_slip(v: Array, w: Array, slip: Array) -> Array:
    """Speed to the left [m/s]: -c v w, outwards in curves."""
    return -slip * v * w


def slope(theta: Array, acceleration: Array, direction: Array) -> Force:
    """v' += g cos(theta - theta_0): g of gravity along the fall line, which runs down towards theta_0."""
    _, cosine = sin_cos(theta - direction)
    return Force(acceleration * cosine, jnp.zeros_like(cosine))


ENTRIES = (
    Entry("traction_limit", "contact", "per wheel c -> L tanh(c / L), c = m - n the net push",
          (Parameter("limit", UNIT, float("inf"), (0.2, 2.0), 0.5, least=0.0, above=True),), BOTH, ("motor_lag",),
          "Pacejka 2012, Tire and Vehicle Dynamics, ch. 4 (smooth saturation of the tyre force)", smooth=False,
          grid=(2.0, 1.0, 0.7, 0.5, 0.3, 0.2)),
    Entry("lateral_slip", "contact", "sideways speed -c v w", (Parameter("slip", "s", 0.0, (0.0, 0.1), 0.03),),
          (LATERAL,), ("marker_offset",), "Wong 2008, Theory of Ground Vehicles, ch. 5 (cornering stiffness)"),
    Entry("slope", "contact", "v' += g cos(theta - theta_0)",
          (Parameter("acceleration", "m/s^2", 0.0, (0.0, 0.5), 0.05),
           Parameter("direction", "rad", 0.0, (-3.15, 3.15), 0.7, shape=True)), (ALONG,), (),
          "gravity on a tilted floor: 0.1 m/s^2 is 0.6 degrees"),
)  # fmt: skip
"""Rows of the catalogue for this site."""

"""The static nonlinearity at each wheel's input, PAPER (10)-(12)."""

import jax.numpy as jnp

from jaxident.array_types import Array, Wheels


def dead_zone(u: Array, width: Array) -> Array:
    """What passes a symmetric dead zone: sign(u) max(|u| - D, 0), PAPER (10). Any shape, unit of the command.

    The gradient with respect to the width is -sign(u) outside the zone and 0 inside and on its edge.
    """
    outside = jnp.abs(u) > width
    return jnp.where(outside, u - jnp.sign(u) * width, 0.0)


def effective_command(command: Wheels, width: Array) -> Wheels:
    """Both wheels' commands after their dead zones; width (2,) is [D_r, D_l]."""
    return Wheels(dead_zone(command.right, width[0]), dead_zone(command.left, width[1]))

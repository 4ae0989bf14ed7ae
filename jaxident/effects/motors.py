"""Laws of the push that a command gives: its dead zone, and what the motor makes of it."""

import jax.numpy as jnp

from jaxident.array_types import Array, Wheels
from jaxident.effects.signals import Zone


def asymmetric_dead_zone(zone: Zone, _: Array, right: Array, left: Array) -> Zone:
    """Widths D + a forward and D - a backward."""
    (forward_r, forward_l), (backward_r, backward_l) = zone
    return Zone(Wheels(forward_r + right, forward_l + left), Wheels(backward_r - right, backward_l - left))


def direction_gain(m: Wheels, _: Wheels, __: Array, right: Array, left: Array) -> Wheels:
    """(1 + g sign m) m: slope 1 + g forward and 1 - g backward."""
    return Wheels(m.right + right * jnp.abs(m.right), m.left + left * jnp.abs(m.left))


def supply_sag(m: Wheels, u: Wheels, _: Array, resistance: Array) -> Wheels:
    """m / (1 + s (|u_r| + |u_l|)): both motors share one supply with an inner resistance."""
    share = 1.0 / (1.0 + resistance * (jnp.abs(u.right) + jnp.abs(u.left)))
    return Wheels(m.right * share, m.left * share)

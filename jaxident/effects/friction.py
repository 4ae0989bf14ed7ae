"""How dry friction holds and slows two wheels over a step, whatever its law: levels come from the effects of the stage.

A wheel's speed is expressed as the command that would hold it, n = gain^-1 (rate * [v, w]): where damping acts at the
wheels this is the speed of the rim over that per unit of command, and the track is not needed.
"""

import jax.numpy as jnp

from jaxident.array_types import Array, Wheels
from jaxident.numerics import safe_divide

SWEEPS = 3
"""Of the two wheels' frictions against each other, at each estimate of their levels: where one wheel slides, one
settles the other."""

Mobility = tuple[tuple[Array, Array], tuple[Array, Array]]
"""Change of the wheels' speeds over a step per unit of held force at each wheel, rows by speed."""


def dry_friction(before: Wheels, free: Wheels, mobility: Mobility, level) -> Wheels:
    """Mean friction force of each wheel over a step, which takes it from speed `before` to `free` - mobility friction.

    `level(n)` gives both wheels' levels at speeds n (Wheels). A wheel slides against its level; where it reaches zero
    it stays if the drive is within the level at rest, or else turns about at the moment it gets there. Both wheels at
    rest are solved at once; else each in turn given the other (Gauss-Seidel).
    """
    (m_rr, m_rl), (m_lr, m_ll) = mobility
    at_rest = level(Wheels(jnp.zeros_like(before.right), jnp.zeros_like(before.left)))
    drive = Wheels(free.right - before.right, free.left - before.left)
    both_stop, both_hold = _solve(mobility, free), _solve(mobility, drive)

    def settled(moving: Wheels, right: Array, left: Array) -> tuple[Array, Array]:
        for _ in range(SWEEPS):
            right = _one_wheel(before.right, free.right - m_rl * left, m_rr, moving.right, at_rest.right)
            left = _one_wheel(before.left, free.left - m_lr * right, m_ll, moving.left, at_rest.left)
        return right, left

    right, left = settled(level(before), jnp.zeros_like(free.right), jnp.zeros_like(free.left))
    after = Wheels(free.right - m_rr * right - m_rl * left, free.left - m_lr * right - m_ll * left)
    middle = Wheels(*(0.5 * (a + b) for a, b in zip(before, after, strict=True)))
    alone = settled(level(middle), right, left)
    pairs = [*zip(both_stop, at_rest, strict=True), *zip(both_hold, at_rest, strict=True)]
    stuck = jnp.all(jnp.stack([jnp.abs(f) < limit for f, limit in pairs]), axis=0)
    return Wheels(*(jnp.where(stuck, a, b) for a, b in zip(both_stop, alone, strict=True)))


def slide(before: Wheels, free: Wheels, mobility: Mobility, level) -> Wheels:
    """`dry_friction` by one sweep over wheels that know each other's friction only roughly, for searches: right where
    both slide, of first order in the step where one stops."""
    (m_rr, m_rl), (m_lr, m_ll) = mobility
    now, at_rest = level(before), level(Wheels(jnp.zeros_like(before.right), jnp.zeros_like(before.left)))
    left = _one_wheel(before.left, free.left, m_ll, now.left, at_rest.left)
    right = _one_wheel(before.right, free.right - m_rl * left, m_rr, now.right, at_rest.right)
    left = _one_wheel(before.left, free.left - m_lr * right, m_ll, now.left, at_rest.left)
    return Wheels(right, left)


def _one_wheel(before: Array, free: Array, mobility: Array, level: Array, level_at_rest: Array) -> Array:
    """Mean friction of one wheel; speeds taken as linear in time between its events."""
    drive = safe_divide(free - before, mobility, 0.0)
    old, new = jnp.sign(before), jnp.sign(drive)
    slid = free - mobility * level * old
    turns = slid * old <= 0.0
    reached = jnp.where(turns, safe_divide(before, before - slid, 0.0), 1.0)
    about = level * (reached * old + (1.0 - reached) * new)
    held = jnp.abs(drive) < level_at_rest
    return jnp.where(turns, jnp.where(held, safe_divide(free, mobility, 0.0), about), level * old)


def _solve(mobility: Mobility, speeds: Wheels) -> Wheels:
    """The forces that make up the speeds."""
    (a, b), (c, d) = mobility
    determinant = a * d - b * c
    return Wheels(
        safe_divide(d * speeds.right - b * speeds.left, determinant, 0.0),
        safe_divide(a * speeds.left - c * speeds.right, determinant, 0.0),
    )

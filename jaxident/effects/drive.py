"""Forces on the speed side, as accelerations (along [m/s^2], heading [rad/s^2]), and friction at the wheels.

A wheel's speed is expressed as the command that would hold it, n = gain^-1 (rate * [v, w]): where damping acts at the
wheels this is the speed of the rim over that per unit of command, and the track is not needed.
"""

import jax.numpy as jnp

from jaxident.array_types import Array, Wheels
from jaxident.effects.entry import ALONG, BOTH, UNIT, Entry, Parameter
from jaxident.numerics import safe_divide
from jaxident.robot.drive import Force

SWEEPS = 3
"""Of the two wheels' frictions against each other, at each estimate of their levels: where one wheel slides, one
settles the other."""

Mobility = tuple[tuple[Array, Array], tuple[Array, Array]]
"""Change of the wheels' speeds over a step per unit of held force at each wheel, rows by speed."""


def quadratic_drag(v: Array, w: Array, along: Array, heading: Array) -> Force:
    """v' -= c v |v|, w' -= d w |w|."""
    return Force(-along * v * jnp.abs(v), -heading * w * jnp.abs(w))


def mass_offset(v: Array, w: Array, along: Array, heading: Array) -> Force:
    """v' += c w^2, w' -= d v w: the centre of mass lies c ahead of the axle; d = m c / (inertia + m c^2)."""
    return Force(along * w * w, -heading * v * w)


def turn_loss(v: Array, w: Array, loss: Array) -> Force:
    """v' -= c |w| v: castors and tyres scrub in curves."""
    return Force(-loss * jnp.abs(w) * v, jnp.zeros_like(v))


def friction_level(n: Array, coulomb: Array, stiction: Array, fade: Array) -> Array:
    """coulomb_friction and stiction together: F(n) = F_c + F_s exp(-(n / n_s)^2), Stribeck's curve, >= 0."""
    return coulomb + stiction * jnp.exp(-((n / fade) ** 2))


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


def _levels(typical: float) -> tuple[Parameter, Parameter]:
    return (
        Parameter("right", UNIT, 0.0, (0.0, 0.2), typical, least=0.0),
        Parameter("left", UNIT, 0.0, (0.0, 0.2), 0.8 * typical, least=0.0),
    )


ENTRIES = (
    Entry("coulomb_friction", "drive", "m -> m - F sign n, n the wheel's speed; at rest |F| up to its level",
          _levels(0.08), BOTH, ("asymmetric_dead_zone", "quadratic_drag"),
          "Olsson et al. 1998, Friction models and friction compensation, Eur. J. Control 4"),
    Entry("stiction", "drive", "m -> m - F exp(-(n / n_s)^2) sign n; at rest |F| up to its level",
          (*_levels(0.1), Parameter("fade", UNIT, 0.05, (0.01, 0.2), 0.05, least=0.0, above=True, shape=True)), BOTH,
          ("coulomb_friction",), "Armstrong-Helouvry, Dupont, Canudas de Wit 1994, Automatica 30 (Stribeck's curve)",
          smooth=False, grid=(0.01, 0.02, 0.05, 0.1, 0.15, 0.2)),
    Entry("quadratic_drag", "drive", "v' -= c v |v|, w' -= d w |w|",
          (Parameter("along", "1/m", 0.0, (0.0, 2.0), 0.5, least=0.0),
           Parameter("heading", "1/rad", 0.0, (0.0, 2.0), 0.3, least=0.0)), BOTH,
          ("coulomb_friction", "turn_loss"), "Fossen 2011, Handbook of Marine Craft, ch. 6; fans and brushes on land"),
    Entry("mass_offset", "drive", "v' += c w^2, w' -= d v w",
          (Parameter("along", "m", 0.0, (-0.1, 0.1), 0.01), Parameter("heading", "1/m", 0.0, (-20.0, 20.0), 3.0)), BOTH,
          ("turn_loss",), "Fierro, Lewis 1998, Control of a nonholonomic mobile robot, IEEE TNN 9"),
    Entry("turn_loss", "drive", "v' -= c |w| v", (Parameter("loss", "1/rad", 0.0, (0.0, 20.0), 0.1, least=0.0),),
          (ALONG,), ("quadratic_drag", "mass_offset"), "castor scrub; Wong 2008, Theory of Ground Vehicles, ch. 6"),
)  # fmt: skip
"""Rows of the catalogue for this site."""

"""What a camera reports of a robot's pose, and which pose it reports as a given one."""

import jax
import jax.numpy as jnp

from jaxident.array_types import Array
from jaxident.effects.fast_motion import report
from jaxident.numerics import wrap

NUDGE = 1e-6
"""Step of the differences by a pose [m], [rad]."""
NEWTON_STEPS = 6
"""Towards the pose that a camera reports as another. Where lens and tilt made the picture up to twice as large, five
steps brought it to 1e-11 m; steps without slopes ended 40 m away."""


def seen_by(settings, mean: Array) -> tuple[Array, Array]:
    """The reported pose (3, n) of a state (states, n), and its derivatives (3, 3, n) by the true one."""
    nudged = mean[:3, None] + NUDGE * jnp.eye(4)[1:, :, None]  # the first lane as it stands
    lanes = jnp.stack(report(settings, *nudged))
    return lanes[:, 0], (lanes[:, 1:] - lanes[:, :1]) / NUDGE


def shown_as(settings, pose: Array) -> Array:
    """The robot's pose (3, n) [m, m, rad] that the camera reports as `pose` (3, n), by Newton's method. A step that
    comes no nearer is not taken. A lens may bend the picture so much that steps without its slopes run away."""

    def nearer(_, guess):
        shown, slope = seen_by(settings, guess)
        missed = missed_by(pose, shown)
        step = jnp.linalg.solve(jnp.moveaxis(slope, 2, 0), missed.T[..., None])[..., 0].T
        left = missed_by(pose, jnp.stack(report(settings, *(guess + step))))
        return jnp.where(jnp.sum(left**2, axis=0) < jnp.sum(missed**2, axis=0), guess + step, guess)

    return jax.lax.fori_loop(0, NEWTON_STEPS, nearer, pose)


def missed_by(pose: Array, shown: Array) -> Array:
    """A reported pose (3, n) less the one that is shown [m, m, rad], headings by the shorter way round."""
    missed = pose - shown
    return missed.at[2].set(wrap(missed[2]))

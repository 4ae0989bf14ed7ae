"""From poses to signed path lengths and back, PAPER section III.

Between two poses the robot is taken to run along the cubic Bezier curve whose control points lie at a third of the
chord along the two headings, reversed when it backs.
"""

from typing import Any

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Increment, Pose
from jaxident.numerics import GAUSS_NODES, GAUSS_WEIGHTS, safe_divide, safe_norm, sin_cos, wrap


@jax.jit
def path_length(poses: Pose) -> Increment:
    """Measure signed path lengths and turns between consecutive poses.

    The direction follows (9) of the paper; the length of the Bézier curve comes from a four-node Gauss-Legendre rule.
    Against a true arc the relative error grows with the fourth power of the turn: 5e-7 at 0.1 rad, 3e-4 at 0.5 rad.

    Fast: every step is elementwise along the samples. Trials may follow on a last axis; `c[:-1]` and `c[1:]` are then
    whole rows of contiguous trials.

    Args:
        poses: x, y [m] and theta [rad], each (samples, ...).

    Returns:
        Increment: lengths [m] and turns [rad] (samples - 1, ...). A missing pose (NaN) makes both increments beside it
            NaN.

    Examples:
        >>> import jax.numpy as jnp, jaxident as ji
        >>> back = ji.Pose(jnp.array([0.0, 0.1, 0.0]), jnp.zeros(3), jnp.zeros(3))
        >>> ji.path_length(back).length.round(3).tolist()
        [0.1, -0.1]
    """
    heading = sin_cos(poses.theta)
    start, end = Pose(*(c[:-1] for c in poses)), Pose(*(c[1:] for c in poses))
    length = _signed_length(start, end, tuple(c[:-1] for c in heading), tuple(c[1:] for c in heading))
    return Increment(length, wrap(end.theta - start.theta))


def increment_between(start: Pose, end: Pose) -> Increment:
    """Signed path length [m] and turn [rad] from one pose to another; any shape, both alike."""
    length = _signed_length(start, end, sin_cos(start.theta), sin_cos(end.theta))
    return Increment(length, wrap(end.theta - start.theta))


def follow(start: Pose, increments: Increment) -> Pose:
    """The poses (samples + 1,) that increments (samples,) lead through; `path_length` of them gives these back.

    Each chord is the path length over that of a Bezier curve with unit chord, at the mean of the two headings.
    """
    theta = start.theta + jnp.concatenate([jnp.zeros(1), jnp.cumsum(increments.turn)])
    sine, cosine = sin_cos(theta[:-1] + 0.5 * increments.turn)
    chord = increments.length / bezier_over_chord(increments.turn)
    x = start.x + jnp.concatenate([jnp.zeros(1), jnp.cumsum(chord * cosine)])
    y = start.y + jnp.concatenate([jnp.zeros(1), jnp.cumsum(chord * sine)])
    return Pose(x, y, theta)


def bezier_over_chord(turn: Array) -> Array:
    """Length of the Bezier curve over its chord when the headings lie at -turn / 2 and turn / 2 from the chord."""
    sine, cosine = sin_cos(0.5 * turn)
    handles = (cosine / 3.0, -sine / 3.0), (cosine / 3.0, sine / 3.0)
    return _curve_length((jnp.ones_like(turn), jnp.zeros_like(turn)), *handles)


def _signed_length(start: Pose, end: Pose, heading_0, heading_1) -> Array:
    """Headings come as (sine, cosine). At zero chord the value is 0 and the gradient that of a chord along the mean
    heading: the curve over a unit chord is measured in its place."""
    (sine_0, cosine_0), (sine_1, cosine_1) = heading_0, heading_1
    dx, dy = end.x - start.x, end.y - start.y
    apart = dx * dx + dy * dy > 0.0
    sum_x, sum_y = cosine_0 + cosine_1, sine_0 + sine_1
    size = safe_norm(sum_x, sum_y)
    mean_x, mean_y = safe_divide(sum_x, size, cosine_0), safe_divide(sum_y, size, sine_0)
    chord_x, chord_y = jnp.where(apart, dx, mean_x), jnp.where(apart, dy, mean_y)
    direction = jnp.where(chord_x * cosine_0 + chord_y * sine_0 >= 0.0, 1.0, -1.0)  # PAPER (9)
    third = direction * jnp.sqrt(chord_x * chord_x + chord_y * chord_y) / 3.0
    handles = (third * cosine_0, third * sine_0), (third * cosine_1, third * sine_1)
    length = _curve_length((chord_x, chord_y), *handles)
    return jnp.where(apart, direction, dx * mean_x + dy * mean_y) * length


def _curve_length(chord, first_handle, last_handle) -> Array:
    """Gauss-Legendre length of a cubic Bezier curve from its chord and its first and last control vectors."""
    middle = tuple(c - a - b for c, a, b in zip(chord, first_handle, last_handle, strict=True))
    length: Any = 0.0
    for p, weight in zip(GAUSS_NODES, GAUSS_WEIGHTS, strict=True):
        q = 1.0 - p
        speed_x, speed_y = (
            3.0 * (q * q * a + 2.0 * p * q * m + p * p * b)
            for a, m, b in zip(first_handle, middle, last_handle, strict=True)
        )
        length = length + weight * safe_norm(speed_x, speed_y)
    return length

"""Shapes, axes and the small named tuples that flow between the rooms.

Glossary of axes
    samples   time, one entry per row of a log
    trials    independent repetitions; under `jax.vmap` every field below gains it

Glossary of channels
    along, heading      what the robot does: path length l [m] and heading theta [rad]
    right, left         its two wheels, always in that order
    1, 2                indices of the paper: 1 the equation of l, 2 that of theta

Signals are tuples of arrays, one array per channel, never one array with a channel axis: a function written for
one robot then maps over trials so that each field becomes a contiguous row of trials, which is the fast layout.
Parameters are small arrays, rows by channel and columns by wheel, as in the model file.
"""

from typing import Any, NamedTuple

Array = Any
"""A JAX array, or what JAX takes in its place: a NumPy array, a number. Docstrings say the shape."""


class Wheels(NamedTuple):
    """One value, or one signal (samples,), per wheel [unit of the command]."""

    right: Any
    left: Any


class Pose(NamedTuple):
    """Position [m] and heading [rad, counter-clockwise from x]; scalars or (samples,)."""

    x: Any
    y: Any
    theta: Any


class State(NamedTuple):
    """Pose with the speed along the heading v [m/s] and the turn rate w [rad/s]; scalars or (samples,)."""

    x: Any
    y: Any
    theta: Any
    v: Any
    w: Any

    @property
    def pose(self) -> Pose:
        """The pose without the speeds."""
        return Pose(self.x, self.y, self.theta)


class Increment(NamedTuple):
    """Signed path length [m] and turn [rad] of one sample; scalars or (samples,)."""

    length: Any
    turn: Any


AT_REST = State(0.0, 0.0, 0.0, 0.0, 0.0)
"""At the origin, heading along x, not moving."""

"""What passes from stage to stage of the chain, and what a law may ask for beside it."""

from collections.abc import Callable
from typing import Any, NamedTuple

from jaxident.array_types import Array, Wheels


class Zone(NamedTuple):
    """Widths of both wheels' dead zones [unit], each Wheels: for forward commands and for backward ones."""

    forward: Wheels
    backward: Wheels


class Push(NamedTuple):
    """What drives the wheels over a substep, mean + slope (s - 1/2) for s in [0, 1] [unit].

    The full integrator keeps Wheels; a slope of None is that of a held push. The fast one keeps arrays whose last axis
    is the wheel. Mean and first moment are those of the true push: speeds and positions at the end of the substep
    depend on these to third order.
    """

    mean: Any
    slope: Any


class Substep(NamedTuple):
    """step [s]: length of a substep; speeds: the wheels' speeds in commands (Wheels) under a mean push (Wheels)."""

    step: Any
    speeds: Callable[[Wheels], Wheels]


class Motion(NamedTuple):
    """Speed [m/s], turn rate [rad/s] and heading [rad]; or a departure from them, or its rate of change."""

    v: Any
    w: Any
    theta: Any


class Skid(NamedTuple):
    """How a wheel slides over a substep: its direction, 1, -1 or 0 while it rolls; the part of the substep that it does
    so; and how much faster than the ground it turns afterwards [unit]."""

    direction: Any
    part: Any
    excess: Any


class Grip(NamedTuple):
    """The law of an effect of stage `grip`, for one wheel.

    slide(excess, start, middle, step, **values) -> Skid: over a substep with these net pushes at its start and in its
    middle. lost(push, skid, **values): what the ground takes of a net push less the push [unit].
    """

    slide: Callable[..., Skid]
    lost: Callable[..., Array]


class Load(NamedTuple):
    """The law of an effect of stage `load`.

    instant(**values): the session time [s] at which it sets in. factor(changed, **values): what accelerations are
    multiplied with, before or after it. Its form for the fast integrator is (time, step, **values) -> factor.
    """

    instant: Callable[..., Array]
    factor: Callable[..., Array]

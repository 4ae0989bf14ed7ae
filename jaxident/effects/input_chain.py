"""From the command at the end of the delay line to the push at each wheel, over one substep of the full integrator.

Effects that are not in the settings are not computed.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from jaxident.array_types import Array, Wheels
from jaxident.effects.signals import Push, Substep
from jaxident.effects.stages import CHAIN, acting, remembered_at_rest, static_push

NODES = (0.5 - math.sqrt(1.0 / 12.0), 0.5 + math.sqrt(1.0 / 12.0))
"""Gauss-Legendre rule on [0, 1] with two nodes of weight 1/2: mean and first moment of a cubic are exact."""


class Memory(NamedTuple):
    """What the input remembers: the command after each slew, and what each gear does; tuples of Wheels."""

    slews: Any
    gears: Any


def at_rest(settings, like: Array) -> Memory:
    """Nothing commanded, nothing moving, the gears in the middle of their play."""
    return Memory(*(
        tuple(remembered_at_rest(effect, like) for effect, _ in acting(stage, settings)) for stage in ("slew", "gear")
    ))  # fmt: skip


def push(
    settings, dead_zone: Array, memory: Memory, target: Wheels, time: Array, step: Array,
    speeds: Callable[[Wheels], Wheels],
) -> tuple[Push, Memory]:  # fmt: skip
    """The push of a substep from session time `time` [s] on, `step` [s] long, and what is remembered after it. speeds:
    the wheels' speeds in the middle of the substep under a mean push, both in commands."""
    pushed, gears = _before_gears(settings, dead_zone, memory.slews, target, time, step), []
    for (effect, values), own in zip(acting("gear", settings), memory.gears, strict=True):
        pushed, after = effect.act(pushed, own, Substep(step, speeds), **values)
        gears.append(after)
    _, slews = _slewed(settings, memory.slews, target, step)
    return pushed, Memory(slews, tuple(gears))


def _before_gears(settings, dead_zone, slews: tuple, target: Wheels, time: Array, step: Array) -> Push:
    """The push before what remembers it."""
    if not slews and not any(effect.varies and effect.name in settings for effect in (*CHAIN["zone"], *CHAIN["motor"])):
        return Push(static_push(settings, dead_zone, target, time), None)
    early, late = (
        static_push(settings, dead_zone, _slewed(settings, slews, target, node * step)[0], time + node * step)
        for node in NODES
    )
    pairs = list(zip(early, late, strict=True))
    slope = Wheels(*(math.sqrt(3.0) * (b - a) for a, b in pairs))
    return Push(Wheels(*(0.5 * (a + b) for a, b in pairs)), slope)


def _slewed(settings, slews: tuple, target: Wheels, elapsed: Array) -> tuple[Wheels, tuple]:
    """The command `elapsed` [s] into a substep, and where each slew then stands."""
    reached = []
    for (effect, values), now in zip(acting("slew", settings), slews, strict=True):
        target = effect.act(now, target, elapsed, **values)
        reached.append(target)
    return target, tuple(reached)

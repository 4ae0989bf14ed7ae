"""From the command at the end of the delay line to the push at each wheel, over one substep.

A push that varies within the substep is kept as its mean and its slope, mean + slope (s - 1/2) for s in [0, 1], with
the mean and the first moment of the true one: what speeds and positions at the substep's end depend on to third order.
Effects that are not in the settings are not computed.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax.numpy as jnp

from jaxident.array_types import Array, Wheels
from jaxident.effects.actuation import (
    asymmetric_dead_zone,
    backlash,
    direction_gain,
    input_rate_limit,
    motor_lag,
    supply_sag,
)
from jaxident.effects.time import dead_zone_drift, gain_drift

NODES = (0.5 - math.sqrt(1.0 / 12.0), 0.5 + math.sqrt(1.0 / 12.0))
"""Gauss-Legendre rule on [0, 1] with two nodes of weight 1/2: mean and first moment of a cubic are exact."""
Speeds = Callable[[Wheels], Wheels]
"""Speeds of the wheels in the middle of a substep under a push, both per wheel and in commands."""


class Memory(NamedTuple):
    """What the input remembers: the command after the rate limit, the push after the lag, the position in the play."""

    command: Any
    lagged: Any
    play: Any


class Push(NamedTuple):
    """Mean and slope of a push over a substep; each Wheels, or one wheel's. A slope of None is that of a held push."""

    mean: Any
    slope: Any


def at_rest(settings, like: Array) -> Memory:
    """Nothing commanded, nothing moving, the gears in the middle of their play; None for what is not remembered."""
    kept = (name in settings for name in ("input_rate_limit", "motor_lag", "backlash"))
    return Memory(*(Wheels(jnp.zeros_like(like), jnp.zeros_like(like)) if keep else None for keep in kept))


def push(
    settings, dead_zone: Array, memory: Memory, target: Wheels, time: Array, step: Array, speeds: Speeds
) -> tuple[Push, Memory]:
    """The push of a substep from session time `time` [s] on, `step` [s] long, and what is remembered after it. speeds:
    what the play asks for, first under the push without it, then under what passes."""
    command, wheels = _before_play(settings, dead_zone, memory.command, target, time, step)
    play, lagged = memory.play, memory.lagged
    if "backlash" in settings:
        driven = _plays(settings["backlash"], wheels, memory.play, step, speeds(Wheels(*(now.mean for now in wheels))))
        driven = _plays(settings["backlash"], wheels, memory.play, step, speeds(Wheels(*(p.mean for p, _ in driven))))
        wheels, play = [now for now, _ in driven], Wheels(*(p for _, p in driven))
    if "motor_lag" in settings:
        time_constant = settings["motor_lag"]["time_constant"]
        slow = [_lag(now, last, step, time_constant) for now, last in zip(wheels, memory.lagged, strict=True)]
        wheels, lagged = [now for now, _ in slow], Wheels(*(end for _, end in slow))
    right, left = wheels
    slope = None if right.slope is None else Wheels(right.slope, left.slope)
    return Push(Wheels(right.mean, left.mean), slope), Memory(command, lagged, play)


def _before_play(settings, dead_zone, command: Wheels | None, target: Wheels, time: Array, step: Array):
    """The command after the rate limit, and each wheel's push before backlash and lag."""
    if not settings.keys() & {"input_rate_limit", "gain_drift", "dead_zone_drift"}:
        return command, [Push(m, None) for m in _static(settings, dead_zone, target, time)]
    passed = []
    for node in NODES:
        u = target if command is None else _slew(settings, command, target, node * step)
        passed.append(_static(settings, dead_zone, u, time + node * step))
    pairs = zip(*passed, strict=True)
    wheels = [Push(0.5 * (a + b), math.sqrt(3.0) * (b - a)) for a, b in pairs]
    return None if command is None else _slew(settings, command, target, step), wheels


def _slew(settings, command: Wheels, target: Wheels, elapsed: Array) -> Wheels:
    """The command after the rate limit, `elapsed` [s] into a substep."""
    rate = settings["input_rate_limit"]["rate"]
    return Wheels(*(input_rate_limit(now, goal, elapsed, rate) for now, goal in zip(command, target, strict=True)))


def _static(settings, dead_zone: Array, u: Wheels, time: Array) -> Wheels:
    """The push that a command makes at a session time."""
    passed = []
    for wheel, side in enumerate(Wheels._fields):
        width, difference = dead_zone[wheel], 0.0
        if "dead_zone_drift" in settings:
            width = dead_zone_drift(width, time, settings["dead_zone_drift"]["rate"])
        if "asymmetric_dead_zone" in settings:
            difference = settings["asymmetric_dead_zone"][side]
        m = asymmetric_dead_zone(u[wheel], width, difference)
        if "direction_gain" in settings:
            m = direction_gain(m, settings["direction_gain"][side])
        if "gain_drift" in settings:
            m = gain_drift(m, time, settings["gain_drift"]["rate"])
        passed.append(m)
    if "supply_sag" not in settings:
        return Wheels(*passed)
    return supply_sag(Wheels(*passed), u, settings["supply_sag"]["resistance"])


def _plays(law, wheels: list[Push], positions: Wheels, step: Array, n: Wheels) -> list[tuple[Push, Array]]:
    """What passes the play of both wheels, whose speeds are n, and their positions in it."""
    sides = zip(wheels, positions, n, Wheels._fields, strict=True)
    return [_play(now, place, step, law[side], law["coasting"] * own) for now, place, own, side in sides]


def _play(now: Push, position: Array, step: Array, width: Array, coasting: Array) -> tuple[Push, Array]:
    """What passes the play: for a first part of the substep no more than what lets the wheel coast."""
    turning = now.mean - coasting
    position, free = backlash(position, turning, step, width)
    driving = 1.0 - free
    slope = 6.0 * free * driving * turning
    return Push(coasting + driving * turning, slope if now.slope is None else slope + driving * now.slope), position


def _lag(now: Push, last: Array, step: Array, time_constant: Array) -> tuple[Push, Array]:
    """What passes the lag; the slope of its input passes as far as the lag follows within the substep."""
    end, mean, slope, kept = motor_lag(last, now.mean, step, time_constant)
    return Push(mean, slope if now.slope is None else slope + (1.0 - kept) * now.slope), jnp.asarray(end)

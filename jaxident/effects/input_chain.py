"""From the command at the end of the delay line to the push at each wheel, over one substep.

A push that varies within the substep is kept as its mean and its slope, mean + slope (s - 1/2) for s in [0, 1], with
the mean and the first moment of the true one: what speeds and positions at the substep's end depend on to third order.
"""

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
from jaxident.numerics import GAUSS_NODES, GAUSS_WEIGHTS


class Memory(NamedTuple):
    """What the input remembers: the command after the rate limit, the push after the lag, the position in the play."""

    command: Wheels
    lagged: Wheels
    play: Wheels


class Push(NamedTuple):
    """Mean and slope of a push over a substep; each Wheels, or one wheel's."""

    mean: Any
    slope: Any


AT_REST = Memory(*[Wheels(0.0, 0.0)] * 3)
"""Nothing commanded, nothing moving, the gears in the middle of their play."""


def push(settings, dead_zone: Array, memory: Memory, target: Wheels, time: Array, step: Array) -> tuple[Push, Memory]:
    """The push of a substep from session time `time` [s] on, `step` [s] long, and what is remembered after it."""
    rate = settings["input_rate_limit"]["rate"]
    nodes = [_static(settings, dead_zone, memory.command, target, time, node * step) for node in GAUSS_NODES]
    command = Wheels(*(input_rate_limit(u, goal, step, rate) for u, goal in zip(memory.command, target, strict=True)))
    wheels = [_moments([node[wheel] for node in nodes]) for wheel in range(2)]
    widths = settings["backlash"]["right"], settings["backlash"]["left"]
    driven = [_play(now, p, step, b) for now, p, b in zip(wheels, memory.play, widths, strict=True)]
    time_constant = settings["motor_lag"]["time_constant"]
    lagged = [_lag(now, last, step, time_constant) for (now, _), last in zip(driven, memory.lagged, strict=True)]
    (right, right_end), (left, left_end) = lagged
    after = Memory(command, Wheels(right_end, left_end), Wheels(driven[0][1], driven[1][1]))
    return Push(Wheels(right.mean, left.mean), Wheels(right.slope, left.slope)), after


def _static(settings, dead_zone: Array, command: Wheels, target: Wheels, start: Array, elapsed: Array) -> Wheels:
    """The push before backlash and lag, `elapsed` [s] into a substep."""
    limit, drift = settings["input_rate_limit"]["rate"], settings["dead_zone_drift"]["rate"]
    differences = settings["asymmetric_dead_zone"], settings["direction_gain"]
    u = Wheels(*(input_rate_limit(now, goal, elapsed, limit) for now, goal in zip(command, target, strict=True)))
    passed = []
    for wheel, side in enumerate(Wheels._fields):
        width = dead_zone_drift(dead_zone[wheel], start + elapsed, drift)
        m = direction_gain(asymmetric_dead_zone(u[wheel], width, differences[0][side]), differences[1][side])
        passed.append(gain_drift(m, start + elapsed, settings["gain_drift"]["rate"]))
    return supply_sag(Wheels(*passed), u, settings["supply_sag"]["resistance"])


def _moments(values: list[Array]) -> Push:
    """Mean and slope of a push known at the Gauss nodes of a substep."""
    weighted = list(zip(GAUSS_WEIGHTS, GAUSS_NODES, values, strict=True))
    slope: Any = sum(12.0 * weight * (node - 0.5) * value for weight, node, value in weighted)
    return Push(sum(weight * value for weight, _, value in weighted), slope)


def _play(now: Push, position: Array, step: Array, width: Array) -> tuple[Push, Array]:
    """What passes the play: nothing for a first part of the substep."""
    position, free = backlash(position, now.mean, step, width)
    driving = 1.0 - free
    return Push(driving * now.mean, driving * now.slope + 6.0 * free * driving * now.mean), position


def _lag(now: Push, last: Array, step: Array, time_constant: Array) -> tuple[Push, Array]:
    """What passes the lag; the slope of its input passes as far as the lag follows within the substep."""
    end, mean, slope, kept = motor_lag(last, now.mean, step, time_constant)
    return Push(mean, slope + (1.0 - kept) * now.slope), jnp.asarray(end)

"""The fast integrator: one row of the nominal robot with any effects, the same compiled program for every set.

Between substeps the linear drive is exact; what effects add is held at its value in the middle (exponential midpoint
rule, of second order: Hochbruck and Ostermann 2010, Acta Numerica 19). Positions by Simpson's rule. Everything is
elementwise: states may have any shape, rows of many stretches side by side on the last axis.
"""

import functools
import operator
from typing import Any, NamedTuple

import jax.numpy as jnp

from jaxident.array_types import Array, Pose, State, Wheels
from jaxident.effects.coordinates import pace
from jaxident.effects.discovered import Here, pushed, rolled, shifted, sideways, turned
from jaxident.effects.fast_input import SUBSTEPS
from jaxident.effects.friction import slide
from jaxident.effects.signals import Motion
from jaxident.effects.stages import CHAIN, acting, friction_level, seen
from jaxident.numerics import hold_integrals, sin_cos
from jaxident.robot.drive import Physical, to_wheels, wheel_speeds


class Lag(NamedTuple):
    """Exact response of a speed to half and to a whole substep: decay, and to a held acceleration once and twice."""

    half: Any
    whole: Any


class Rolling(NamedTuple):
    """How both wheels turn beside the robot's own motion: by how much faster than the ground, for each effect that lets
    them slide; the angles of those that discovered laws go by (laws, ...) [rad], None without laws; and the part of
    these laws that is added (`Laws.sure`)."""

    excess: list[Array]
    angles: Any = None
    sure: Any = 1.0


class Row(NamedTuple):
    """What acts during one row of the log: mean and slope of the pushes (substeps, 2, ...), the length of a substep
    [s], the drive's `Lag` of each speed over it, the session time [s] at its start, and what the commands left behind
    (`Past`), None without discovered laws."""

    mean: Any
    slope: Any
    part: Any
    lags: Any
    begin: Any
    past: Any = None


def drive_of(vector: Array) -> Physical:
    """The nominal drive of a vector of coordinates (SIZE,)."""
    along, heading = times = pace(vector[:2], jnp)
    gain = (along * vector[2], along * vector[3]), (heading * vector[4], heading * vector[5])
    return Physical(jnp.exp(vector[:2]), gain, times * vector[8:10])


def lags_of(drive: Physical, part: Array) -> list[Lag]:
    """Exact responses of both speeds over substeps of some length [s], any shape."""
    return [Lag(hold_integrals(rate, 0.5 * part), hold_integrals(rate, part)) for rate in drive.rate]


def report(settings, x: Array, y: Array, theta: Array) -> Pose:
    """What the camera makes of true poses."""
    true = Pose(x, y, theta)
    return shifted(settings, seen(settings, true, fast=True), true)


def rolling(like: Array, angles: Array | None = None, sure: Any = 1.0) -> Rolling:
    """Of wheels that do not slide, at some angles."""
    return Rolling([jnp.zeros_like(like)] * (2 * len(CHAIN["grip"])), angles, sure)


def advance_row(settings, drive: Physical, state: State, wheels: Rolling, row: Row, slip=(0.0, 0.0)):
    """The state one row later, and how the wheels roll then (`wheels`: they did).

    slip: a random acceleration along [m/s^2] and in heading [rad/s^2], held over the row, that asks nothing of the
    wheels' grip."""
    for number in range(SUBSTEPS):
        middle = row.begin + (number + 0.5) * row.part
        loads = [effect.law(middle, row.part, **values) for effect, values in acting("load", settings)]
        lightness = functools.reduce(operator.mul, loads)
        push = _force(drive, row.mean[number]), _force(drive, row.slope[number])
        angles = turned(settings, wheels.angles, 0.5 * row.part * state.v, 0.5 * row.part * state.w)
        here = Here(state.x, state.y, middle, Wheels(*row.mean[number]), row.past, angles, wheels.sure)
        state, wheels = _substep(settings, drive, state, wheels, push, slip, row.part, row.lags, lightness, here)
    return state, wheels


def _substep(
    settings, drive: Physical, state: State, wheels, push, slip, part: Array, lags, lightness: Array, here: Here
):
    """The state one substep later, and how the wheels roll then; `wheels`: they did. here: what discovered laws may
    depend on besides the motion."""
    (x, y, theta, v, w), excess = state, wheels.excess
    (pull, ramp), (lag_v, lag_w) = push, lags
    asked = _asked(drive, v, w, pull, ramp, -0.5)
    sliding = _sliding(settings, excess, asked, asked, part)
    first = _added(settings, drive, (theta, v, w), pull, ramp, -0.5, lightness, sliding, here)
    begun = [sum(forces) for forces in zip(pull, first, slip, strict=True)]
    middle = _ahead(state, lag_v.half, lag_w.half, begun, 0.5 * part, None)
    later = _asked(drive, middle[1], middle[2], pull, ramp, 0.0)
    sliding = _sliding(settings, excess, asked, later, part)
    more = _added(settings, drive, middle, pull, ramp, 0.0, lightness, sliding, here)
    pull = [sum(forces) for forces in zip(pull, more, slip, strict=True)]
    _, free_v, free_w = _ahead(state, lag_v.whole, lag_w.whole, pull, part, ramp)
    rub = _friction(settings, drive, (v, w), (free_v, free_w), lags, lightness)
    pull = [f - lightness * g for f, g in zip(pull, rub, strict=True)]
    middle = _ahead(state, lag_v.half, lag_w.half, pull, 0.5 * part, None)
    end = _ahead(state, lag_v.whole, lag_w.whole, pull, part, ramp)
    faster = rolled(settings, drive, Motion(middle[1], middle[2], middle[0]), here)
    x_rate, y_rate, way, heading = 0.0, 0.0, 0.0, end[0]
    for weight, at, now in ((1.0, 0.0, (theta, v, w)), (4.0, 0.5, middle), (1.0, 1.0, end)):
        angle, speed, turning = now
        if faster is not None:
            speed, angle = speed + faster.along, angle + at * part * faster.heading
            heading = angle
        sine, cosine = sin_cos(angle)
        left = sum(effect.law(speed, turning, **values) for effect, values in acting("side", settings))
        left = left + sideways(settings, Motion(speed, turning, angle), here)
        x_rate = x_rate + weight * (speed * cosine - left * sine)
        y_rate = y_rate + weight * (speed * sine + left * cosine)
        way = way + part / 6.0 * weight * speed
    moved = State(x + part / 6.0 * x_rate, y + part / 6.0 * y_rate, heading, *end[1:])
    angles = turned(settings, wheels.angles, way, heading - theta)
    return moved, Rolling([own.excess for pair in sliding for own in pair], angles, wheels.sure)


def _force(drive: Physical, m) -> list[Array]:
    return [row[0] * m[0] + row[1] * m[1] for row in drive.gain]


def _ahead(state, lag_v, lag_w, pull, time: Array, ramp):
    """Heading and speeds after some time under held accelerations and, over a whole substep, their slopes."""
    _, _, theta, v, w = state
    (decay_v, once_v, twice_v), (decay_w, once_w, twice_w) = lag_v, lag_w
    turned = theta + once_w * w + twice_w * pull[1]
    faster, turning = decay_v * v + once_v * pull[0], decay_w * w + once_w * pull[1]
    if ramp is None:
        return turned, faster, turning
    # a ramp about its mean moves the speed by its first moment, and the angle by -slope time^2 / 12 to leading order
    faster = faster + ramp[0] * (twice_v / time - 0.5 * once_v)
    return turned - ramp[1] * time**2 / 12.0, faster, turning + ramp[1] * (twice_w / time - 0.5 * once_w)


def _linear(drive: Physical, v: Array, w: Array, pull, ramp, place: float) -> tuple[Array, Array]:
    """Accelerations of the linear drive at some place of a substep, -1/2 its start, 1/2 its end."""
    return (
        pull[0] + place * ramp[0] - drive.rate[0] * v + drive.coupling[0] * w,
        pull[1] + place * ramp[1] - drive.rate[1] * w + drive.coupling[1] * v,
    )


def _asked(drive: Physical, v: Array, w: Array, pull, ramp, place: float) -> Wheels:
    """The net push of each wheel at some place of a substep."""
    return to_wheels(drive, *_linear(drive, v, w, pull, ramp, place))


def _sliding(settings, excess, start: Wheels, middle: Wheels, part: Array) -> list:
    """How both wheels slide over a substep by each grip, given their net pushes at its start and in its middle."""
    return [
        [effect.law.slide(*own, part, **values) for own in zip(excess[2 * k : 2 * k + 2], start, middle, strict=True)]
        for k, (effect, values) in enumerate(acting("grip", settings))
    ]


def _added(
    settings, drive: Physical, now, pull, ramp, place: float, lightness: Array, sliding, here: Here
) -> list[Array]:
    """Accelerations by effects, dry friction left out."""
    theta, v, w = now
    along, heading = _linear(drive, v, w, pull, ramp, place)
    asked = to_wheels(drive, along, heading)
    found = [drive.coupling[0] * w + (lightness - 1.0) * along, drive.coupling[1] * v + (lightness - 1.0) * heading]
    for (effect, values), wheels in zip(acting("grip", settings), sliding, strict=True):
        lost = [effect.law.lost(n, own, **values) for n, own in zip(asked, wheels, strict=True)]
        found = [have + lightness * more for have, more in zip(found, _force(drive, lost), strict=True)]
    bodies = [effect.law(Motion(v, w, theta), **values) for effect, values in acting("body", settings)]
    more = pushed(settings, drive, Motion(v, w, theta), here)
    for force in bodies if more is None else [*bodies, more]:
        found = [have + own for have, own in zip(found, force, strict=True)]
    return found


def _friction(settings, drive: Physical, before, free, lags, lightness: Array) -> list[Array]:
    """Accelerations that dry friction takes over a substep."""
    (a, b), (c, d) = drive.gain
    once_v, once_w = lags[0].whole[1] * lightness, lags[1].whole[1] * lightness
    right, left = (wheel_speeds(drive, p * once_v, q * once_w) for p, q in ((a, c), (b, d)))
    mobility = (right.right, left.right), (right.left, left.left)
    level = functools.partial(friction_level, settings)
    return _force(drive, slide(wheel_speeds(drive, *before), wheel_speeds(drive, *free), mobility, level))

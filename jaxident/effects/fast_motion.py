"""The fast integrator: one row of the nominal robot with any effects, the same compiled program for every set.

Between substeps the linear drive is exact; what effects add is held at its value in the middle (exponential midpoint
rule, of second order: Hochbruck and Ostermann 2010, Acta Numerica 19). Positions by Simpson's rule. Everything is
elementwise: states may have any shape, rows of many stretches side by side on the last axis.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Pose, State, Wheels
from jaxident.effects import camera
from jaxident.effects.contact import Skid, lateral_slip, lost_push, skid
from jaxident.effects.drive import friction_level, mass_offset, quadratic_drag, slide, turn_loss
from jaxident.effects.fast_input import SUBSTEPS
from jaxident.numerics import hold_integrals, safe_divide, sin_cos
from jaxident.robot.drive import Physical, to_wheels, wheel_speeds


class Lag(NamedTuple):
    """Exact response of a speed to half and to a whole substep: decay, and to a held acceleration once and twice."""

    half: Any
    whole: Any


class Row(NamedTuple):
    """What acts during one row of the log: mean and slope of the pushes (substeps, 2, ...), the length of a substep
    [s], the drive's `Lag` of each speed over it, and the session time [s] at its start."""

    mean: Any
    slope: Any
    part: Any
    lags: Any
    begin: Any


def drive_of(vector: Array) -> Physical:
    """The nominal drive of a vector of coordinates (SIZE,)."""
    return Physical(jnp.exp(vector[:2]), ((vector[2], vector[3]), (vector[4], vector[5])), vector[8:10])


def lags_of(drive: Physical, part: Array) -> list[Lag]:
    """Exact responses of both speeds over substeps of some length [s], any shape."""
    return [Lag(hold_integrals(rate, 0.5 * part), hold_integrals(rate, part)) for rate in drive.rate]


def report(settings, x: Array, y: Array, theta: Array) -> Pose:
    """What the camera makes of true poses."""
    pose = Pose(x, y, theta)
    pose = camera.marker_offset(pose, **settings["marker_offset"])
    pose = camera.heading_offset(pose, **settings["heading_offset"])
    strength, *pulls = (settings["lens_distortion"][key] for key in ("strength", "pull_x", "pull_y"))
    pose = camera.lens_distortion(pose, strength, *(safe_divide(pull, strength, 0.0) for pull in pulls))
    pose = camera.camera_tilt(pose, **settings["camera_tilt"])
    return camera.camera_scale(pose, **settings["camera_scale"])


def advance_row(settings, drive: Physical, state: State, excess: list[Array], row: Row, slip=(0.0, 0.0)):
    """The state one row later, and by how much each wheel then turns faster than the ground (`excess`: it did).

    slip: a random acceleration along [m/s^2] and in heading [rad/s^2], held over the row, that asks nothing of the
    wheels' grip."""
    loss, instant = settings["payload_change"]["loss"], settings["payload_change"]["instant"]
    for number in range(SUBSTEPS):
        middle = row.begin + (number + 0.5) * row.part
        lightness = 1.0 - loss * jax.nn.sigmoid((middle - instant) / row.part)
        push = _force(drive, row.mean[number]), _force(drive, row.slope[number])
        state, excess = _substep(settings, drive, state, excess, push, slip, row.part, row.lags, lightness)
    return state, excess


def _substep(settings, drive: Physical, state: State, excess, push, slip, part: Array, lags, lightness: Array):
    """The state one substep later, and by how much the wheels then turn faster than the ground; `excess`: they did."""
    x, y, theta, v, w = state
    (pull, ramp), (lag_v, lag_w) = push, lags
    asked = _asked(drive, v, w, pull, ramp, -0.5)
    sliding = _sliding(settings, excess, asked, asked, part)
    first = _added(settings, drive, (theta, v, w), pull, ramp, -0.5, lightness, sliding)
    begun = [sum(forces) for forces in zip(pull, first, slip, strict=True)]
    middle = _ahead(state, lag_v.half, lag_w.half, begun, 0.5 * part, None)
    later = _asked(drive, middle[1], middle[2], pull, ramp, 0.0)
    sliding = _sliding(settings, excess, asked, later, part)
    more = _added(settings, drive, middle, pull, ramp, 0.0, lightness, sliding)
    pull = [sum(forces) for forces in zip(pull, more, slip, strict=True)]
    _, free_v, free_w = _ahead(state, lag_v.whole, lag_w.whole, pull, part, ramp)
    rub = _friction(settings, drive, (v, w), (free_v, free_w), lags, lightness)
    pull = [f - lightness * g for f, g in zip(pull, rub, strict=True)]
    middle = _ahead(state, lag_v.half, lag_w.half, pull, 0.5 * part, None)
    end = _ahead(state, lag_v.whole, lag_w.whole, pull, part, ramp)
    sliding_out = settings["lateral_slip"]["slip"]
    x_rate, y_rate = 0.0, 0.0
    for weight, (angle, speed, turning) in ((1.0, (theta, v, w)), (4.0, middle), (1.0, end)):
        sine, cosine = sin_cos(angle)
        left = lateral_slip(speed, turning, sliding_out)
        x_rate = x_rate + weight * (speed * cosine - left * sine)
        y_rate = y_rate + weight * (speed * sine + left * cosine)
    moved = State(x + part / 6.0 * x_rate, y + part / 6.0 * y_rate, *end)
    return moved, [own.excess for own in sliding]


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


def _limit(settings) -> Array:
    """That of traction; infinite where there is none."""
    inverse = settings["traction_limit"]["inverse_square"]
    return jnp.where(inverse > 0.0, jnp.sqrt(1.0 / jnp.where(inverse > 0.0, inverse, 1.0)), jnp.inf)


def _sliding(settings, excess, start: Wheels, middle: Wheels, part: Array) -> list[Skid]:
    """How wheels slide over a substep, given their net pushes at its start and in its middle."""
    limit, spin = _limit(settings), settings["traction_limit"]["spin"]
    return [skid(*own, part, limit, spin) for own in zip(excess, start, middle, strict=True)]


def _added(settings, drive: Physical, now, pull, ramp, place: float, lightness: Array, sliding) -> list[Array]:
    """Accelerations by effects, dry friction left out."""
    theta, v, w = now
    across = drive.coupling[0] * w, drive.coupling[1] * v
    along, heading = _linear(drive, v, w, pull, ramp, place)
    asked, law = to_wheels(drive, along, heading), settings["traction_limit"]
    yielded = [_traction_loss(n, law["inverse_square"]) for n in asked]
    wheels = zip(asked, yielded, sliding, strict=True)
    lost = _force(drive, [lost_push(n, m, _limit(settings), law["dry"], own) for n, m, own in wheels])
    terms = [
        quadratic_drag(v, w, **settings["quadratic_drag"]),
        mass_offset(v, w, **settings["mass_offset"]),
        turn_loss(v, w, **settings["turn_loss"]),
    ]
    sine, cosine = sin_cos(theta)
    incline = settings["slope"]["x"] * cosine + settings["slope"]["y"] * sine
    return [
        across[0] + sum(t.along for t in terms) + incline + lightness * lost[0] + (lightness - 1.0) * along,
        across[1] + sum(t.heading for t in terms) + lightness * lost[1] + (lightness - 1.0) * heading,
    ]


def _traction_loss(push: Array, inverse_square: Array) -> Array:
    """L tanh(c / L) - c, smooth in 1 / L^2."""
    square = inverse_square * push * push
    small = square < 0.05
    root = jnp.sqrt(jnp.where(small, 1.0, square))
    series = square * (-1.0 / 3.0 + square * (2.0 / 15.0 + square * (-17.0 / 315.0 + square * 62.0 / 2835.0)))
    return push * jnp.where(small, series, jnp.tanh(root) / root - 1.0)


def _friction(settings, drive: Physical, before, free, lags, lightness: Array) -> list[Array]:
    """Accelerations that dry friction takes over a substep."""
    (a, b), (c, d) = drive.gain
    once_v, once_w = lags[0].whole[1] * lightness, lags[1].whole[1] * lightness
    right, left = (wheel_speeds(drive, p * once_v, q * once_w) for p, q in ((a, c), (b, d)))
    mobility = (right.right, left.right), (right.left, left.left)
    coulomb, stiction = settings["coulomb_friction"], settings["stiction"]

    def level(n: Wheels) -> Wheels:
        sides = zip(n, Wheels._fields, strict=True)
        return Wheels(*(friction_level(m, coulomb[side], stiction[side], stiction["fade"]) for m, side in sides))

    return _force(drive, slide(wheel_speeds(drive, *before), wheel_speeds(drive, *free), mobility, level))

"""Poses of windows under the nominal robot and any effects: one compiled program for all of them.

Between substeps the linear drive is exact; what effects add is held at its value in the middle (exponential midpoint
rule, of second order: Hochbruck and Ostermann 2010, Acta Numerica 19). Positions by Simpson's rule.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Pose, Wheels
from jaxident.diagnosis.motion.coordinates import by_effect
from jaxident.diagnosis.motion.inputs import SUBSTEPS, Push, pushes
from jaxident.diagnosis.motion.windows import Windows
from jaxident.effects import camera
from jaxident.effects.contact import Skid, lateral_slip, lost_push, skid
from jaxident.effects.drive import friction_level, mass_offset, quadratic_drag, slide, turn_loss
from jaxident.numerics import hold_integrals, safe_divide, sin_cos, wrap
from jaxident.robot.drive import Physical, to_wheels, wheel_speeds


class Track(NamedTuple):
    """True states of windows, each (rows, windows)."""

    x: Any
    y: Any
    theta: Any
    v: Any
    w: Any


class Lag(NamedTuple):
    """Exact response of a speed to half and to a whole substep: decay, and to a held acceleration once and twice."""

    half: Any
    whole: Any


def residuals(vector: Array, starts: Array, push: Push, windows: Windows) -> Array:
    """Measured minus modelled poses (rows, windows, 3), 0 where unseen; starts (5, windows) of the robot itself, and
    what `push_of` says drives its wheels."""
    settings = by_effect(vector)
    return compare(report(settings, move(vector, settings, push, starts, windows)), windows)


def compare(pose: Pose, windows: Windows) -> Array:
    """Measured minus modelled poses (rows, windows, 3), the heading wrapped, 0 where unseen."""
    x, y, theta = (windows.pose[..., k] - modelled for k, modelled in enumerate(pose))
    return jnp.where(windows.seen[..., None], jnp.stack([x, y, wrap(theta)], axis=-1), 0.0)


def report(settings, states: Track) -> Pose:
    """What the camera makes of true states."""
    pose = Pose(states.x, states.y, states.theta)
    pose = camera.marker_offset(pose, **settings["marker_offset"])
    pose = camera.heading_offset(pose, **settings["heading_offset"])
    strength, *pulls = (settings["lens_distortion"][key] for key in ("strength", "pull_x", "pull_y"))
    pose = camera.lens_distortion(pose, strength, *(safe_divide(pull, strength, 0.0) for pull in pulls))
    pose = camera.camera_tilt(pose, **settings["camera_tilt"])
    return camera.camera_scale(pose, **settings["camera_scale"])


def track(vector: Array, starts: Array, windows: Windows) -> Track:
    """True states (rows, windows) from starts (5, windows)."""
    return move(vector, by_effect(vector), push_of(vector, windows), starts, windows)


def drive_of(vector: Array) -> Physical:
    """The nominal drive of a vector (SIZE,)."""
    return Physical(jnp.exp(vector[:2]), ((vector[2], vector[3]), (vector[4], vector[5])), vector[8:10])


def push_of(vector: Array, windows: Windows) -> Push:
    """What drives the wheels: pushes of whole runs cut into windows, (rows, substeps, 2, windows)."""
    push = pushes(by_effect(vector), drive_of(vector), vector[6:8], windows.t, windows.session, windows.command)
    rows = windows.step.shape[0]
    places = jnp.minimum(windows.first + jnp.arange(rows)[:, None], push.mean.shape[0] - 1)
    return Push(*(part[places, windows.run].transpose(0, 2, 3, 1) for part in push))


def move(vector: Array, settings, push: Push, starts: Array, windows: Windows) -> Track:
    """True states (rows, windows) under pushes (rows, substeps, 2, windows)."""
    drive = drive_of(vector)
    part = windows.step / SUBSTEPS
    lags = [Lag(hold_integrals(rate, 0.5 * part), hold_integrals(rate, part)) for rate in drive.rate]
    time = windows.session[windows.run] + windows.t[windows.first, windows.run]
    begin = time + jnp.cumsum(windows.step, axis=0) - windows.step
    loss, instant = settings["payload_change"]["loss"], settings["payload_change"]["instant"]

    def body(carry, row):
        mean, slope, part, lags, begin = row
        after, excess = carry
        for number in range(SUBSTEPS):
            middle = begin + (number + 0.5) * part
            lightness = 1.0 - loss * jax.nn.sigmoid((middle - instant) / part)
            push = mean[number], slope[number]
            after, excess = _substep(settings, drive, after, excess, push, part, lags, lightness)
        return (after, excess), carry[0]

    rolling = [jnp.zeros_like(starts[0])] * 2
    return Track(*jax.lax.scan(body, (tuple(starts), rolling), (push.mean, push.slope, part, lags, begin))[1])


def _substep(settings, drive: Physical, state, excess, push, part: Array, lags, lightness: Array):
    """The state one substep later, and by how much the wheels then turn faster than the ground; `excess`: they did."""
    x, y, theta, v, w = state
    (mean, slope), (lag_v, lag_w) = push, lags
    pull, ramp = _force(drive, mean), _force(drive, slope)
    asked = _asked(drive, v, w, pull, ramp, -0.5)
    sliding = _sliding(settings, excess, asked, asked, part)
    first = _added(settings, drive, (theta, v, w), pull, ramp, -0.5, lightness, sliding)
    middle = _ahead(state, lag_v.half, lag_w.half, [f + n for f, n in zip(pull, first, strict=True)], 0.5 * part, None)
    later = _asked(drive, middle[1], middle[2], pull, ramp, 0.0)
    sliding = _sliding(settings, excess, asked, later, part)
    more = _added(settings, drive, middle, pull, ramp, 0.0, lightness, sliding)
    pull = [f + n for f, n in zip(pull, more, strict=True)]
    _, free_v, free_w = _ahead(state, lag_v.whole, lag_w.whole, pull, part, ramp)
    rub = _friction(settings, drive, (v, w), (free_v, free_w), lags, lightness)
    pull = [f - lightness * g for f, g in zip(pull, rub, strict=True)]
    middle = _ahead(state, lag_v.half, lag_w.half, pull, 0.5 * part, None)
    end = _ahead(state, lag_v.whole, lag_w.whole, pull, part, ramp)
    slip = settings["lateral_slip"]["slip"]
    x_rate, y_rate = 0.0, 0.0
    for weight, (angle, speed, turning) in ((1.0, (theta, v, w)), (4.0, middle), (1.0, end)):
        sine, cosine = sin_cos(angle)
        left = lateral_slip(speed, turning, slip)
        x_rate = x_rate + weight * (speed * cosine - left * sine)
        y_rate = y_rate + weight * (speed * sine + left * cosine)
    return (x + part / 6.0 * x_rate, y + part / 6.0 * y_rate, *end), [own.excess for own in sliding]


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

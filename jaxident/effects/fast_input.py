"""From commands to the pushes at the wheels, over the substeps of whole runs: everything that remembers the input.

Pushes are kept as mean and slope over a substep, mean + slope (s - 1/2) for s in [0, 1]. A delay reads them from the
integrals of what the wheels were asked for, so that it switches where it should at any length.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Wheels
from jaxident.effects.actuation import (
    asymmetric_dead_zone,
    backlash,
    direction_gain,
    input_quantisation,
    input_saturation,
    motor_lag,
)
from jaxident.effects.time import dead_zone_drift, gain_drift
from jaxident.numerics import safe_divide
from jaxident.robot.drive import Physical, force, wheel_speeds

PUSHING = (
    "asymmetric_dead_zone", "direction_gain", "input_saturation", "input_quantisation", "input_rate_limit",
    "transport_delay", "motor_lag", "backlash", "supply_sag", "gain_drift", "dead_zone_drift",
)  # fmt: skip
"""Effects that act before the wheels: beside the dead zones, pushes depend on nothing else but, where wheels coast in
the play of their gears, on the nominal drive."""
SUBSTEPS = 2
"""Per row; the nominal part is exact whatever their number."""
RUN_UP = 3.0
"""Commands [s] before a stretch that bring what the input remembers to where it stands: six time constants of the
slowest lag that a search visits, and longer than any delay."""
NODES = (0.21132486540518713, 0.7886751345948129)
"""Gauss-Legendre on a substep, of third degree."""
JUST_BEFORE = 1e-9
"""Part of a step by which a delay reads early: its derivative at zero is that of a growing delay."""


class Push(NamedTuple):
    """Mean and slope of what drives the wheels, (rows, runs, substeps, 2) or cut into windows."""

    mean: Any
    slope: Any


def pushes(settings, drive: Physical, dead_zone: Array, t: Array, session: Array, command: Array) -> Push:
    """The pushes of runs: t (rows, runs) [s], session (runs,) [s], command (rows, runs, 2); dead_zone (2,). drive: what
    tells the speed of wheels that coast."""
    return expected_pushes(settings, drive, dead_zone, t, session, command, None)[0]


def expected_pushes(
    settings, drive: Physical, dead_zone: Array, t: Array, session: Array, command: Array, lost: Array | None
) -> tuple[Push, Array | None]:
    """The pushes that are to be expected where each command is lost with a probability, and the deviation of the jolts
    (rows, runs, 2) that losing them makes (`_expected`); with None lost, as `pushes`, and None."""
    step = jnp.diff(t, axis=0, append=t[-1:] + 1.0)
    part = step / SUBSTEPS
    asked, jolt = _asked(settings, dead_zone, t, session, command, part), None
    if lost is not None:
        asked, jolt = _expected(asked, lost)
    asked = _delayed(asked, t, part, settings["transport_delay"]["delay"])
    return _remembered(settings, drive, asked, part), jolt


def _asked(settings, dead_zone: Array, t: Array, session: Array, command: Array, part: Array) -> Push:
    """Pushes without delay, play and lag, from every static law in between."""
    sent = input_saturation(command, settings["input_saturation"]["level"])
    sent = input_quantisation(sent, settings["input_quantisation"]["step"])
    inverse = settings["input_rate_limit"]["inverse_rate"]
    before = _rate_limited(sent, part * SUBSTEPS, inverse)
    drift, resistance = settings["dead_zone_drift"]["rate"], settings["supply_sag"]["resistance"]
    difference = _pair(settings, "asymmetric_dead_zone")
    slope = _pair(settings, "direction_gain")

    def at(elapsed):
        """The pushes `elapsed` [s] (rows, runs) after each row."""
        u = _towards(before, sent, elapsed[..., None], inverse)
        time = (session + t + elapsed)[..., None]
        m = direction_gain(asymmetric_dead_zone(u, dead_zone_drift(dead_zone, time, drift), difference), slope)
        m = gain_drift(m, time, settings["gain_drift"]["rate"])
        return m / (1.0 + resistance * jnp.sum(jnp.abs(u), axis=-1, keepdims=True))

    means, slopes = [], []
    for number in range(SUBSTEPS):
        early, late = (at((number + node) * part) for node in NODES)
        means.append(0.5 * (early + late))
        slopes.append(6.0 * (NODES[1] - 0.5) * (late - early))
    return Push(jnp.stack(means, axis=2), jnp.stack(slopes, axis=2))


def _expected(asked: Push, lost: Array) -> tuple[Push, Array]:
    """Mean pushes where each command is lost with a probability p, and the one before stays in force: (1 - p) m + p of
    the row before's; and the deviation (rows, runs, 2) of a jolt in that row that lasts as uncertain a time. A change
    comes j rows late, j geometric: p / (1 - p) on average, with the deviation sqrt(p) / (1 - p)."""

    def body(last, now):
        mean, slope = now
        arrived = (1.0 - lost) * mean + lost * last
        return arrived[:, -1:], (arrived, (1.0 - lost) * slope, mean[:, 0] - last[:, 0])

    begin = jnp.zeros_like(asked.mean[0, :, :1])
    _, (mean, slope, change) = jax.lax.scan(body, begin, asked)
    return Push(mean, slope), change * jnp.sqrt(lost) / (1.0 - lost)


def _pair(settings, name: str) -> Array:
    return jnp.stack([jnp.asarray(settings[name][side]) for side in ("right", "left")])


def _towards(now: Array, goal: Array, time: Array, inverse: Array) -> Array:
    """The command some time [s] after `goal` was asked for, when it moves by 1 / inverse [unit/s] at most."""
    change = goal - now
    needed = jnp.abs(change) * inverse
    return now + change * jnp.where(needed > time, safe_divide(time, needed, 1.0), 1.0)


def _rate_limited(sent: Array, step: Array, inverse: Array) -> Array:
    """The command (rows, runs, 2) that the limit has reached at each row."""

    def body(now, row):
        goal, own = row
        return _towards(now, goal, own[:, None], inverse), now

    return jax.lax.scan(body, jnp.zeros_like(sent[0]), (sent, step))[1]


def _delayed(asked: Push, t: Array, part: Array, delay: Array) -> Push:
    """Every push `delay` [s] later; nothing is asked for before the first row."""
    mean, slope = asked
    length = _flat(jnp.broadcast_to(part[:, :, None], mean.shape[:3]))
    mean, slope = _flat(mean), _flat(slope)
    nodes = t[:1] + jnp.concatenate([jnp.zeros_like(length[:1]), jnp.cumsum(length, axis=0)])
    size = length[..., None]
    first = _integral(size * mean)
    # exact for a push that varies within a substep
    second = _integral(size * first[:-1] + size**2 * (0.5 * mean - slope / 12.0))
    early = nodes - (delay + JUST_BEFORE * length[0])
    place = jax.vmap(lambda a, v: jnp.searchsorted(a, v, side="right") - 1, in_axes=1, out_axes=1)(nodes[:-1], early)
    known = jnp.concatenate([first[:-1], second[:-1], mean, slope, nodes[:-1, :, None], size], axis=-1)
    own = jnp.take_along_axis(known, jnp.maximum(place, 0)[..., None], axis=0)
    elapsed = early[..., None] - own[..., 8:9]
    s = elapsed / own[..., 9:]
    once = own[..., 0:2] + elapsed * (own[..., 4:6] + own[..., 6:8] * 0.5 * (s - 1.0))
    twice = (
        own[..., 2:4] + elapsed * own[..., 0:2] + elapsed**2 * (0.5 * own[..., 4:6] + own[..., 6:8] * (s / 6.0 - 0.25))
    )
    inside = (place >= 0)[..., None]
    once, twice = jnp.where(inside, once, 0.0), jnp.where(inside, twice, 0.0)
    mean = jnp.diff(once, axis=0) / size
    slope = 12.0 * (0.5 * (once[1:] + once[:-1]) - jnp.diff(twice, axis=0) / size) / size
    return Push(mean, slope)


def _flat(values: Array) -> Array:
    """(rows, runs, substeps, ...) to (rows * substeps, runs, ...)."""
    return jnp.moveaxis(values, 2, 1).reshape(-1, values.shape[1], *values.shape[3:])


def _integral(pieces: Array) -> Array:
    """Sums (points + 1, ...) of pieces (points, ...) before each point."""
    return jnp.concatenate([jnp.zeros_like(pieces[:1]), jnp.cumsum(pieces, axis=0)])


def _remembered(settings, drive: Physical, asked: Push, part: Array) -> Push:
    """Pushes (rows * substeps, runs, 2) behind the play of the gears and the lag of the motors, as (rows, runs,
    substeps, 2)."""
    mean, slope = asked
    rows, runs = part.shape
    size = jnp.repeat(part, SUBSTEPS, axis=0)[..., None]
    mean, slope = _played(_pair(settings, "backlash"), settings["backlash"]["coasting"], drive, mean, slope, size)
    mean, slope = _lagged(settings["motor_lag"]["time_constant"], mean, slope, size)
    return Push(*(x.reshape(rows, SUBSTEPS, runs, 2).transpose(0, 2, 1, 3) for x in (mean, slope)))


def _played(width: Array, coasting: Array, drive: Physical, mean, slope, size) -> tuple[Array, Array]:
    """What passes the play: for a first part of some substeps no more than what lets the wheels coast, whose speeds are
    those of the nominal drive."""
    decay = jnp.exp(-drive.rate * size)

    def body(carry, now):
        position, speeds = carry
        mean, own, decay = now
        across = speeds[:, ::-1] * drive.coupling
        coasts = coasting * jnp.stack(wheel_speeds(drive, *speeds.T), axis=-1)
        position, free = backlash(position, mean - coasts, own, width)
        pull = force(drive, Wheels(*(free * coasts + (1.0 - free) * mean).T))
        steady = (jnp.stack(pull, axis=-1) + across) / drive.rate
        return (position, steady + (speeds - steady) * decay), (free, coasts)

    still = jnp.zeros_like(mean[0])
    free, coasts = jax.lax.scan(body, (still, still), (mean, size, decay))[1]
    driving, turning = 1.0 - free, mean - coasts
    return coasts + driving * turning, driving * slope + 6.0 * free * driving * turning


def _lagged(time_constant: Array, mean: Array, slope: Array, size: Array) -> tuple[Array, Array]:
    """What passes the lag; it is linear, so that the response to a unit gap serves every substep."""
    decay, average, rising, kept = motor_lag(jnp.ones_like(size), jnp.zeros_like(size), size, time_constant)

    def body(last, now):
        goal, own = now
        return goal + (last - goal) * own, last

    last = jax.lax.scan(body, jnp.zeros_like(mean[0]), (mean, decay))[1]
    gap = last - mean
    return mean + gap * average, gap * rising + (1.0 - kept) * slope

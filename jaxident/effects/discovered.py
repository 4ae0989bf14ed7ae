"""Laws that were discovered in logs and stand in no catalogue: a curve of one signal or a surface of two, at one place
of the chain.

    what it adds = times * curve(signal), or times * surface(signal, second signal)

A curve is straight between its knots and constant beyond them; so is a surface along each of its signals. times is 1,
the speed v, the turn rate w, the cosine or sine of the heading, the direction, or of each wheel its speed, its push,
or how far its command has just changed, or which way. A robot that loses speed in turns has v times a curve of w; one
that is slow on a patch of carpet has v times a surface of x and y; a floor that slopes differently from place to place
makes two surfaces, one for each direction; a robot that follows the later, the faster it is has the change of each
wheel's command times a curve of v; a wheel that is not round rolls by its speed times a curve of its angle, which is
another one when each run begins.
Both integrators take laws from their settings (`with_laws`), under one name that no effect of the catalogue has.
"""

from collections.abc import Callable, Collection, Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Pose, Wheels
from jaxident.effects.law_arrays import Laws
from jaxident.effects.law_kinds import (
    ACTS,
    ALONG,
    ANGLE,
    BY_CAMERA,
    DISCOVERED,
    HEADING,
    PUSHES,
    ROLLINGS,
    SIDEWAYS,
    SIGNALS,
    TIMES,
    WHEELS,
    directions,
    remembered,
)
from jaxident.effects.signals import Motion
from jaxident.numerics import sin_cos, wrap
from jaxident.robot.drive import Force, Physical, force, wheel_speeds


class Here(NamedTuple):
    """What is held over a substep: position [m], session time [s], what drives the wheels [unit]; what the commands
    left behind (`Past`), and the angles of the wheels that laws go by (laws, ...) [rad], None without laws; sure: what
    part of such a law is added (laws, ...)."""

    x: Any
    y: Any
    time: Any
    push: Wheels
    past: Any
    angles: Any
    sure: Any = 1.0


def with_laws(settings: Mapping[str, Any], laws: Laws | None) -> Mapping[str, Any]:
    """Settings of a program that obeys some laws, too."""
    return settings if laws is None else {**settings, DISCOVERED: {"laws": laws}}


def turned(settings: Mapping[str, Any], angles: Array | None, way: Array, turn: Array) -> Array | None:
    """The angles (laws, ...) [rad] of wheels that laws go by, after a way [m] and a turn [rad] of the robot; None
    without laws."""
    if angles is None:
        return None
    per_metre, per_radian = (_each(rate, way) for rate in jnp.moveaxis(settings[DISCOVERED]["laws"].per_way, -1, 0))
    return angles + per_metre * way + per_radian * turn


def rolled(settings: Mapping[str, Any], drive: Physical, now: Motion, here: Here) -> Force | None:
    """Speeds over the ground, along [m/s] and in heading [rad/s], that laws add; None without laws."""
    if DISCOVERED not in settings:
        return None
    laws: Laws = settings[DISCOVERED]["laws"]
    more = _if_any(laws, ROLLINGS, lambda: force(drive, _by_wheel(laws, ROLLINGS, drive, now, here)))
    return Force(more.along / drive.rate[0], more.heading / drive.rate[1])


def pushed(settings: Mapping[str, Any], drive: Physical, now: Motion, here: Here) -> Force | None:
    """Accelerations that laws add; None without laws."""
    if DISCOVERED not in settings:
        return None
    laws: Laws = settings[DISCOVERED]["laws"]

    def of_robot() -> Force:
        added = _added(laws, _shared(now, here))
        return Force(_sum(laws, ALONG, added), _sum(laws, HEADING, added))

    wheels = _if_any(laws, (WHEELS, *PUSHES), lambda: force(drive, _by_wheel(laws, PUSHES, drive, now, here)))
    robot = _if_any(laws, (ALONG, HEADING), of_robot)
    return Force(robot.along + wheels.along, robot.heading + wheels.heading)


def _if_any(laws: Laws, acts: tuple[str, ...], what: Callable[[], Any]) -> Any:
    """What laws add to some of ACTS, and 0 where none of them does: most robots' laws act at one place, and what they
    would add elsewhere cost most of a prediction."""
    nothing = jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), jax.eval_shape(what))
    there = jnp.isin(laws.act, jnp.array([list(ACTS).index(act) for act in acts])).any()
    return jax.lax.cond(there, what, lambda: nothing)


def _by_wheel(laws: Laws, acts: tuple[str, ...], drive: Physical, now: Motion, here: Here) -> Wheels:
    """What laws add to both wheels: each its own one of two of ACTS, and with pushes what is added to each push."""
    shared, past, whole = _shared(now, here), remembered(here.past), []
    speeds = wheel_speeds(drive, now.v, now.w)
    for number, (act, n, m) in enumerate(zip(acts, speeds, here.push, strict=True)):
        known = shared | {"own speed": n, "own push": m} | {name: part[number] for name, part in past.items()}
        added = _added(laws, known | {ANGLE: wrap(here.angles)})
        own = _sum(laws, act, here.sure * added)
        whole.append(own + _sum(laws, WHEELS, added) if acts == PUSHES else own)
    return Wheels(*whole)


def sideways(settings: Mapping[str, Any], now: Motion, here: Here) -> Array:
    """The speed to the left [m/s] that laws add; 0 without laws."""
    if DISCOVERED not in settings:
        return 0.0
    laws: Laws = settings[DISCOVERED]["laws"]
    return _if_any(laws, (SIDEWAYS,), lambda: _sum(laws, SIDEWAYS, _added(laws, _shared(now, here))))


def shifted(settings: Mapping[str, Any], pose: Pose, true: Pose) -> Pose:
    """Poses as the camera sees them, with the errors that laws make of the true ones."""
    if DISCOVERED not in settings:
        return pose
    laws: Laws = settings[DISCOVERED]["laws"]
    sine, cosine = sin_cos(true.theta)

    def error() -> tuple[Array, ...]:
        added = _added(laws, {"1": jnp.ones_like(true.x), "heading": wrap(true.theta), "x": true.x, "y": true.y})
        return tuple(_sum(laws, act, added) for act in BY_CAMERA)

    ahead, left, turn = _if_any(laws, BY_CAMERA, error)
    return Pose(pose.x + ahead * cosine - left * sine, pose.y + ahead * sine + left * cosine, pose.theta + turn)


def _shared(now: Motion, here: Here) -> dict[str, Array]:
    """Signals and factors that are the same for both wheels, by name."""
    right, left = here.push
    sine, cosine = sin_cos(now.theta)
    return {"1": jnp.ones_like(now.v), "v": now.v, "w": now.w, "cos heading": cosine, "sin heading": sine,
            "v cos heading": now.v * cosine, "v sin heading": now.v * sine,
            "heading": wrap(now.theta), "x": here.x, "y": here.y, "time": here.time,
            "push right": right, "push left": left, **directions(here.past)}  # fmt: skip


def _added(laws: Laws, known: Mapping[str, Array]) -> Array:
    """times * curve(signal) or surface(signal, second signal) of every law (laws, ...); of laws of other signals than
    the known ones something that is not to be read."""
    times, second_knots = _chosen(laws.times, TIMES, known), jnp.shape(laws.value)[2]
    if second_knots == 1:
        return times * _curve(laws, _chosen(laws.signal, SIGNALS, known))
    first, along = _piece(laws.at, _chosen(laws.signal, SIGNALS, known))
    second, across = _piece(laws.second_at, _chosen(laws.second, SIGNALS, known))
    corner = first * second_knots + second
    here, ahead = (
        _between(_entries(laws.value, place), _entries(laws.value, place + 1), across)
        for place in (corner, corner + second_knots)
    )
    return times * _between(here, ahead, along)


def _chosen(places: Array, names: Collection[str], known: Mapping[str, Array]) -> Array:
    """What is known (laws, ...) by the names at some places (laws,), 0 where nothing is; of angles each law has its
    own."""
    own = {name: value for name, value in known.items() if name != ANGLE}
    shape = jnp.broadcast_shapes(*(jnp.shape(value) for value in own.values()))
    chosen = jnp.stack([jnp.broadcast_to(own.get(name, 0.0), shape) for name in names])[places]
    if ANGLE not in known or ANGLE not in names:
        return chosen
    by_angle = _each(places == list(names).index(ANGLE), chosen[0])
    return jnp.where(by_angle, known[ANGLE], chosen)


def _curve(laws: Laws, signal: Array) -> Array:
    """curve(signal) of every law (laws, ...); of a surface that at its first second knot."""
    lower, along = _piece(laws.at, signal)
    value = laws.value[..., 0]
    return _between(_entries(value, lower), _entries(value, lower + 1), along)


def _piece(at: Array, signal: Array) -> tuple[Array, Array]:
    """Between which of its knots (laws, knots) each signal (laws, ...) is, by the number of the lower one, and how far:
    0 there, 1 at the next. Beyond the knots a signal counts as at the last one.

    Knots below are counted, which needs no search; four values are then picked. A sum over all pieces of a surface took
    seven times as long.
    """
    inner = jnp.asarray(at)[:, 1:-1]
    lower = jnp.sum(signal[:, None] >= jnp.reshape(inner, (*inner.shape, *[1] * (signal.ndim - 1))), axis=1)
    low, high = _entries(at, lower), _entries(at, lower + 1)
    return lower, jnp.clip((signal - low) / (high - low), 0.0, 1.0)


def _entries(table: Array, places: Array) -> Array:
    """Of each law's table (laws, ...) the entries at some places (laws, ...) of its numbers in a row."""
    table = jnp.reshape(jnp.asarray(table), (len(places), -1))
    begin = jnp.arange(len(places)) * table.shape[1]
    return jnp.ravel(table)[jnp.reshape(begin, (-1, *[1] * (places.ndim - 1))) + places]


def _between(low: Array, high: Array, part: Array) -> Array:
    return low + part * (high - low)


def _each(values: Array, like: Array) -> Array:
    """Values (laws, ...) with one axis of length 1 more for each axis of `like`."""
    return jnp.reshape(values, (*jnp.shape(values), *([1] * jnp.ndim(like))))


def _sum(laws: Laws, act: str, values: Array) -> Array:
    """The sum of the values (laws, ...) of those laws that add to one of ACTS."""
    return jnp.sum(jnp.where(_each(laws.act == list(ACTS).index(act), values[0]), values, 0.0), axis=0)

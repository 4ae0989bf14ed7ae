"""Laws that were discovered in logs and stand in no catalogue: a curve of one signal or a surface of two, at one place
of the chain.

    what it adds = times * curve(signal), or times * surface(signal, second signal)

A curve is straight between its knots and constant beyond them; so is a surface along each of its signals. times is 1,
the speed v or the turn rate w: a robot that loses speed in turns has v times a curve of w, and one that is slow on a
patch of carpet has v times a surface of x and y. Both integrators take laws from their settings (`with_laws`), under
one name that no effect of the catalogue has.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array, Pose, Wheels
from jaxident.effects.effect import UNIT
from jaxident.effects.signals import Motion
from jaxident.errors import InputError
from jaxident.numerics import sin_cos, wrap
from jaxident.robot.drive import Force, Physical, force, wheel_speeds
from jaxident.robot.model import Discovered

DISCOVERED = "discovered"
"""The key of laws among the settings of a program."""
MOST_LAWS, MOST_KNOTS, MOST_SECOND = 3, 16, 8
"""Laws of one model, knots of a curve, and knots of a surface along each of its signals. Every set of curves runs
through one compiled program, every set with a surface through another."""
ACTS = {
    "acceleration along": "m/s^2", "acceleration in heading": "rad/s^2", "speed sideways": "m/s",
    "push of each wheel": UNIT, "pose ahead": "m", "pose to the left": "m", "reported heading": "rad",
}  # fmt: skip
"""What a law may add to, and the unit."""
ALONG, HEADING, SIDEWAYS, WHEELS, AHEAD, LEFT, TURN = ACTS
BY_CAMERA = (AHEAD, LEFT, TURN)
SIGNALS = {
    "v": "m/s", "w": "rad/s", "heading": "rad", "x": "m", "y": "m", "time": "s", "push right": UNIT,
    "push left": UNIT, "own speed": UNIT, "own push": UNIT,
}  # fmt: skip
"""What a curve may depend on, and the unit. time: session time. own speed, own push: of the wheel that is pushed; a
wheel's speed is in the commands that hold it."""
OF_CAMERA = ("heading", "x", "y")
"""Signals that a camera's error may depend on."""
TIMES = ("1", "v", "w")


class Laws(NamedTuple):
    """Some laws as arrays: places in ACTS, TIMES and SIGNALS (laws,), knots (laws, knots) and (laws, second knots), and
    values there (laws, knots, second knots). Without surfaces there is one second knot; a curve beside a surface has
    the same values at all of them."""

    act: Any
    times: Any
    signal: Any
    second: Any
    at: Any
    second_at: Any
    value: Any


class Here(NamedTuple):
    """What is held over a substep: position [m], session time [s], and what drives the wheels [unit]."""

    x: Any
    y: Any
    time: Any
    push: Wheels


def value_name(law: int, knot: int) -> str:
    """What a model's covariance calls the value of a law at one of its knots, both counted from 0; knots of a surface
    row by row."""
    return f"{DISCOVERED}.{law + 1}.{knot + 1}"


def knots_by_signal(law: Discovered) -> dict[str, np.ndarray]:
    """Knots of a law's curve by its signal, or of its surface by both."""
    second = {law.second_signal: np.asarray(law.second_at, float)} if law.second_signal else {}
    return {law.signal: np.asarray(law.at, float)} | second


def check_discovered(laws: Sequence[Discovered]) -> None:
    """InputError for laws that no program can run: too many, of an unknown kind, or with knots out of order."""
    if len(laws) > MOST_LAWS:
        raise InputError(f"{len(laws)} discovered laws; at most {MOST_LAWS} are possible")
    for law in laws:
        _check_kind(law)
        knots, most = knots_by_signal(law).values(), MOST_SECOND if law.second_signal else MOST_KNOTS
        for at in knots:
            if not 2 <= len(at) <= most:
                raise InputError(f"discovered: {len(at)} knots; 2 to {most} are possible")
            if not (np.all(np.isfinite(at)) and np.all(np.diff(at) > 0.0)):
                raise InputError("discovered: knots are out of order, or one is not finite")
        shape = tuple(map(len, knots))
        if np.shape(law.value) != shape:
            given, asked = (" x ".join(map(str, each)) for each in (np.shape(law.value), shape))
            raise InputError(f"discovered: {asked} knots and {given} values; as many are needed")
        if not np.all(np.isfinite(law.value)):
            raise InputError("discovered: a value is not finite")


def _check_kind(law: Discovered) -> None:
    choices = (("acts_on", law.acts_on, ACTS), ("times", law.times, TIMES), ("signal", law.signal, SIGNALS),
               ("second_signal", law.second_signal, ("", *SIGNALS)))  # fmt: skip
    for key, value, known in choices:
        if value not in known:
            raise InputError(f"discovered: {key} is {value!r}; known are {', '.join(known)}")
    signals = {law.signal, law.second_signal} - {""}
    by_camera, own = law.acts_on in BY_CAMERA, any(signal.startswith("own ") for signal in signals)
    if by_camera and (not signals <= set(OF_CAMERA) or law.times != "1"):
        raise InputError(f"discovered: an error of the camera is 1 times a curve of {' or '.join(OF_CAMERA)}")
    if own != (law.acts_on == WHEELS) or (own and (law.times != "1" or law.second_signal)):
        raise InputError("discovered: a push of each wheel is 1 times a curve of the wheel's own speed or push")
    if law.signal == law.second_signal:
        raise InputError(f"discovered: a surface of {law.signal} and {law.signal}; two signals are needed")


IDLE = Discovered(ALONG, "1", "v", np.arange(2.0), np.zeros(2))
"""A law that does nothing: that of a robot without any in a program that runs laws."""


def laws_of(laws: Sequence[Discovered], largest: float = 1.0, surfaces: bool | None = None) -> Laws | None:
    """Laws as arrays, for commands over `largest`, filled up with some that do nothing; None of none. surfaces: whether
    there is room for surfaces; by default, whether one of the laws is one."""
    if not laws:
        return None
    laws = [*(scaled(law, 1.0 / largest) for law in laws), *[IDLE] * (MOST_LAWS - len(laws))]
    wide = any(law.second_signal for law in laws) if surfaces is None else surfaces
    names = list(SIGNALS)
    codes = [(list(ACTS).index(law.acts_on), TIMES.index(law.times), names.index(law.signal),
              names.index(law.second_signal or law.signal)) for law in laws]  # fmt: skip
    rows = [_padded(law, MOST_SECOND if wide else 1) for law in laws]
    return Laws(*np.array(codes).T, *(np.stack(column) for column in zip(*rows, strict=True)))


def scaled(law: Discovered, factor: float) -> Discovered:
    """The law for commands that are `factor` times as large."""

    def by(unit: str) -> float:
        return factor if unit == UNIT else 1.0

    up = by(ACTS[law.acts_on])
    spread = None if law.standard_deviation is None else up * np.asarray(law.standard_deviation)
    second = by(SIGNALS[law.second_signal]) * np.asarray(law.second_at, float) if law.second_signal else None
    return dataclasses.replace(
        law, at=by(SIGNALS[law.signal]) * np.asarray(law.at, float), value=up * np.asarray(law.value, float),
        standard_deviation=spread, second_at=second,
    )  # fmt: skip


def _padded(law: Discovered, second: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """MOST_KNOTS knots, so many second knots, and values (knots, second knots), the last repeated beyond the last."""
    at, second_at = np.asarray(law.at), np.arange(1.0) if law.second_at is None else np.asarray(law.second_at)
    value = np.asarray(law.value).reshape(len(at), len(second_at))
    more = (MOST_KNOTS - len(at), second - len(second_at))
    return _longer(at, more[0]), _longer(second_at, more[1]), np.pad(value, [(0, n) for n in more], mode="edge")


def _longer(at: Array, more: int) -> np.ndarray:
    """Knots with some more beyond the last."""
    return np.concatenate([at, at[-1] + (1.0 + np.arange(more)) * (np.ptp(at) or 1.0)])


def with_laws(settings: Mapping[str, Any], laws: Laws | None) -> Mapping[str, Any]:
    """Settings of a program that obeys some laws, too."""
    return settings if laws is None else {**settings, DISCOVERED: {"laws": laws}}


def pushed(settings: Mapping[str, Any], drive: Physical, now: Motion, here: Here) -> Force | None:
    """Accelerations that laws add; None without laws."""
    if DISCOVERED not in settings:
        return None
    laws: Laws = settings[DISCOVERED]["laws"]
    by_speed = _each(laws.signal == list(SIGNALS).index("own speed"), now.v)
    own = [jnp.where(by_speed, n, m) for n, m in zip(wheel_speeds(drive, now.v, now.w), here.push, strict=True)]
    right, left = (_piecewise(laws.at, laws.value[..., 0], signal) for signal in own)  # no surface is a wheel's own
    wheels = force(drive, Wheels(_sum(laws, WHEELS, right), _sum(laws, WHEELS, left)))
    whole = _added(laws, now, here) * _factor(laws, now)
    return Force(_sum(laws, ALONG, whole) + wheels.along, _sum(laws, HEADING, whole) + wheels.heading)


def sideways(settings: Mapping[str, Any], now: Motion, here: Here) -> Array:
    """The speed to the left [m/s] that laws add; 0 without laws."""
    if DISCOVERED not in settings:
        return 0.0
    laws: Laws = settings[DISCOVERED]["laws"]
    return _sum(laws, SIDEWAYS, _added(laws, now, here) * _factor(laws, now))


def shifted(settings: Mapping[str, Any], pose: Pose, true: Pose) -> Pose:
    """Poses as the camera sees them, with the errors that laws make of the true ones."""
    if DISCOVERED not in settings:
        return pose
    laws: Laws = settings[DISCOVERED]["laws"]
    sine, cosine = sin_cos(true.theta)
    still = jnp.zeros_like(true.x)
    here = Here(true.x, true.y, still, Wheels(still, still))
    error = _added(laws, Motion(still, still, true.theta), here)
    ahead, left, turn = (_sum(laws, act, error) for act in BY_CAMERA)
    return Pose(pose.x + ahead * cosine - left * sine, pose.y + ahead * sine + left * cosine, pose.theta + turn)


def _added(laws: Laws, now: Motion, here: Here) -> Array:
    """curve(signal) or surface(signal, second signal) of every law (laws, ...); those of a wheel's own speed or push
    differ by wheel (`pushed`), and are not to be read here."""
    still = jnp.zeros_like(now.v)
    signals = (now.v, now.w, wrap(now.theta), here.x, here.y, here.time, *here.push, still, still)
    known = jnp.stack([jnp.broadcast_to(signal, still.shape) for signal in signals])
    along_second = _piecewise(laws.at, laws.value, known[laws.signal][:, None])
    return _piecewise(laws.second_at, along_second, known[laws.second])


def _piecewise(at: Array, value: Array, signal: Array) -> Array:
    """Values (laws, knots, ...) between their knots (laws, knots), at a signal (laws, ...).

    The sum over the pieces between knots, each as far as the signal has come through it: no search and no loop, which
    would take minutes to compile within the loop over rows.
    """
    at, value, like = jnp.asarray(at), jnp.asarray(value), signal[:, None]
    value = jnp.reshape(value, (*value.shape, *[1] * (like.ndim - value.ndim)))
    at = jnp.reshape(at, (*at.shape, *[1] * (like.ndim - at.ndim)))
    slope, low = jnp.diff(value, axis=1) / jnp.diff(at, axis=1), at[:, :-1]
    return value[:, 0] + jnp.sum(slope * (jnp.clip(like, low, at[:, 1:]) - low), axis=1)


def _factor(laws: Laws, now: Motion) -> Array:
    """1, v or w of every law (laws, ...)."""
    return jnp.stack([jnp.ones_like(now.v), now.v, now.w])[laws.times]


def _each(values: Array, like: Array) -> Array:
    """Values (laws, ...) with one axis of length 1 more for each axis of `like`."""
    return jnp.reshape(values, (*jnp.shape(values), *([1] * jnp.ndim(like))))


def _sum(laws: Laws, act: str, values: Array) -> Array:
    """The sum of the values (laws, ...) of those laws that add to one of ACTS."""
    return jnp.sum(jnp.where(_each(laws.act == list(ACTS).index(act), values[0]), values, 0.0), axis=0)

"""Laws that were discovered in logs and stand in no catalogue: a curve of one signal, at one place of the chain.

    what it adds = times * curve(signal)

The curve is straight between its knots and constant beyond them. times is 1, the speed v or the turn rate w: a robot
that loses speed in turns has v times a curve of w. Both integrators take laws from their settings (`with_laws`), under
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
MOST_LAWS, MOST_KNOTS = 3, 16
"""Of one model: every set of laws runs through one compiled program."""
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
    """Some laws as arrays: places in ACTS, TIMES and SIGNALS (laws,), knots and values there (laws, knots)."""

    act: Any
    times: Any
    signal: Any
    at: Any
    value: Any


class Here(NamedTuple):
    """What is held over a substep: position [m], session time [s], and what drives the wheels [unit]."""

    x: Any
    y: Any
    time: Any
    push: Wheels


def value_name(law: int, knot: int) -> str:
    """What a model's covariance calls the value of a law at one of its knots, both counted from 0."""
    return f"{DISCOVERED}.{law + 1}.{knot + 1}"


def check_discovered(laws: Sequence[Discovered]) -> None:
    """InputError for laws that no program can run: too many, of an unknown kind, or with knots out of order."""
    if len(laws) > MOST_LAWS:
        raise InputError(f"{len(laws)} discovered laws; at most {MOST_LAWS} are possible")
    for law in laws:
        choices = (("acts_on", law.acts_on, ACTS), ("times", law.times, TIMES), ("signal", law.signal, SIGNALS))
        for key, value, known in choices:
            if value not in known:
                raise InputError(f"discovered: {key} is {value!r}; known are {', '.join(known)}")
        by_camera, own = law.acts_on in BY_CAMERA, law.signal.startswith("own ")
        if by_camera and (law.signal not in OF_CAMERA or law.times != "1"):
            raise InputError(f"discovered: an error of the camera is 1 times a curve of {' or '.join(OF_CAMERA)}")
        if own != (law.acts_on == WHEELS) or (own and law.times != "1"):
            raise InputError("discovered: a push of each wheel is 1 times a curve of the wheel's own speed or push")
        at = np.asarray(law.at, float)
        if not 2 <= len(at) <= MOST_KNOTS:
            raise InputError(f"discovered: {len(at)} knots; 2 to {MOST_KNOTS} are possible")
        if np.shape(law.value) != np.shape(at):
            raise InputError(f"discovered: {len(at)} knots and {np.size(law.value)} values; as many are needed")
        if not (np.all(np.isfinite(at)) and np.all(np.isfinite(law.value)) and np.all(np.diff(at) > 0.0)):
            raise InputError("discovered: knots are out of order, or a number is not finite")


IDLE = Discovered(ALONG, "1", "v", np.arange(2.0), np.zeros(2))
"""A law that does nothing: that of a robot without any in a program that runs laws."""


def laws_of(laws: Sequence[Discovered], largest: float = 1.0) -> Laws | None:
    """Laws as arrays, for commands over `largest`, filled up with some that do nothing; None of none."""
    if not laws:
        return None
    count = MOST_LAWS - len(laws)
    rows = [_padded(scaled(law, 1.0 / largest)) for law in laws]
    codes = np.array(
        [(list(ACTS).index(law.acts_on), TIMES.index(law.times), list(SIGNALS).index(law.signal)) for law in laws]
        + [(0, 0, 0)] * count
    )
    idle = np.arange(MOST_KNOTS, dtype=float), np.zeros(MOST_KNOTS)
    at, value = (np.stack(column) for column in zip(*rows, *[idle] * count, strict=True))
    act, times, signal = codes.T
    return Laws(act, times, signal, at, value)


def scaled(law: Discovered, factor: float) -> Discovered:
    """The law for commands that are `factor` times as large."""
    along, up = (factor if unit == UNIT else 1.0 for unit in (SIGNALS[law.signal], ACTS[law.acts_on]))
    spread = None if law.standard_deviation is None else up * np.asarray(law.standard_deviation)
    return dataclasses.replace(
        law, at=along * np.asarray(law.at, float), value=up * np.asarray(law.value, float), standard_deviation=spread
    )


def _padded(law: Discovered) -> tuple[np.ndarray, np.ndarray]:
    """MOST_KNOTS knots and values, the last value repeated beyond the last knot."""
    at, value = law.at, law.value
    more = MOST_KNOTS - len(at)
    beyond = at[-1] + (1.0 + np.arange(more)) * (at[-1] - at[0])
    return np.concatenate([at, beyond]), np.concatenate([value, np.full(more, value[-1])])


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
    whole, right, left = (_curves(laws, signal) for signal in (_signal(laws, now, here), *own))
    wheels = force(drive, Wheels(_sum(laws, WHEELS, right), _sum(laws, WHEELS, left)))
    whole = whole * _factor(laws, now)
    return Force(_sum(laws, ALONG, whole) + wheels.along, _sum(laws, HEADING, whole) + wheels.heading)


def sideways(settings: Mapping[str, Any], now: Motion, here: Here) -> Array:
    """The speed to the left [m/s] that laws add; 0 without laws."""
    if DISCOVERED not in settings:
        return 0.0
    laws: Laws = settings[DISCOVERED]["laws"]
    return _sum(laws, SIDEWAYS, _curves(laws, _signal(laws, now, here)) * _factor(laws, now))


def shifted(settings: Mapping[str, Any], pose: Pose, true: Pose) -> Pose:
    """Poses as the camera sees them, with the errors that laws make of the true ones."""
    if DISCOVERED not in settings:
        return pose
    laws: Laws = settings[DISCOVERED]["laws"]
    sine, cosine = sin_cos(true.theta)
    still = jnp.zeros_like(true.x)
    here = Here(true.x, true.y, still, Wheels(still, still))
    error = _curves(laws, _signal(laws, Motion(still, still, true.theta), here))
    ahead, left, turn = (_sum(laws, act, error) for act in BY_CAMERA)
    return Pose(pose.x + ahead * cosine - left * sine, pose.y + ahead * sine + left * cosine, pose.theta + turn)


def _curves(laws: Laws, signal: Array) -> Array:
    """curve(signal) of every law; signal (laws, ...).

    The sum over the pieces between knots, each as far as the signal has come through it: no search and no loop, which
    would take minutes to compile within the loop over rows.
    """
    at, value = jnp.asarray(laws.at), jnp.asarray(laws.value)
    slope = jnp.diff(value, axis=1) / jnp.diff(at, axis=1)
    low, high, rise = (_each(column, signal[0]) for column in (at[:, :-1], at[:, 1:], slope))
    return _each(value[:, 0], signal[0]) + jnp.sum(rise * (jnp.clip(signal[:, None], low, high) - low), axis=1)


def _signal(laws: Laws, now: Motion, here: Here) -> Array:
    """The signal of every law (laws, ...); 0 for signals of a wheel's own, which differ by wheel (`pushed`)."""
    still = jnp.zeros_like(now.v)
    signals = (now.v, now.w, wrap(now.theta), here.x, here.y, here.time, *here.push, still, still)
    return jnp.stack([jnp.broadcast_to(signal, still.shape) for signal in signals])[laws.signal]


def _factor(laws: Laws, now: Motion) -> Array:
    """1, v or w of every law (laws, ...)."""
    return jnp.stack([jnp.ones_like(now.v), now.v, now.w])[laws.times]


def _each(values: Array, like: Array) -> Array:
    """Values (laws, ...) with one axis of length 1 more for each axis of `like`."""
    return jnp.reshape(values, (*jnp.shape(values), *([1] * jnp.ndim(like))))


def _sum(laws: Laws, act: str, values: Array) -> Array:
    """The sum of the values (laws, ...) of those laws that add to one of ACTS."""
    return jnp.sum(jnp.where(_each(laws.act == list(ACTS).index(act), values[0]), values, 0.0), axis=0)

"""Laws that could be discovered in some logs, and how the poses answer to each piece of their curves.

A curve is a sum of hats, one at each knot; a surface one of products of hats, row by row. Columns are answers of the
poses to these, linear about a fitted path.
"""

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import jax
import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.fit.refit import Solution
from jaxident.diagnosis.laws.kinds import Kind
from jaxident.diagnosis.motion.linear import motion_of
from jaxident.diagnosis.motion.paths import left_behind
from jaxident.diagnosis.motion.responses import Responses
from jaxident.diagnosis.motion.windows import Windows, with_room
from jaxident.effects.coordinates import natural
from jaxident.effects.law_kinds import (
    AHEAD,
    ALONG,
    ANGLE,
    BY_CAMERA,
    HEADING,
    LEFT,
    OF_ONE_WHEEL,
    PUSHES,
    ROLLINGS,
    SIDEWAYS,
    TURN,
    WHEELS,
    directions,
    remembered,
)
from jaxident.estimation.poses.ways import way_and_turn

_left_behind = jax.jit(left_behind)
KNOTS = 10
"""Of a curve. No other number was tried."""
SURFACE_KNOTS = 8
"""Of a surface along each of its signals, one less than a program has room for (`ahead.parameter_spread`). No other
number was tried."""
INSIDE = (0.01, 0.99)
"""Quantiles of a signal between which its knots lie. No others were tried."""
VARIED = 1e-6
"""A signal that spans less than this, in its own unit, tells no curve. No other value was tried."""


class Path(NamedTuple):
    """Signals (windows, rows) along the path of a fit, and those of each wheel's own (windows, rows, 2); gain (2, 2)
    and rates (2,) of the nominal drive; seen (windows, numbers). way [m] and turn [rad] since the run began, and the
    time step [s] (windows, rows)."""

    signals: dict[str, Any]
    own: dict[str, Any]
    gain: Any
    rates: Any
    seen: Any
    way: Any
    turn: Any
    step: Any


class Turning(NamedTuple):
    """What a law goes by that comes once per turn of something on a wheel: `Discovered.period` and `half_track` [m],
    the angle [rad] of the wheel when its run begins, as each window has it (windows,); the power of the pattern that
    was found, and how much of it the best of so many has by chance."""

    period: float
    half_track: float
    phase: Any
    power: float
    by_chance: float


class Candidate(NamedTuple):
    """A kind of law, the knots of each of its signals, and answers of the poses to a unit at each knot (windows,
    numbers, knots); density: rows that lie nearest to each. Knots of a surface stand row by row. turning: of a law that
    goes by the angle of a wheel."""

    kind: Kind
    at: tuple[Any, ...]
    columns: Any
    density: Any
    turning: Turning | None = None


def path_of(fit: Solution, windows: Windows) -> Path:
    """The signals along the path of a fit."""
    motion = motion_of(fit.vector, fit.starts, windows)
    x, y, theta, v, w, push = (np.asarray(part) for part in motion)
    rates, gain = np.exp(fit.vector[:2]), natural(fit.vector)[2:6].reshape(2, 2)
    speeds = np.stack([rates[0] * v, rates[1] * w], axis=-1) @ np.linalg.pinv(gain).T
    step, past = np.asarray(windows.step).T, _left_behind(with_room(windows._replace(laws=None)))
    past = jax.tree.map(lambda part: np.asarray(part)[..., : len(step)], past)
    begin = windows.session[windows.run] + windows.t[windows.first, windows.run]
    time = begin[:, None] + np.cumsum(step, axis=1) - step
    heading = (theta + np.pi) % (2.0 * np.pi) - np.pi
    signals = {"1": np.ones_like(v), "v": v, "w": w, "heading": heading, "x": x, "y": y, "time": time,
               "push right": push[..., 0], "push left": push[..., 1],
               "cos heading": np.cos(theta), "sin heading": np.sin(theta), "v cos heading": v * np.cos(theta),
               "v sin heading": v * np.sin(theta)}  # fmt: skip
    signals |= {name: np.asarray(part).T for name, part in directions(past, axis=1).items()}
    own = {"1": np.ones_like(push), "own speed": speeds, "own push": push}
    own |= {name: np.asarray(part).transpose(2, 0, 1) for name, part in remembered(past, axis=1).items()}
    seen = np.repeat(np.asarray(windows.seen).T, 3, axis=1)
    way, turn = (begin[:, None] + since for begin, since in zip(windows.way, way_and_turn(x, y, theta), strict=True))
    return Path(signals, own, gain, rates, seen, way, turn, step)


def candidates(path: Path, responses: Responses, kinds: Iterable[Kind]) -> Iterator[Candidate]:
    """Laws of some kinds about a path, if their signals vary; those that go by the angle of a wheel left out."""
    for kind in kinds:
        if kind.signal == ANGLE:
            continue
        signals = _signals(kind, path)
        ranges = [np.quantile(signal, INSIDE) for signal in signals]
        if all(high - low > VARIED for low, high in ranges):
            at = tuple(np.linspace(low, high, SURFACE_KNOTS if kind.second_signal else KNOTS) for low, high in ranges)
            density = _nearest(signals, at)
            yield Candidate(kind, at, columns_of(kind, at, path, responses), density)


def of_wheel(kind: Kind, turning: Turning, path: Path, responses: Responses) -> Candidate:
    """A law of a kind that goes by the angle of a wheel."""
    at = (np.linspace(-np.pi, np.pi, KNOTS),)
    columns = columns_of(kind, at, path, responses, turning)
    return Candidate(kind, at, columns, _nearest(_signals(kind, path, turning), at), turning)


def cosine_of(kind: Kind, turning: Turning, path: Path, responses: Responses) -> np.ndarray:
    """Answers of the poses (windows, numbers) to the cosine of a wheel's angle in the place of a law's curve."""
    return answers_of(kind, np.cos(_angle(turning, path))[..., None], path, responses)[..., 0]


def _angle(turning: Turning, path: Path) -> np.ndarray:
    """The angle of a wheel (windows, rows) in [-pi, pi)."""
    turns = (path.way + turning.half_track * path.turn) / turning.period
    angle = turning.phase[:, None] + 2.0 * np.pi * turns
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def _signals(kind: Kind, path: Path, turning: Turning | None = None) -> list[np.ndarray]:
    """What a law depends on, one or two."""
    if turning is not None:
        return [_angle(turning, path)]
    names = [name for name in (kind.signal, kind.second_signal) if name]
    if kind.acts_on == WHEELS:
        both = {name: np.stack([signal] * 2, axis=-1) for name, signal in path.signals.items() if name in names}
        return [(path.own | both)[name] for name in names]
    return [path.signals[name] for name in names]


def _nearest(signals: list[np.ndarray], at: tuple[Any, ...]) -> np.ndarray:
    """Rows that lie nearest to each knot."""
    place = 0
    for signal, knots in zip(signals, at, strict=True):
        place = place * len(knots) + np.abs(signal.ravel()[:, None] - knots).argmin(axis=1)
    return np.bincount(place, minlength=int(np.prod([len(knots) for knots in at])))


def columns_of(
    kind: Kind, at: tuple[Any, ...], path: Path, responses: Responses, turning: Turning | None = None
) -> np.ndarray:
    """Answers of the poses (windows, numbers, knots) to a unit at each knot of a law."""
    signals = _signals(kind, path, turning)
    shape = hats(signals[0], at[0])
    for signal, knots in zip(signals[1:], at[1:], strict=True):
        shape = (shape[..., :, None] * hats(signal, knots)[..., None, :]).reshape(*signal.shape, -1)
    return answers_of(kind, shape, path, responses)


def answers_of(kind: Kind, shape: Array, path: Path, responses: Responses) -> np.ndarray:
    """Answers of the poses (windows, numbers, n) to some curves or surfaces (windows, rows, n; for both wheels at once
    rows, 2, n) in the place of a law's."""
    if kind.acts_on in OF_ONE_WHEEL:
        return _by_one_wheel(kind, shape, path, responses)
    if kind.acts_on == WHEELS:
        shape = shape * path.own[kind.times][..., None]
        along, heading = (np.einsum("wrsk,s->wrk", shape, row) for row in path.gain)
        return responses.along @ along + responses.heading @ heading
    shape = shape * path.signals[kind.times][..., None]
    if kind.acts_on in BY_CAMERA:
        return _by_camera(kind.acts_on, shape, path)
    answer = {ALONG: responses.along, HEADING: responses.heading, SIDEWAYS: responses.left}[kind.acts_on]
    return answer @ shape


def _by_one_wheel(kind: Kind, shape: Array, path: Path, responses: Responses) -> np.ndarray:
    """Answers of the poses to a push of one wheel, or to its rolling faster over the ground: a speed that is added to
    the robot's is an acceleration of as much, and of the rate times as much against the drive."""
    rolls = kind.acts_on in ROLLINGS
    wheel = (ROLLINGS if rolls else PUSHES).index(kind.acts_on)
    shape = shape * path.own[kind.times][..., wheel, None]
    gain = path.gain[:, wheel]
    if not rolls:
        return responses.along @ (gain[0] * shape) + responses.heading @ (gain[1] * shape)
    change = np.diff(shape, axis=1, append=shape[:, -1:]) / path.step[..., None]
    along, heading = (g * (change / rate + shape) for g, rate in zip(gain, path.rates, strict=True))
    return responses.along @ along + responses.heading @ heading


def _by_camera(act: str, shape: Array, path: Path) -> np.ndarray:
    """Answers of the poses to an error of the camera (windows, rows, knots)."""
    sine, cosine = np.sin(path.signals["heading"]), np.cos(path.signals["heading"])
    none, one = np.zeros_like(sine), np.ones_like(sine)
    by_pose = {AHEAD: (cosine, sine, none), LEFT: (-sine, cosine, none), TURN: (none, none, one)}[act]
    whole = np.stack([part[..., None] * shape for part in by_pose], axis=2)
    return path.seen[..., None] * whole.reshape(len(shape), -1, shape.shape[2])


def hats(signal: Array, at: Array) -> np.ndarray:
    """Weights (..., knots) of even knots (knots,) in a curve that is straight between them and constant beyond."""
    place = np.clip((signal - at[0]) / (at[1] - at[0]), 0.0, len(at) - 1.0)
    return np.maximum(1.0 - np.abs(place[..., None] - np.arange(len(at))), 0.0)

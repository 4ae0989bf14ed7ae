"""Laws that could be discovered: where they act, what they depend on, and how the poses answer to each piece of curve.

A curve is a sum of hats, one at each knot; a surface one of products of hats, row by row. Columns are answers of the
poses to these, linear about a fitted path.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.fit.refit import Solution
from jaxident.diagnosis.motion.linear import motion_of
from jaxident.diagnosis.motion.paths import left_behind
from jaxident.diagnosis.motion.responses import Responses
from jaxident.diagnosis.motion.windows import Windows
from jaxident.effects.discovered import Laws
from jaxident.effects.law_kinds import AHEAD, ALONG, BY_CAMERA, HEADING, HEATS, LEFT, SIDEWAYS, TURN, WHEELS

KNOTS = 10
"""Of a curve. No other number was tried."""
SECOND_KNOTS = 8
"""Of a surface along each of its signals. No other number was tried."""
INSIDE = (0.01, 0.99)
"""Quantiles of a signal between which its knots lie. No others were tried."""
VARIED = 1e-6
"""A signal that spans less than this, in its own unit, tells no curve. No other value was tried."""
OF_FORCE = ("v", "w", "heading", "x", "y", "time", "push right", "push left", "since reversal")
ELSEWHERE = ("heading", "x", "y", "time", "since reversal")
"""Of what is no speed."""
SITE_OF_SIGNAL = {
    "v": "drive", "w": "drive", "heading": "contact", "x": "contact", "y": "contact", "time": "time",
    "push right": "actuation", "push left": "actuation", "since reversal": "contact", "own speed": "drive",
    "own push": "actuation", **dict.fromkeys(HEATS, "actuation"),
}  # fmt: skip
"""The site of a law that acts on accelerations or pushes, by its signal."""


NOMINAL = ("v", "w", "push right", "push left", "own speed", "own push")
"""Signals on which a force of the nominal robot depends, in a straight line."""
FLOOR = ((ALONG, "1"), (ALONG, "v"), (ALONG, "cos heading"), (ALONG, "sin heading"), (HEADING, "1"), (HEADING, "w"),
         (SIDEWAYS, "v"), (TURN, "1"))  # fmt: skip
"""What may differ from place to place on the floor: a pull, rolling, the slope along x and along y, twist, turning,
drift, and the camera's heading."""


class Kind(NamedTuple):
    """Where a law acts, what its curve or surface is multiplied with, and what this depends on."""

    acts_on: str
    times: str
    signal: str
    second_signal: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """As an effect's record says in whose place it acts (`EffectRecord.kinds`)."""
        return tuple(filter(None, self))

    @property
    def site(self) -> str:
        """The site of the catalogue that such a law belongs to."""
        if self.acts_on in BY_CAMERA:
            return "camera"
        return "contact" if self.acts_on == SIDEWAYS else SITE_OF_SIGNAL[self.signal]


KINDS = (
    *(Kind(act, "1", signal) for act in (ALONG, HEADING) for signal in OF_FORCE),
    *(Kind(act, "v", signal) for act in (ALONG, HEADING) for signal in ("w", *ELSEWHERE)),
    *(Kind(act, "w", signal) for act in (ALONG, HEADING) for signal in ("v", *ELSEWHERE)),
    *(Kind(SIDEWAYS, "v", signal) for signal in ("w", "heading", "x", "y", "time")),
    *(Kind(SIDEWAYS, "1", signal) for signal in ("w", "heading")),
    *(Kind(WHEELS, "1", signal) for signal in ("own speed", "own push")),
    *(Kind(WHEELS, "own push", signal) for signal in HEATS),
    *(Kind(act, "1", signal) for act in (AHEAD, LEFT, TURN) for signal in ("heading", "x", "y")),
    *(Kind(act, times, "x", "y") for act, times in FLOOR),
    *(Kind(act, "1", *pair) for act in (ALONG, HEADING) for pair in (("v", "w"), ("push right", "push left"))),
)
"""All that are tried. What stands as a product in two of them (v times a curve of w, w times one of v) stands twice."""


class Path(NamedTuple):
    """Signals (windows, rows) along the path of a fit, and by wheel those of its own (windows, rows, 2); gain (2, 2) of
    the nominal drive; heading (windows, rows); seen (windows, numbers)."""

    signals: dict[str, Any]
    own: dict[str, Any]
    gain: Any
    seen: Any


class Candidate(NamedTuple):
    """A kind of law, the knots of each of its signals, and answers of the poses to a unit at each knot (windows,
    numbers, knots); density: rows that lie nearest to each. Knots of a surface stand row by row."""

    kind: Kind
    at: tuple[Any, ...]
    columns: Any
    density: Any


def path_of(fit: Solution, windows: Windows, laws: Laws | None = None) -> Path:
    """The signals along the path of a fit with some laws."""
    motion = motion_of(fit.vector, fit.starts, windows, laws)
    x, y, theta, v, w, push = (np.asarray(part) for part in motion)
    rates, gain = np.exp(fit.vector[:2]), fit.vector[2:6].reshape(2, 2)
    speeds = np.stack([rates[0] * v, rates[1] * w], axis=-1) @ np.linalg.pinv(gain).T
    step, past = np.asarray(windows.step).T, left_behind(windows)
    begin = windows.session[windows.run] + windows.t[windows.first, windows.run]
    time = begin[:, None] + np.cumsum(step, axis=1) - step
    heading = (theta + np.pi) % (2.0 * np.pi) - np.pi
    signals = {"1": np.ones_like(v), "v": v, "w": w, "heading": heading, "x": x, "y": y, "time": time,
               "push right": push[..., 0], "push left": push[..., 1],
               "since reversal": np.asarray(past.since).T, "cos heading": np.cos(theta),
               "sin heading": np.sin(theta)}  # fmt: skip
    own = {"1": np.ones_like(push), "own speed": speeds, "own push": push}
    own |= dict(zip(HEATS, np.asarray(past.heat).transpose(1, 3, 0, 2), strict=True))
    seen = np.repeat(np.asarray(windows.seen).T, 3, axis=1)
    return Path(signals, own, gain, seen)


def at_knots(at: tuple[Any, ...]) -> list[np.ndarray]:
    """Each signal (knots,) at all knots of a law, row by row."""
    return [signal.ravel() for signal in np.meshgrid(*at, indexing="ij")]


def nominal_part(kind: Kind, at: tuple[Any, ...]) -> np.ndarray:
    """Values (knots, n) of laws that the nominal robot has itself: rates, couplings and gains."""
    signals = dict(zip(kind.names[2:], at_knots(at), strict=True))
    count = int(np.prod([len(knots) for knots in at]))
    if kind.acts_on not in (ALONG, HEADING, WHEELS):
        return np.zeros((count, 0))
    if kind.times != "1":
        return np.ones((count, int(kind.times in ("v", "w", "own push"))))
    return np.stack([np.zeros(count), *(s for name, s in signals.items() if name in NOMINAL)], axis=1)[:, 1:]


def candidates(path: Path, responses: Responses) -> Iterator[Candidate]:
    """Every kind of law whose signals vary, about a path."""
    for kind in KINDS:
        signals = _signals(kind, path)
        ranges = [np.quantile(signal, INSIDE) for signal in signals]
        if all(high - low > VARIED for low, high in ranges):
            at = tuple(np.linspace(low, high, SECOND_KNOTS if kind.second_signal else KNOTS) for low, high in ranges)
            density = _nearest(signals, at)
            yield Candidate(kind, at, columns_of(kind, at, path, responses), density)


def _signals(kind: Kind, path: Path) -> list[np.ndarray]:
    """What a law depends on, one or two."""
    if kind.acts_on == WHEELS:
        return [path.own[kind.signal]]
    return [path.signals[name] for name in (kind.signal, kind.second_signal) if name]


def _nearest(signals: list[np.ndarray], at: tuple[Any, ...]) -> np.ndarray:
    """Rows that lie nearest to each knot."""
    place = 0
    for signal, knots in zip(signals, at, strict=True):
        place = place * len(knots) + np.abs(signal.ravel()[:, None] - knots).argmin(axis=1)
    return np.bincount(place, minlength=int(np.prod([len(knots) for knots in at])))


def columns_of(kind: Kind, at: tuple[Any, ...], path: Path, responses: Responses) -> np.ndarray:
    """Answers of the poses (windows, numbers, knots) to a unit at each knot of a law."""
    signals = _signals(kind, path)
    shape = hats(signals[0], at[0])
    if kind.acts_on == WHEELS:
        shape = shape * path.own[kind.times][..., None]
        along, heading = (np.einsum("wrsk,s->wrk", shape, row) for row in path.gain)
        return responses.along @ along + responses.heading @ heading
    for signal, knots in zip(signals[1:], at[1:], strict=True):
        shape = (shape[..., :, None] * hats(signal, knots)[..., None, :]).reshape(*signal.shape, -1)
    shape = shape * path.signals[kind.times][..., None]
    if kind.acts_on in BY_CAMERA:
        return _by_camera(kind.acts_on, shape, path)
    answer = {ALONG: responses.along, HEADING: responses.heading, SIDEWAYS: responses.left}[kind.acts_on]
    return answer @ shape


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

"""What a discovered curve or surface looks like: the simple form that explains most of it, where the robot has been."""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.laws.kinds import Kind, at_knots, nominal_part
from jaxident.effects.law_kinds import ANGLE, REVERSALS, knots_by_signal
from jaxident.robot.model import Discovered

LIKE = 0.8
"""Part of a curve that a form has to explain before it is told. No other value was tried."""
SIMPLER = 0.01
"""By which a form further down the list has to explain more. No other value was tried."""
BENDS = np.linspace(0.1, 0.9, 17)
"""Places of a bend or a step that are tried, as parts of the range of a signal."""

ROUND = ("c sin(s)", "c cos(s)", "c sin(2 s)", "c cos(2 s)")
"""Forms of an angle."""
Forms = dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]]
SHAPES: Forms = {
    "c": lambda s, _: np.ones_like(s),
    "c s": lambda s, _: s,
    "c |s|": lambda s, _: np.abs(s),
    "c s^2": lambda s, _: s**2,
    "c s |s|": lambda s, _: s * np.abs(s),
    "c s^3": lambda s, _: s**3,
    "c sign(s)": lambda s, _: np.tanh(s / (0.05 * np.ptp(s))),
    "c sin(s)": lambda s, _: np.sin(s),
    "c cos(s)": lambda s, _: np.cos(s),
    "c sin(2 s)": lambda s, _: np.sin(2.0 * s),
    "c cos(2 s)": lambda s, _: np.cos(2.0 * s),
}
"""Forms of a signal s with one factor c."""
BENT: Forms = {
    "c max(s - s0, 0)": lambda s, s0: np.maximum(s - s0, 0.0),
    "c max(s0 - s, 0)": lambda s, s0: np.maximum(s0 - s, 0.0),
    "c max(|s| - s0, 0)": lambda s, s0: np.maximum(np.abs(s) - s0, 0.0),
    # a step is as wide as the knots are apart
    "c from s0 on": lambda s, s0: np.clip((s - s0) / (s[1] - s[0]) + 0.5, 0.0, 1.0),
    "c exp(-s / s0)": lambda s, s0: np.exp(-s / s0),
}
"""Forms that begin at some s0."""
ONLY_OF = {**dict.fromkeys(ROUND, ("heading", ANGLE)), "c exp(-s / s0)": tuple(REVERSALS)}
"""Forms of some signals alone."""
PRODUCTS: Forms = {
    "c s t": lambda s, t: s * t,
    "c |s| t": lambda s, t: np.abs(s) * t,
    "c s |t|": lambda s, t: s * np.abs(t),
    "c |s t|": lambda s, t: np.abs(s * t),
}
"""Forms of two signals s and t."""
SLOPES: Forms = {"c s": lambda s, _: s, "c t": lambda _, t: t}
"""Forms of a place on the floor, beside PATCH."""
PATCH = "c within a circle"
"""Around a place on the floor: centre and radius [m]."""


class Form(NamedTuple):
    """A form, its numbers, and the part of the curve or surface that it explains over the rows that there are."""

    form: str
    parameters: dict[str, float]
    part_explained: float


def form_of(law: Discovered, density: Sequence[int]) -> Form | None:
    """The form that explains most of a law, the simplest one where two explain as much; None below LIKE.

    density: rows that lie nearest to each knot, row by row for a surface. What the nominal robot has itself
    (`nominal_part`) is free: a rate may take up the straight line in a drag, and the form is that of the rest.
    """
    root = np.sqrt(np.maximum(np.asarray(density, float), 1e-9))
    own = root[:, None] * _own(law)
    free = own @ np.linalg.pinv(own)
    value = root * np.ravel(law.value)
    best: Form | None = None
    for name, more, basis in _of_two(law) if law.second_signal else _of_one(law):
        size, part = _explained(value - free @ value, root * basis, free)
        if best is None or part > best.part_explained + SIMPLER:
            best = Form(name, {"c": size, **more}, part)
    return best if best is not None and best.part_explained >= LIKE else None


Tried = Iterator[tuple[str, dict[str, float], np.ndarray]]


def _of_one(law: Discovered) -> Tried:
    """Forms of one signal: name, numbers but for c, and values (knots,) with c = 1."""
    s = np.asarray(law.at)
    for name, shape in SHAPES.items():
        if _is_for(name, law):
            yield name, {}, shape(s, s)
    for name, shape in BENT.items():
        for s0 in s[0] + BENDS * np.ptp(s):
            if _is_for(name, law) and ("|s|" not in name or s0 > 0.0):
                yield name, {"s0": float(s0)}, shape(s, s0)


def _is_for(name: str, law: Discovered) -> bool:
    """Whether a form is tried for a law's signal."""
    return law.signal in ONLY_OF.get(name, (law.signal,)) and (law.signal != ANGLE or name in ROUND)


def _of_two(law: Discovered) -> Tried:
    """Forms of two signals: products, or on the floor what grows along x or y, and a round patch."""
    s, t = at_knots(tuple(knots_by_signal(law).values()))
    floor = (law.signal, law.second_signal) == ("x", "y")
    for name, shape in (SLOPES if floor else PRODUCTS).items():
        yield name, {}, shape(s, t)
    if not floor:
        return
    width = min(np.ptp(s), np.ptp(t))
    for x0 in s.min() + BENDS * np.ptp(s):
        for y0 in t.min() + BENDS * np.ptp(t):
            far = np.hypot(s - x0, t - y0)
            for radius in BENDS * width:
                # half a knot wide, as a surface between its knots is
                inside = np.clip((radius - far) / (0.1 * width) + 0.5, 0.0, 1.0)
                yield PATCH, {"x0": float(x0), "y0": float(y0), "radius": float(radius)}, inside


def beyond(law: Discovered, density: Sequence[int]) -> np.ndarray:
    """The values of a law less the part that the nominal robot could have as well, where the robot has been."""
    value, own, root = np.ravel(law.value), _own(law), np.sqrt(np.maximum(np.asarray(density, float), 1e-9))
    if own.shape[1]:
        value = value - own @ np.linalg.lstsq(root[:, None] * own, root * value, rcond=None)[0]
    return value.reshape(np.shape(law.value))


def _own(law: Discovered) -> np.ndarray:
    """`nominal_part` of a law."""
    kind = Kind(law.acts_on, law.times, law.signal, law.second_signal)
    return nominal_part(kind, tuple(knots_by_signal(law).values()))


def _explained(value: Array, basis: Array, free: Array) -> tuple[float, float]:
    """The factor of a basis beside what is free, and the part that it explains of the squares of a value beyond it."""
    more = basis - free @ basis
    power, total = float(more @ more), float(value @ value)
    size = float(more @ value) / power if power > 1e-9 * float(basis @ basis) else 0.0
    return size, 1.0 - float(np.sum((value - size * more) ** 2)) / max(total, 1e-300)

"""What a discovered curve looks like: the simple form that explains most of it, where the robot has been."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.effects.discovered import ALONG, HEADING
from jaxident.robot.model import Discovered

LIKE = 0.8
"""Part of a curve that a form has to explain before it is told. No other value was tried."""
SIMPLER = 0.01
"""By which a form further down the list has to explain more. No other value was tried."""
FORCES = (ALONG, HEADING)
BENDS = np.linspace(0.1, 0.9, 17)
"""Places of a bend or a step that are tried, as parts of the range of a signal."""

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
    "c from s0 on": lambda s, s0: (s >= s0).astype(float),
}
"""Forms that begin at some s0."""
ANGLES = ("c sin(s)", "c cos(s)", "c sin(2 s)", "c cos(2 s)")


class Form(NamedTuple):
    """A form, its numbers, and the part of the curve that it explains over the rows that there are."""

    form: str
    parameters: dict[str, float]
    part_explained: float


def form_of(law: Discovered, density: Sequence[int]) -> Form | None:
    """The form that explains most of a law, the simplest one where two explain as much; None below LIKE.

    density (knots,): rows that lie nearest to each knot. What the nominal robot has itself (`_own`) is free: a rate
    may take up the straight line in a drag, and the form is that of the rest.
    """
    s, value = np.asarray(law.at), np.asarray(law.value)
    weight = np.maximum(np.asarray(density, float), 1e-9)
    tried: list[tuple[str, dict[str, float], np.ndarray]] = []
    tried += [
        (name, {}, shape(s, s)) for name, shape in SHAPES.items() if name not in ANGLES or law.signal == "heading"
    ]
    tried += [
        (name, {"s0": float(s0)}, shape(s, s0))
        for name, shape in BENT.items()
        for s0 in s[0] + BENDS * np.ptp(s)
        if "|s|" not in name or s0 > 0.0
    ]
    best: Form | None = None
    for name, more, basis in tried:
        size, part = _explained(value, basis, _own(law), weight)
        if best is None or part > best.part_explained + SIMPLER:
            best = Form(name, {"c": size, **more}, part)
    return best if best is not None and best.part_explained >= LIKE else None


def beyond(law: Discovered, density: Sequence[int]) -> np.ndarray:
    """The values of a law less the part that the nominal robot could have as well, where the robot has been."""
    value, own, root = np.asarray(law.value), _own(law), np.sqrt(np.maximum(np.asarray(density, float), 1e-9))
    if not own.shape[1]:
        return value
    return value - own @ np.linalg.lstsq(root[:, None] * own, root * value, rcond=None)[0]


def _own(law: Discovered) -> np.ndarray:
    """Columns (knots, n) that the nominal robot has itself: rates, couplings and gains."""
    s = np.asarray(law.at)
    if law.times != "1" and law.acts_on in FORCES:
        return np.ones((len(s), 1))
    linear = law.times == "1" and law.signal in ("v", "w", "push right", "push left", "own speed", "own push")
    return s[:, None] if linear else np.zeros((len(s), 0))


def _explained(value: Array, basis: Array, own: Array, weight: Array) -> tuple[float, float]:
    """The factor of a basis beside what is free, and the part that it explains of the weighted squares beyond that."""
    root = np.sqrt(weight)
    columns = root[:, None] * own
    free = columns @ np.linalg.pinv(columns) if own.shape[1] else np.zeros((len(value),) * 2)
    left, more = (root * each - free @ (root * each) for each in (value, basis))
    power, total = float(more @ more), float(left @ left)
    size = float(more @ left) / power if power > 1e-9 * float(np.sum(weight * basis**2)) else 0.0
    return size, 1.0 - float(np.sum((left - size * more) ** 2)) / max(total, 1e-300)

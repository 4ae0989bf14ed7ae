"""A flexible corrector: a library of missing forces, sideways speeds and camera errors, none of them an effect by name.

What it explains beyond the selected effects is a gap that the catalogue has no word for. Columns are answers of the
poses, linear about the fitted path; few are chosen, one after the other (orthogonal matching pursuit: Pati, Rezaiifar
and Krishnaprasad 1993).
"""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.motion.linear import normal
from jaxident.diagnosis.motion.responses import Responses, modelled_path, modelled_speeds
from jaxident.diagnosis.motion.windows import Windows

LAGS = (1, 2, 4, 8)
"""Rows by which a command may be late."""
LATER = (1, 4)
"""Rows by which it may be late the more, the faster the robot is. On seven simulated robots with such a delay terms
that say so raised the log evidence of the search's end by 260 to 1570; by four rows on two of them, by two or eight was
not tried."""
MEMORIES = (2.0, 8.0)
"""Time constants [s] of what forgets slowly."""
MOST_TERMS = 6
WORTH = 9.0
"""Fall of -log p that a term must bring: one of 157 does so by chance once in 290 times (chi-squared at 18)."""


class Term(NamedTuple):
    """One column: the site whose effects look like it, its name for people, and the fall of -log p that looking for it
    among many alike brings by chance."""

    site: str
    name: str
    price: float = 0.0


class Corrector(NamedTuple):
    """Terms and their columns (windows, numbers, terms)."""

    terms: tuple[Term, ...]
    columns: Any


def library(residual: Array, windows: Windows, responses: Responses) -> Corrector:
    """All terms about the path of a model with some residuals (windows, numbers)."""
    x, y, theta = path = modelled_path(residual, windows)
    v, w = modelled_speeds(path, windows)
    step = np.asarray(windows.step).T
    time = windows.session[windows.run][:, None] + windows.t[windows.first, windows.run][:, None] + step.cumsum(axis=1)
    time = (time - time.mean()) / max(np.ptp(time), 1e-9)
    forces = _forces(windows, v, w, theta, x, y, time)
    terms, columns = [], []
    for channel, answer in (("along", responses.along), ("heading", responses.heading)):
        for (site, name), value in forces.items():
            terms.append(Term(site, f"{name} in the acceleration {channel}"))
            columns.append((answer @ value[..., None])[..., 0])
    sideways = {"v": v, "w": w, "v w": v * w, "v^2": v * v, "w^2": w * w, "|v| w": np.abs(v) * w, "cos": np.cos(theta),
                "sin": np.sin(theta)}  # fmt: skip
    for name, value in sideways.items():
        terms.append(Term("contact", f"{name} in the speed sideways"))
        columns.append((responses.left @ value[..., None])[..., 0])
    seen = np.repeat(np.asarray(windows.seen).T, 3, axis=1)
    for name, value in _camera(x, y, theta, v, w, time).items():
        terms.append(Term("camera", name))
        columns.append(seen * value.reshape(len(step), -1))
    return Corrector(tuple(terms), np.stack(columns, axis=-1))


def _forces(windows: Windows, v, w, theta, x, y, time) -> dict[tuple[str, str], np.ndarray]:
    """What an acceleration may depend on, each (windows, rows), with the site that would cause it."""
    rows = np.asarray(windows.step).shape[0]
    places = np.minimum(windows.first + np.arange(rows)[:, None], len(windows.command) - 1)

    def commanded(lag: int) -> np.ndarray:
        back = places - lag
        found = np.where((back >= 0)[..., None], windows.command[np.maximum(back, 0), windows.run], 0.0)
        return found.transpose(1, 0, 2)

    u = commanded(0)
    worked = {seconds: _recent(np.abs(windows.command), windows.t, seconds) for seconds in MEMORIES}
    tired = {seconds: mean[places, windows.run].transpose(1, 0, 2) for seconds, mean in worked.items()}
    terms: dict[tuple[str, str], Any] = {}
    for wheel, side in enumerate(("right", "left")):
        own, other = u[..., wheel], u[..., 1 - wheel]
        shapes = {"|u|": np.abs(own), "u^2": own**2, "u |u|": own * np.abs(own), "u^3": own**3, "sign u": np.sign(own),
                  "u |other u|": own * np.abs(other), "large u": np.sign(own) * np.maximum(np.abs(own) - 0.7, 0.0),
                  "small u": np.where(np.abs(own) < 0.3, own, 0.0)}  # fmt: skip
        terms |= {("actuation", f"{name} {side}"): value for name, value in shapes.items()}
        late = {lag: commanded(lag)[..., wheel] - own for lag in LAGS}
        terms |= {("actuation", f"u {lag} rows ago {side}"): value for lag, value in late.items()}
        for name, speed in (("|v|", np.abs(v)), ("|w|", np.abs(w))):
            terms |= {("actuation", f"{name} (u {lag} rows ago) {side}"): speed * late[lag] for lag in LATER}
        terms["time", f"time u {side}"] = time * own
        for seconds, smooth in tired.items():
            terms["actuation", f"u (mean |u| of {seconds:g} s) {side}"] = own * smooth[..., wheel]
    pairs = {"v |v|": v * np.abs(v), "w |w|": w * np.abs(w), "v w": v * w, "v^2": v * v, "w^2": w * w,
             "|w| v": np.abs(w) * v, "|v| w": np.abs(v) * w, "sign v": np.sign(v), "sign w": np.sign(w),
             "|v|": np.abs(v), "|w|": np.abs(w), "v^3": v**3, "w^3": w**3}  # fmt: skip
    terms |= {("drive", name): value for name, value in pairs.items()}
    terms |= {("contact", "cos"): np.cos(theta), ("contact", "sin"): np.sin(theta)}
    terms |= {("contact", "x"): x, ("contact", "y"): y, ("contact", "constant"): np.ones_like(v)}
    terms |= {("contact", "cos 2"): np.cos(2 * theta), ("contact", "sin 2"): np.sin(2 * theta)}
    terms |= {("time", "time"): time, ("time", "time v"): time * v, ("time", "time w"): time * w}
    return terms


def _recent(values: Array, t: Array, seconds: float) -> np.ndarray:
    """Mean (rows, runs, ...) of earlier values, forgotten over some seconds; t (rows, runs)."""
    kept = np.exp(-np.diff(t, axis=0) / seconds)
    found = np.zeros_like(values)
    for row, own in enumerate(kept):
        found[row + 1] = own[:, None] * found[row] + (1.0 - own[:, None]) * values[row]
    return found


def _camera(x, y, theta, v, w, time) -> dict[str, np.ndarray]:
    """Pose errors (windows, rows, 3) that depend on where the robot is and how it moves."""
    none = np.zeros_like(x)
    sine, cosine = np.sin(theta), np.cos(theta)
    found = {
        "marker ahead": (cosine, sine, none), "marker left": (-sine, cosine, none), "scale": (x, -y, none),
        "shear": (y, x, none), "latency": (v * cosine, v * sine, w),
    }  # fmt: skip
    for name, value in {"x^2": x * x, "x y": x * y, "y^2": y * y, "x^3": x**3, "x^2 y": x * x * y, "x y^2": x * y * y,
                        "y^3": y**3}.items():  # fmt: skip
        found[f"{name} in x"], found[f"{name} in y"] = (value, none, none), (none, value, none)
    for name, value in {"x": x, "y": y, "cos": cosine, "sin": sine, "cos 2": np.cos(2 * theta),
                        "sin 2": np.sin(2 * theta), "v": v, "w": w}.items():  # fmt: skip
        found[f"{name} in heading"] = (none, none, value)
    return {name: np.stack(columns, axis=-1) for name, columns in found.items()}


def pursue(products: Array, base: list[int], candidates: list[int], prices: Array) -> list[tuple[int, float]]:
    """Candidates (columns of products, the residual last) in the order in which they explain most, each with the fall
    of -log p that it brings beyond its price, as long as it is worth it; `base` columns are free throughout."""
    own, cross, _ = normal(products, [*base, *candidates], ridge=1e-9)
    left = np.array(own)
    right = np.array(cross)
    count = len(base)

    def sweep(place: int) -> None:
        """Take one column out of all others (a step of Gauss-Jordan elimination)."""
        pivot = left[place].copy() / left[place, place]
        gain = right[place] / left[place, place]
        right[:] -= left[:, place] * gain
        left[:] -= np.outer(left[:, place], pivot)

    for place in range(count):
        sweep(place)
    chosen: list[tuple[int, float]] = []
    for _ in range(MOST_TERMS):
        power = np.diagonal(left)[count:]
        gains = np.where(power > 1e-6, 0.5 * right[count:] ** 2 / np.maximum(power, 1e-6), 0.0) - prices
        best = int(np.argmax(gains))
        if gains[best] < WORTH:
            break
        chosen.append((candidates[best], float(gains[best])))
        sweep(count + best)
    return chosen

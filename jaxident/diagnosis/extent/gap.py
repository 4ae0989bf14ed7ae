"""How large the gap is on runs used for nothing else: pose error at a horizon against the camera's variance.

Every window starts from a state estimated on its first rows; the floor is what the corrected model itself would show,
camera, slip and start-state error included, by replay of its noise through the same estimate.
"""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.motion.linear import follow
from jaxident.diagnosis.motion.responses import Responses, answer_to_start, modelled_path
from jaxident.diagnosis.motion.windows import Windows
from jaxident.diagnosis.noise import Law, covariance

REPLAYS, RESAMPLES = 400, 1000
LEVEL = 0.9
STEPS = 3
"""Of the search for a window's start state."""
CHANNELS = ("along", "lateral", "heading")


class Floor(NamedTuple):
    """What the model itself would show: mean, and means over all windows of each replay (replays,); per window and
    channel (windows, 3)."""

    value: float
    replays: Any
    channels: Any


def errors(vectors: Array, starts: Array, windows: Windows, law: Law, responses: Responses, burn: int) -> np.ndarray:
    """Squared pose errors over the camera's variance (models, windows, 3), along, lateral and in heading, at the last
    row of windows whose start states are estimated from their first `burn` rows; NaN where that row was not seen.
    vectors (models, SIZE), starts (models, 5, windows)."""
    inverse, _ = _early(law, windows, responses, burn)
    starts = np.stack([settle(*pair, windows, inverse) for pair in zip(vectors, starts, strict=True)])
    residual = follow(vectors, starts, windows)
    seen = np.asarray(windows.seen)[-1]
    return np.stack([np.where(seen[:, None], _turned(found, windows) / _variance(law), np.nan) for found in residual])


def floor_of(
    vector: Array, residual: Array, windows: Windows, law: Law, responses: Responses, burn: int, seed: int = 0
) -> Floor:
    """The floor by replay of noise through the linear estimate about the path of a model with some residuals (windows,
    numbers)."""
    inverse, rows = _early(law, windows, responses, burn)
    slope = answer_to_start(np.exp(vector[:2]), residual, windows)
    early = slope[:, :rows]
    normal = early.transpose(0, 2, 1) @ inverse @ early
    gain = np.linalg.solve(normal + 1e-9 * _scale(normal), early.transpose(0, 2, 1) @ inverse)
    factor = np.linalg.cholesky(covariance(law, windows, responses))
    weights = factor[:, -3:] - slope[:, -3:] @ gain @ factor[:, :rows]
    draws = np.random.default_rng(seed).normal(size=(*weights.shape[::2], REPLAYS))
    replayed = weights @ draws
    heading = modelled_path(residual, windows)[2][:, -1]
    turned = _rotate(replayed, heading[:, None]) ** 2 / _variance(law)[None, :, None]
    seen = np.asarray(windows.seen)[-1]
    turned = turned[seen]
    return Floor(float(np.mean(turned)), turned.mean(axis=(0, 1)), turned.mean(axis=2))


def settle(vector: Array, starts: Array, windows: Windows, inverse: Array) -> np.ndarray:
    """Start states (5, windows) under a vector (SIZE,) that fit the first poses, as many as the inverse covariance
    (windows, numbers, numbers) of their noise has; from some starts."""
    starts = np.array(starts)
    for _ in range(STEPS):
        found, slope = _by_start(vector, starts, windows, inverse.shape[1])
        normal = slope.transpose(0, 2, 1) @ inverse @ slope
        right = slope.transpose(0, 2, 1) @ inverse @ found[..., None]
        starts += np.linalg.solve(normal + 1e-9 * _scale(normal), right)[..., 0].T
    return starts


def _by_start(vector: Array, starts: Array, windows: Windows, numbers: int) -> tuple[np.ndarray, np.ndarray]:
    """First residuals (windows, numbers) and derivatives of the modelled poses by the start state (windows, numbers,
    5), by differences: with a traction limit or dry friction a speed does not decay as the nominal one does."""
    step = np.array([1e-5, 1e-5, 1e-5, 1e-5, 1e-4])
    lanes = np.concatenate([starts[None], starts + step[:, None, None] * np.eye(5)[:, :, None]])
    found = follow(np.tile(vector, (6, 1)), lanes, windows)[:, :, :numbers]
    return found[0], np.moveaxis((found[0] - found[1:]) / step[:, None, None], 0, -1)


class Shrink(NamedTuple):
    """shrink = 1 - (after - floor) / (refitted - floor) and its 90 % interval; None where no gap stands out."""

    value: float | None
    interval: tuple[float, float] | None


def shrink_of(refitted: Array, after: Array, floor: Floor, seed: int = 0) -> Shrink:
    """The shrink from errors (windows, 3) before and after, with an interval by resampled windows; none where the gap
    before does not stand out, neither from replays of noise nor from one resample to the next."""
    kept = np.isfinite(refitted).all(axis=1) & np.isfinite(after).all(axis=1)
    refitted, after = refitted[kept].mean(axis=1), after[kept].mean(axis=1)
    if not len(refitted) or refitted.mean() <= np.quantile(floor.replays, 0.95):
        return Shrink(None, None)
    picks = _blocks(np.random.default_rng(seed), len(refitted))
    top, bottom = after[picks].mean(axis=1) - floor.value, refitted[picks].mean(axis=1) - floor.value
    if np.quantile(bottom, 0.5 - LEVEL / 2) <= 0.0:
        return Shrink(None, None)
    low, high = np.quantile(1.0 - top / np.maximum(bottom, 1e-9), [0.5 - LEVEL / 2, 0.5 + LEVEL / 2])
    whole = 1.0 - (after.mean() - floor.value) / (refitted.mean() - floor.value)
    return Shrink(float(whole), (float(low), float(high)))


def interval(errors: Array) -> tuple[float, float]:
    """90 % interval of a mean of errors (windows, 3) by resampled windows."""
    mean = errors[np.isfinite(errors).all(axis=1)].mean(axis=1)
    found = mean[_blocks(np.random.default_rng(2), len(mean))].mean(axis=1)
    low, high = np.quantile(found, [0.5 - LEVEL / 2, 0.5 + LEVEL / 2])
    return float(low), float(high)


def _blocks(rng, count: int, length: int = 3) -> np.ndarray:
    """Resampled places (RESAMPLES, count) in blocks: neighbours overlap and share the robot's manoeuvre."""
    length = min(length, count)
    starts = rng.integers(0, count, size=(RESAMPLES, -(-count // length)))
    return ((starts[..., None] + np.arange(length)) % count).reshape(RESAMPLES, -1)[:, :count]


def _early(law: Law, windows: Windows, responses: Responses, burn: int) -> tuple[np.ndarray, int]:
    """Inverse covariance of the first rows of windows, rows of unseen poses left out."""
    rows = 3 * burn
    seen = np.repeat(np.asarray(windows.seen).T, 3, axis=1)[:, :rows]
    inverse = np.linalg.inv(covariance(law, windows, responses)[:, :rows, :rows])
    return inverse * seen[:, :, None] * seen[:, None, :], rows


def _scale(normal: Array) -> np.ndarray:
    return np.eye(5) * np.max(np.diagonal(normal, axis1=1, axis2=2), axis=1)[:, None, None]


def _variance(law: Law) -> np.ndarray:
    """The camera's variance in the three channels."""
    position, heading = law.coloured or (0.0, 0.0)
    flat = law.position**2 + position**2
    return np.array([flat, flat, law.heading**2 + heading**2])


def _turned(residual: Array, windows: Windows) -> np.ndarray:
    """Squared errors (windows, 3) at the last row, along, lateral and in heading."""
    last = residual[:, -3:, None]
    return _rotate(last, modelled_path(residual, windows)[2][:, -1:])[..., 0] ** 2


def _rotate(error: Array, heading: Array) -> np.ndarray:
    """Errors (windows, 3, draws) in x, y, heading as along, lateral, heading."""
    sine, cosine = np.sin(heading), np.cos(heading)
    x, y, theta = error[:, 0], error[:, 1], error[:, 2]
    return np.stack([cosine * x + sine * y, -sine * x + cosine * y, theta], axis=1)

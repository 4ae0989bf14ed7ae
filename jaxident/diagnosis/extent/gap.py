"""How large the gap is on runs used for nothing else: pose error at a horizon against the camera's variance.

Every window starts from a state estimated on its first rows, so that its last residual is a weighted sum of all of
them: `last_weights`.
"""

from typing import NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.motion.linear import START_STEPS, follow
from jaxident.diagnosis.motion.responses import Responses, modelled_path
from jaxident.diagnosis.motion.windows import Windows
from jaxident.diagnosis.noise.law import Law, covariance, deviations

STEPS = 3
"""Of the search for a window's start state."""
CHANNELS = ("along", "lateral", "heading")


def last_errors(vectors: Array, starts: Array, windows: Windows, law: Law, inverse: Array) -> np.ndarray:
    """Pose errors over the camera's deviations (models, windows, 3), along, lateral and in heading, at the last row of
    windows whose start states are estimated from their first rows (`early_inverse`); NaN where that row was not seen.
    vectors (models, SIZE), starts (models, 5, windows)."""
    starts = np.stack([settle(*pair, windows, inverse) for pair in zip(vectors, starts, strict=True)])
    residual = follow(vectors, starts, windows)
    seen = np.asarray(windows.seen)[-1]
    turned = [in_channels(found[:, -3:, None], found, windows, law)[..., 0] for found in residual]
    return np.stack([np.where(seen[:, None], one, np.nan) for one in turned])


def settle(vector: Array, starts: Array, windows: Windows, inverse: Array) -> np.ndarray:
    """Start states (5, windows) under a vector (SIZE,) that fit the first poses, as many as the inverse covariance
    (windows, numbers, numbers) of their noise has; from some starts. Each window keeps the best it has seen: near rest
    dry friction has corners that a plain step jumps over and back."""
    best = np.array(starts)
    found, slope = _by_start(vector, best, windows, inverse.shape[1])
    damping = np.full(best.shape[1], 1e-9)
    for _ in range(STEPS):
        normal = slope.transpose(0, 2, 1) @ inverse @ slope
        right = slope.transpose(0, 2, 1) @ inverse @ found[..., None]
        proposed = best + np.linalg.solve(normal + damping[:, None, None] * _scale(normal), right)[..., 0].T
        new_found, new_slope = _by_start(vector, proposed, windows, inverse.shape[1])
        better = _squares(new_found, inverse) < _squares(found, inverse)
        best = np.where(better, proposed, best)
        found = np.where(better[:, None], new_found, found)
        slope = np.where(better[:, None, None], new_slope, slope)
        damping = np.where(better, 0.1 * damping, np.maximum(100.0 * damping, 1e-4))
    return best


def _squares(found: Array, inverse: Array) -> np.ndarray:
    return np.einsum("wi,wij,wj->w", found, inverse, found)


def _by_start(vector: Array, starts: Array, windows: Windows, numbers: int) -> tuple[np.ndarray, np.ndarray]:
    """First residuals (windows, numbers) and derivatives of the modelled poses by the start state (windows, numbers,
    5), by differences: with a traction limit or dry friction a speed does not decay as the nominal one does."""
    step = np.array([1e-5, 1e-5, 1e-5, *START_STEPS])
    lanes = np.concatenate([starts[None], starts + step[:, None, None] * np.eye(5)[:, :, None]])
    found = follow(np.tile(vector, (6, 1)), lanes, windows)[:, :, :numbers]
    return found[0], np.moveaxis((found[0] - found[1:]) / step[:, None, None], 0, -1)


class Ends(NamedTuple):
    """What carries numbers of a window (windows, numbers, columns) into its last error: a weight on the first rows
    (windows, 3, early numbers), which the start state takes."""

    early: np.ndarray

    def of(self, columns: Array) -> np.ndarray:
        """Last errors (windows, 3, columns) in x, y, heading after the start state took its part."""
        return columns[:, -3:] - self.early @ columns[:, : self.early.shape[2]]


def ends_of(slope: Array, inverse: Array) -> Ends:
    """The linear estimate of start states from their first rows (`early_inverse`); slope (windows, numbers, 5) are the
    derivatives of the modelled poses by the start state."""
    early = slope[:, : inverse.shape[1]]
    normal = early.transpose(0, 2, 1) @ inverse @ early
    return Ends(slope[:, -3:] @ np.linalg.solve(normal + 1e-9 * _scale(normal), early.transpose(0, 2, 1) @ inverse))


def early_inverse(law: Law, windows: Windows, responses: Responses, burn: int) -> np.ndarray:
    """Inverse covariance (windows, 3 burn, 3 burn) of the first `burn` rows of windows, unseen poses left out."""
    rows = slice(3 * burn)
    seen = np.repeat(np.asarray(windows.seen).T, 3, axis=1)[:, rows]
    inverse = np.linalg.inv(covariance(law, windows, responses, rows))
    return inverse * seen[:, :, None] * seen[:, None, :]


def in_channels(error: Array, residual: Array, windows: Windows, law: Law) -> np.ndarray:
    """Errors (windows, 3, columns) in x, y, heading as along, lateral, heading over the camera's deviations; at the
    last row of a model with some residuals (windows, numbers)."""
    heading = modelled_path(residual, windows)[2][:, -1:]
    sine, cosine = np.sin(heading), np.cos(heading)
    x, y, theta = error[:, 0], error[:, 1], error[:, 2]
    turned = np.stack([cosine * x + sine * y, -sine * x + cosine * y, theta], axis=1)
    return turned / deviations(law)[:, None]


def _scale(normal: Array) -> np.ndarray:
    largest = np.max(np.diagonal(normal, axis1=1, axis2=2), axis=1)[:, None, None]
    return np.eye(5) * np.where(largest > 0.0, largest, 1.0)  # a window without poses in its first rows

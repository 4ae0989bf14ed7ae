"""The floor of the gap: what noise alone, and what parameters known only so well, make of the errors at the horizon.

By replay on the windows themselves. Windows that overlap share camera error and slip, and the sizes of the noise are
drawn as surely as the fit knows them: the spread of the floor is that of a mean of few independent numbers.
"""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.causes.search import Solution
from jaxident.diagnosis.extent.gap import Ends, ends_of, in_channels
from jaxident.diagnosis.motion.responses import Responses
from jaxident.diagnosis.motion.windows import Windows
from jaxident.diagnosis.noise.doubt import Draws
from jaxident.diagnosis.noise.law import Law, covariance

REPLAYS = 500


class Floor(NamedTuple):
    """What the model itself would show, squared over the camera's variance: the mean, means over all windows of each
    replay (replays,), and per window and channel (windows, 3)."""

    value: float
    replays: Any
    channels: Any


def floor_of(
    residual: Array, windows: Windows, law: Law, draws: Draws, responses: Responses, ends: Ends, seed: int = 0
) -> Floor:
    """The floor about the path of a model with some residuals (windows, numbers); `draws` are of the law, one for each
    replay."""
    seen = np.asarray(windows.seen)[-1]
    factor = np.linalg.cholesky(covariance(law, windows, responses))
    channels = np.sum(in_channels(ends.of(factor), residual, windows, law) ** 2, axis=2)[seen]
    rng = np.random.default_rng(seed)
    replays = draws.deviations.shape[1]
    squares = np.zeros((int(seen.sum()), 3, replays))
    for run in np.unique(windows.run[seen]):
        own = windows.run == run
        replayed = np.zeros((len(seen), 3, replays))
        replayed[own] = _replay(rng, draws, windows, responses, ends, np.flatnonzero(own))
        turned = in_channels(replayed, residual, windows, law)
        squares[own[seen]] = turned[own & seen] ** 2
    return Floor(float(np.mean(channels)), squares.mean(axis=(0, 1)), channels)


def wander_of(solution: Solution, windows: Windows, law: Law, inverse: Array, seed: int = 0) -> Array:
    """Mean squared errors (replays,) that the uncertainty of a fit's own parameters makes at the horizon of its
    windows, over the camera's variance: the least that a corrected model can miss; inverse: `gap.early_inverse`."""
    linear = solution.linear
    ends = ends_of(linear.starts, inverse)
    scale = np.sqrt(np.diagonal(solution.covariance))
    values, vectors = np.linalg.eigh(solution.covariance / scale[:, None] / scale)
    normal = np.random.default_rng(seed).normal(size=(len(scale), REPLAYS))
    draws = scale[:, None] * (vectors @ (np.sqrt(np.maximum(values, 0.0))[:, None] * normal))
    seen = np.asarray(windows.seen)[-1]
    moved = in_channels(ends.of(linear.slopes @ draws), linear.residual, windows, law)[seen]
    return np.mean(moved**2, axis=(0, 1))


def _replay(rng, draws: Draws, windows: Windows, responses: Responses, ends: Ends, chosen) -> np.ndarray:
    """Last errors (windows, 3, replays) in x, y, heading of the chosen windows of one run."""
    t = windows.t[:, windows.run[chosen[0]]]
    places = np.minimum(windows.first[chosen, None] + np.arange(len(windows.step)), len(t) - 1)
    deviations, replays = iter(draws.deviations), draws.deviations.shape[1]

    def camera(values: Array) -> np.ndarray:
        """Numbers (windows, numbers, replays) of pose errors (rows of the run, 3, replays) of unit size."""
        flat, turn = next(deviations), next(deviations)
        return (values * np.stack([flat, flat, turn]))[places].reshape(len(chosen), -1, replays)

    found = camera(rng.normal(size=(len(t), 3, replays)))
    if draws.slip_time is not None:
        for answer in (responses.along, responses.heading):
            slip = next(deviations) * _remembering(rng, t, draws.slip_time, (replays,))
            found += answer[chosen] @ slip[places]
    if draws.coloured_time is not None:
        found += camera(_remembering(rng, t, draws.coloured_time, (3, replays)))
    return Ends(ends.early[chosen]).of(found)


def _remembering(rng, t: Array, memory: Array | float, shape: tuple[int, ...]) -> np.ndarray:
    """Normal numbers (rows, *shape) of variance 1 whose correlation falls over a memory [s], of all or of each entry
    of the last axis."""
    found = rng.normal(size=(len(t), *shape))
    kept = np.exp(-np.maximum(np.diff(t), 0.0)[:, None] / memory)
    for row, share in enumerate(kept):
        found[row + 1] = share * found[row] + np.sqrt(1.0 - share**2) * found[row + 1]
    return found

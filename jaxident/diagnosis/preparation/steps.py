"""Steps of a quantised command that a fit's residuals suggest: a matched filter over many, at no cost of simulations.

A sawtooth is lost a tenth of a tooth beside its step, and the largest command holds up to fifty teeth: too many seeds
to follow each. To first order a small force gains its product with the slope of -log p by the force.
"""

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.fit.refit import Data, Solution
from jaxident.diagnosis.motion.responses import Responses, respond
from jaxident.effects.coordinates import natural

TEETH = np.arange(2.2, 50.0, 0.08)
"""Steps in the largest command."""


def likely_steps(data: Data, solution: Solution, count: int = 16) -> list[tuple[float, float]]:
    """The most promising steps, in largest commands, of commands that are rounded to the nearest (0) or towards zero
    (1), each better than its neighbours."""
    wanted = _slopes(data, solution)
    slope, square = np.zeros((2, len(TEETH))), np.zeros((2, len(TEETH)))
    for wheel, zone in enumerate(solution.vector[6:8]):
        levels, own, rows = np.unique(data.windows.command[..., wheel], return_inverse=True, return_counts=True)
        by_level = np.bincount(own.ravel(), wanted[..., wheel].ravel(), len(levels))
        for k, step in enumerate(1.0 / TEETH):
            for form, rounded in enumerate((_to_nearest(levels, step), _towards_zero(levels, step))):
                change = past_zone(rounded, zone) - past_zone(levels, zone)
                slope[form, k] += by_level @ change
                square[form, k] += rows @ change**2
    promise = slope / np.sqrt(square + 1e-12)
    inside = np.pad(promise, ((0, 0), (1, 1)), constant_values=-np.inf)
    peaks = np.argwhere((promise >= inside[:, :-2]) & (promise >= inside[:, 2:]))
    best = peaks[np.argsort(-promise[tuple(peaks.T)])][:count]
    return [(float(1.0 / TEETH[k]), float(form)) for form, k in best]


def _to_nearest(levels: Array, step: float) -> np.ndarray:
    return np.round(levels / step) * step


def _towards_zero(levels: Array, step: float) -> np.ndarray:
    """Half a step more than what rounding towards zero leaves: the fitted dead zones hold the half that is lost."""
    return (np.trunc(levels / step) + 0.5 * np.sign(levels)) * step


def _slopes(data: Data, solution: Solution) -> np.ndarray:
    """Fall of -log p by a unit more of each wheel's push in each row, (rows of a run, runs, 2)."""
    windows = data.windows
    responses = respond(np.exp(solution.vector[:2]), solution.linear.residual, windows)
    along, heading = pulls(data, solution.linear.residual, responses)
    gain = natural(solution.vector)[2:6].reshape(2, 2)
    wanted = along[..., None] * gain[0] + heading[..., None] * gain[1]
    places = np.minimum(windows.first[:, None] + np.arange(wanted.shape[1]), len(windows.command) - 1)
    total = np.zeros(windows.command.shape)
    np.add.at(total, (places, np.broadcast_to(windows.run[:, None], places.shape)), wanted)
    return total


def past_zone(command: Array, zone: Array) -> np.ndarray:
    """What of commands (..., 2), or of those of one wheel, lies beyond its dead zone."""
    return np.sign(command) * np.maximum(np.abs(command) - zone, 0.0)


def pulls(data: Data, residual: Array, responses: Responses) -> tuple[np.ndarray, np.ndarray]:
    """Fall of -log p by a unit more acceleration along and in heading in each row of each window (windows, rows)."""
    weighted = data.whitener.transpose(0, 2, 1) @ (data.whitener @ residual[..., None])
    along, heading = ((answer.transpose(0, 2, 1) @ weighted)[..., 0] for answer in responses[:2])
    return along, heading

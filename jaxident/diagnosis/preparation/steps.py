"""Steps of a quantised command that a fit's residuals suggest: a matched filter over many, at no cost of simulations.

A sawtooth is lost a tenth of a tooth beside its step, and the largest command holds up to fifty teeth: too many seeds
to follow each. To first order a small force gains its product with the slope of -log p by the force.
"""

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.fit.refit import Data, Solution
from jaxident.diagnosis.motion.responses import Responses, respond

TEETH = np.arange(2.2, 50.0, 0.08)
"""Steps in the largest command."""


def likely_steps(data: Data, solution: Solution, count: int = 16) -> np.ndarray:
    """The most promising steps (count,), each better than its neighbours, in largest commands."""
    wanted = _slopes(data, solution)
    slope, square = np.zeros(len(TEETH)), np.zeros(len(TEETH))
    for wheel, zone in enumerate(solution.vector[6:8]):
        levels, own, rows = np.unique(data.windows.command[..., wheel], return_inverse=True, return_counts=True)
        by_level = np.bincount(own.ravel(), wanted[..., wheel].ravel(), len(levels))
        for k, step in enumerate(1.0 / TEETH):
            change = past_zone(np.round(levels / step) * step, zone) - past_zone(levels, zone)
            slope[k] += by_level @ change
            square[k] += rows @ change**2
    promise = slope / np.sqrt(square + 1e-12)
    inside = np.pad(promise, 1, constant_values=-np.inf)
    peaks = np.flatnonzero((promise >= inside[:-2]) & (promise >= inside[2:]))
    return 1.0 / TEETH[peaks[np.argsort(-promise[peaks])][:count]]


def _slopes(data: Data, solution: Solution) -> np.ndarray:
    """Fall of -log p by a unit more of each wheel's push in each row, (rows of a run, runs, 2)."""
    windows = data.windows
    responses = respond(np.exp(solution.vector[:2]), solution.linear.residual, windows)
    along, heading = pulls(data, solution.linear.residual, responses)
    gain = solution.vector[2:6].reshape(2, 2)
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

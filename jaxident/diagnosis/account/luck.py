"""What one law of noise happens to leave on a number of starts: how a mean of squares spreads about its expectation."""

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.preparation.judging import Judged
from jaxident.diagnosis.preparation.prepare import Prepared
from jaxident.effects.catalogue import BY_CHANCE
from jaxident.log import run_begins


def luck(judged: Judged, camera: Array, unit: Array, draws: int) -> np.ndarray:
    """Mean squares over their expectation (draws,) of normal errors drawn at the judging starts, by start state, slip
    and camera: expected squares of the latter (starts, 3), and the camera's variances as units (3,)."""
    covariance = judged.start + judged.slip + camera[:, :, None] * np.eye(3)
    covariance = covariance[np.isfinite(covariance).all(axis=(1, 2))] / np.sqrt(np.outer(unit, unit))
    if not len(covariance):
        return np.ones(draws)
    size, vectors = np.linalg.eigh(covariance)
    root, rng = vectors * np.sqrt(np.maximum(size, 0.0))[:, None, :], np.random.default_rng([len(size), 7])
    drawn = (root @ rng.normal(size=(*size.shape, 1)) for _ in range(draws))  # one after the other: starts are many
    return np.array([np.mean(errors**2) for errors in drawn]) / np.mean(size)


def luck_of_chance(name: str, parameters: dict, part: Array, prepared: Prepared, draws: int) -> np.ndarray:
    """Mean squares over their expectation (draws,) of an effect of chance that strikes at some starts, where it has
    expected squares `part` (starts, 3) over the camera's variances. Its frequency is known from the events on the rows
    that fit."""
    rate, events = _rate(name, parameters, prepared)
    rng = np.random.default_rng([len(part), 8])
    each = ((rng.random(len(rate)) < rate) / rate @ (part * rng.normal(size=part.shape) ** 2) for _ in range(draws))
    known = rng.gamma(max(events, 1.0), size=draws) / max(events, 1.0) if np.isfinite(events) else 1.0
    return known * np.array([np.sum(one) for one in each]) / max(float(np.sum(part)), 1e-300)


def _rate(name: str, parameters: dict, prepared: Prepared) -> tuple[np.ndarray, float]:
    """How probable the effect strikes at each judging start, and how many of its events its frequency is known from. A
    lost command strikes where the command changes between a start and its horizon."""
    starts, rows = prepared.judging, prepared.rows
    if "probability" not in parameters:
        return np.ones(len(starts.row)), np.inf
    p, poses = parameters["probability"], prepared.frames.poses
    if name != BY_CHANCE["lost"]:
        return np.full(len(starts.row), p), p * poses
    command = np.stack(prepared.log.command, axis=1)
    changed = np.append(np.any(command[1:] != command[:-1], axis=1), False)
    total = np.concatenate([[0], np.cumsum(changed)])
    first = run_begins(prepared.log)[starts.run] + starts.row
    changes = total[first + rows] - total[first]
    return np.maximum(1.0 - (1.0 - p) ** changes, p), p * poses * float(np.mean(changed))

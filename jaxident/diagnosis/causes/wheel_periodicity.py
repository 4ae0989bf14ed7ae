"""What comes once per turn of something on a wheel: an eccentric wheel, a bent axle, a worn tooth.

Its period is unknown, and its phase too, in every run anew; both are looked for in the distance that each wheel has
travelled, weighted by the noise law.
"""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.fit.refit import Data, Solution
from jaxident.diagnosis.motion.linear import without_starts
from jaxident.diagnosis.motion.responses import Responses, modelled_path

TURNS = np.geomspace(3.0, 40.0, 64)
"""Radians of the turn per unit of travel, which a wheel at full drive makes in a second."""
PERIOD_PRICE, PHASE_PRICE = 5.0, 1.0
"""Fall of -log p that the best of so many periods, and the best phase of a run, bring by chance."""


class Rhythm(NamedTuple):
    """Of one wheel: distance [m] from turn to turn, the answer of the poses (windows, numbers), and the price of having
    looked for it."""

    period: float
    column: Any
    price: float


class Travel(NamedTuple):
    """Of one wheel: what has been travelled in its run and the push that its speed stands for (windows, rows); the
    speeds along and in heading (2,) that a unit of push makes."""

    gone: Any
    push: Any
    speed: Any


def rhythms(data: Data, solution: Solution, responses: Responses) -> list[Rhythm]:
    """The strongest rhythm of each wheel, right and left, in what a solution leaves."""
    linear = solution.linear
    columns = np.concatenate([responses.along, responses.heading, linear.residual[..., None]], axis=2)
    whitened, _ = without_starts(data.whitener, columns, linear.starts)
    price = PERIOD_PRICE + PHASE_PRICE * len(np.unique(data.windows.run))
    found = []
    for wheel in _travels(data, solution):
        turns, phase = _strongest(data, wheel, np.exp(solution.vector[:2]), whitened)
        forces = _forces(data, wheel, np.exp(solution.vector[:2]), turns, phase)
        answer = np.concatenate([responses.along, responses.heading], axis=2) @ forces[..., None]
        ground = 2.0 * abs(float(wheel.speed[0]))  # the axle's middle moves half as fast as the wheel
        found.append(Rhythm(2.0 * np.pi / turns * ground, answer[..., 0], price))
    return found


def _travels(data: Data, solution: Solution) -> list[Travel]:
    # not the measured path: columns made of its noise would explain that noise
    x, y, theta = modelled_path(solution.linear.residual, data.windows)
    step, run = np.asarray(data.windows.step).T, data.windows.run
    moved = [np.diff(place, axis=1, append=2.0 * place[:, -1:] - place[:, -2:-1]) for place in (x, y, theta)]
    middle = theta + 0.5 * moved[2]
    v, w = (moved[0] * np.cos(middle) + moved[1] * np.sin(middle)) / step, moved[2] / step
    rates, gain = np.exp(solution.vector[:2]), solution.vector[2:6].reshape(2, 2)
    push = np.stack([rates[0] * v, rates[1] * w], axis=-1) @ np.linalg.inv(gain).T
    part = push * step[..., None]
    before = np.zeros((len(run), 2))
    for k in range(1, len(run)):  # windows of a run follow each other
        before[k] = before[k - 1] + part[k - 1].sum(axis=0) if run[k] == run[k - 1] else 0.0
    gone = before[:, None] + np.cumsum(part, axis=1) - part
    return [Travel(gone[..., k], push[..., k], gain[:, k] / rates) for k in (0, 1)]


def _strongest(data: Data, wheel: Travel, rates: Array, whitened: Array) -> tuple[float, np.ndarray]:
    """The period whose two phases, free in every run, explain most, and the best phase of each run (runs,); whitened
    answers to accelerations along and in heading and residuals (windows, numbers, 2 rows + 1)."""
    run, count = data.windows.run, int(data.windows.run.max()) + 1
    best, chosen = -1.0, (float(TURNS[0]), np.zeros(count))
    for turns in TURNS:
        phases = [_forces(data, wheel, rates, turns, np.full(count, a)) for a in (0.0, 0.5 * np.pi)]
        pair = whitened[:, :, :-1] @ np.stack(phases, axis=2)
        curve, slope = np.zeros((count, 2, 2)), np.zeros((count, 2, 1))
        np.add.at(curve, run, pair.transpose(0, 2, 1) @ pair)
        np.add.at(slope, run, pair.transpose(0, 2, 1) @ whitened[:, :, -1:])
        size = np.linalg.solve(curve + 1e-9 * np.eye(2), slope)
        gain = 0.5 * float(np.sum(size * slope))
        if gain > best:
            best, chosen = gain, (float(turns), np.arctan2(size[:, 1, 0], size[:, 0, 0]))
    return chosen


def _forces(data: Data, wheel: Travel, rates: Array, turns: float, phase: Array) -> np.ndarray:
    """Accelerations along, then in heading (windows, 2 rows), of a rolling radius that varies by one part."""
    step = np.asarray(data.windows.step).T
    wobble = wheel.push * np.sin(turns * wheel.gone + phase[data.windows.run][:, None])
    change = np.diff(wobble, axis=1, append=wobble[:, -1:]) / step
    return np.concatenate([part * (change + r * wobble) for part, r in zip(wheel.speed, rates, strict=True)], axis=1)

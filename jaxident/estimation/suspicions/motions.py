"""How a robot moved from one seen pose to the next: NumPy alone, without a model."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from jaxident.log import Log

FEWEST = 30
"""Motions that a judgement needs."""


class Motions(NamedTuple):
    """Between rows `lag` apart with poses (motions,): run and row they start from, displacement [m], heading halfway
    and turn [rad]."""

    run: Any
    row: Any
    dx: Any
    dy: Any
    middle: Any
    turn: Any

    def along(self) -> np.ndarray:
        """Path length of the arc whose chord was seen [m]."""
        chord = self.dx * np.cos(self.middle) + self.dy * np.sin(self.middle)
        return chord / np.sinc(self.turn / (2.0 * np.pi))

    def left(self) -> np.ndarray:
        """Sideways motion [m]."""
        return self.dy * np.cos(self.middle) - self.dx * np.sin(self.middle)


def motions(log: Log, lag: int = 1, read: Callable[[np.ndarray], np.ndarray] = np.asarray) -> Motions:
    """Motions over `lag` rows; `read` turns the heading column into headings."""
    parts = []
    for number, run in enumerate(log.runs()):
        x, y, theta = np.asarray(run.x), np.asarray(run.y), read(np.asarray(run.theta))
        rows = np.flatnonzero(np.isfinite(x[lag:] + x[:-lag] + theta[lag:] + theta[:-lag]))
        turn = (theta[rows + lag] - theta[rows] + np.pi) % (2.0 * np.pi) - np.pi
        parts.append(
            (np.full(len(rows), number), rows, x[rows + lag] - x[rows], y[rows + lag] - y[rows],
             theta[rows] + 0.5 * turn, turn)
        )  # fmt: skip
    return Motions(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def increments_of(pose: Any) -> np.ndarray:
    """Path length [m] and turn [rad] from each pose to the next (2, m - 1); poses x, y, theta (3, m) without gaps."""
    x, y, theta = (np.asarray(column, float) for column in pose)
    turn = (np.diff(theta) + np.pi) % (2.0 * np.pi) - np.pi
    rows = np.arange(len(turn))
    moved = Motions(np.zeros_like(rows), rows, np.diff(x), np.diff(y), theta[:-1] + 0.5 * turn, turn)
    return np.stack([moved.along(), turn])

"""Wheel speeds whose residuals hang together: how many of them say something new, and runs that keep just these."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from jaxident.array_types import Array, Wheels
from jaxident.estimation.poses.residual_tests import whiteness
from jaxident.estimation.poses.runs import Runs

WHITE_WHEELS = 23.2
"""Largest sum of squared residual correlations, 10 of two wheels, of white residuals: chi-squared, 1 in 100."""
MOST_LAGS = 400
"""Samples over which correlations are summed: 20 s at 20 Hz. No other number was tried."""
FEWEST = 30
"""Samples of each wheel that are left at least. No other number was tried."""


def wheel_colour(normalised: Array, turning: Wheels) -> float:
    """The sum of squared correlations of residuals (runs, 2, rows) of a fit to wheel speeds; WHITE_WHEELS or less for
    white ones."""
    seen = np.asarray(turning.right) & np.asarray(turning.left)
    return float(np.sum(whiteness(np.where(seen[:, None], np.asarray(normalised), 0.0), seen)))


def spacing(normalised: Array, turning: Wheels) -> int:
    """How many samples apart wheel speeds are as good as independent, by the larger of both wheels."""
    found = [_spacing(np.asarray(normalised)[:, k], np.asarray(seen)) for k, seen in enumerate(turning)]
    return max(found)


def _spacing(residual: np.ndarray, seen: np.ndarray) -> int:
    """The same of one wheel (runs, rows)."""
    runs = [own[here] for own, here in zip(residual, seen, strict=True)]
    return int(np.clip(np.ceil(samples_each(runs)), 1, max(sum(map(len, runs)) // FEWEST, 1)))


def samples_each(runs: Sequence[np.ndarray]) -> float:
    """How many samples of residuals, a row (samples,) per run, say as much as one independent one:

    1 + 2 (rho_1 + rho_2 + ...), up to the first correlation rho below zero (Geyer 1992, Statistical Science 7)."""
    power, total = sum(float(run @ run) for run in runs), 1.0
    for lag in range(1, MOST_LAGS):
        product = sum(float(run[lag:] @ run[:-lag]) for run in runs if len(run) > lag)
        if product <= 0.0:
            break
        total += 2.0 * product / max(power, 1e-300)
    return total


def thinned(runs: Runs, every: int) -> Runs:
    """The runs (runs, rows) with one wheel speed in so many alone."""

    def kept(seen: Any) -> np.ndarray:
        return np.asarray(seen) & (np.cumsum(seen, axis=1) % every == 1 % every)

    return runs._replace(turning=Wheels(*map(kept, runs.turning)))

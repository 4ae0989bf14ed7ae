"""What the residuals of a fit to poses say: how much it explains, and whether anything is left in them.

The residuals are those of the poses themselves. Increments of poses would not do: differencing white camera error makes
neighbours correlate by -1/2, so that no model, however right, leaves white increments. NumPy alone.
"""

from typing import Any, NamedTuple

import numpy as np

from jaxident.log import Log

CHANNELS = ("x", "y", "theta")
LAGS = (1, 2, 4, 8, 16)
WHITE_CHANNEL = 15.1
"""Largest whiteness of a channel's white residuals: chi-squared with a degree of freedom per lag, 1 in 100."""
INPUT_LAGS = (0, 1, 2, 4, 8, 16)
UNRELATED = 3.34
"""Largest of 12 correlations with commands, in standard deviations: 1 in 100 of white residuals at most."""
FAR, FAR_SHARE = 4.0, 1e-3
"""A residual beyond FAR standard deviations is an outlier: 6 in 100,000 Gaussian ones; more than FAR_SHARE are odd."""
DRAWN_LAGS = 25


class ResidualTest(NamedTuple):
    """One test of one channel: what it asks, its number, what the number should stay below, and whether it does."""

    channel: str
    question: str
    value: float
    limit: float
    passed: bool


def fit_percent(log: Log, residuals: Any) -> np.ndarray:
    """100 (1 - |residual| / |pose - its mean|) for x, y and theta (3,), the mean that of each run (Ljung 1999, eq.
    16.54): 100 explains all, 0 as much as a robot that stands still."""
    left, moved = np.zeros(3), np.zeros(3)
    run_number = np.asarray(log.run)
    for number in np.unique(run_number):
        own = run_number == number
        for k, (column, residual) in enumerate(zip(log.pose, residuals, strict=True)):
            seen = np.isfinite(residual[own])
            value = np.asarray(column)[own][seen]
            value = np.unwrap(value) if k == 2 else value
            left[k] += np.sum(residual[own][seen] ** 2)
            moved[k] += np.sum((value - np.mean(value)) ** 2) if value.size else 0.0
    return 100.0 * (1.0 - np.sqrt(left / np.maximum(moved, 1e-300)))


def correlations(normalised: np.ndarray, seen: np.ndarray, lags: Any) -> np.ndarray:
    """Correlation (3, lags) of residuals (runs, 3, rows) with themselves some rows earlier, over rows seen at both."""
    power = np.sum(normalised**2, axis=(0, 2)) / max(np.sum(seen), 1)
    columns = []
    for lag in lags:
        both = seen[:, lag:] & seen[:, : seen.shape[1] - lag]
        product = normalised[..., lag:] * normalised[..., : seen.shape[1] - lag] * both[:, None]
        columns.append(np.sum(product, axis=(0, 2)) / max(np.sum(both), 1))
    return np.stack(columns, axis=1) / np.maximum(power, 1e-300)[:, None]


def whiteness(normalised: Any, seen: Any) -> np.ndarray:
    """Sum (3,) over LAGS of n r^2, r the correlation of residuals (runs, 3, rows) at a lag and n the pairs of rows seen
    (runs, rows) that it is made of: about chi-squared for white ones (Box and Pierce 1970), also where rows miss."""
    normalised, seen = np.asarray(normalised), np.asarray(seen)
    pairs = [np.sum(seen[:, lag:] & seen[:, : seen.shape[1] - lag]) for lag in LAGS]
    return np.sum(np.array(pairs) * correlations(normalised, seen, LAGS) ** 2, axis=1)


def residual_tests(normalised: np.ndarray, seen: np.ndarray, command: Any) -> list[ResidualTest]:
    """Whiteness, independence of the commands and outliers, for each channel; residuals over their deviations (runs, 3,
    rows), seen (runs, rows), command two of (runs, rows)."""
    count = max(int(np.sum(seen)), 1)
    white = whiteness(normalised, seen)
    related = _related(normalised, seen, command)
    far = np.sum((np.abs(normalised) > FAR) & seen[:, None], axis=(0, 2)) / count
    rows = []
    for k, channel in enumerate(CHANNELS):
        for question, value, limit in (
            ("white", white[k], WHITE_CHANNEL),
            ("unrelated to the commands", related[k], UNRELATED),
            (f"share beyond {FAR:g} standard deviations", far[k], FAR_SHARE),
        ):
            rows.append(ResidualTest(channel, question, float(value), limit, bool(value < limit)))
    return rows


def _related(normalised: np.ndarray, seen: np.ndarray, command: Any) -> np.ndarray:
    """Largest correlation (3,) with either command at INPUT_LAGS rows before, in standard deviations."""
    largest = np.zeros(3)
    for wheel in command:
        for lag in INPUT_LAGS:
            past, now = wheel[:, : wheel.shape[1] - lag], seen[:, lag:]
            past = np.where(now, past - np.mean(past[now]) if now.any() else 0.0, 0.0)
            sums = np.sum(normalised[..., lag:] * past[:, None], axis=(0, 2))
            size = np.sqrt(np.sum(past**2) * np.mean(normalised**2, axis=(0, 2)) * seen.size / max(np.sum(seen), 1))
            largest = np.maximum(largest, np.abs(sums) / np.maximum(size, 1e-300))
    return largest

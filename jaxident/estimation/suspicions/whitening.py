"""Least squares on residuals that have a memory: an autoregression that whitens them, and covariances that allow for
what it leaves (Newey and West 1987, prewhitened as by Andrews and Monahan 1992)."""

import numpy as np

ORDER, BANDWIDTH = 8, 10
"""Rows of the autoregression, and over which what it leaves may still be correlated."""


def unbroken(ends: np.ndarray) -> np.ndarray:
    """Rows whose ORDER rows before stand in the same run."""
    broken = np.concatenate([[True], ends[1:, 0] != ends[:-1, 1]])
    since = np.arange(len(ends)) - np.maximum.accumulate(np.where(broken, np.arange(len(ends)), 0))
    return since >= ORDER


def autoregression(residual: np.ndarray) -> np.ndarray:
    """Weights (ORDER,) that predict a residual from those before it."""
    before = np.lib.stride_tricks.sliding_window_view(residual[:-1], ORDER)[:, ::-1]
    return np.linalg.lstsq(before, residual[ORDER:], rcond=1e-6)[0]


def inverse_of_products(slopes: np.ndarray) -> np.ndarray:
    """The inverse of their products, 0 where a combination does not show."""
    norm = np.linalg.norm(slopes, axis=0)
    size = np.where(norm > 0.0, norm, 1.0)
    unit = slopes / size
    return np.linalg.pinv(unit.T @ unit, rcond=1e-10, hermitian=True) / np.outer(size, size)


def score_covariance(slopes: np.ndarray, left: np.ndarray) -> np.ndarray:
    """Covariance of slopes' residuals under what correlation is left: Bartlett's weights."""
    score = (slopes * left[:, None]).reshape(2, -1, slopes.shape[1]).sum(axis=0)
    total = score.T @ score
    for lag in range(1, BANDWIDTH):
        across = score[lag:].T @ score[:-lag]
        total = total + (1.0 - lag / BANDWIDTH) * (across + across.T)
    return total * len(score) / max(len(score) - slopes.shape[1], 1)

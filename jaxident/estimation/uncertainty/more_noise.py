"""How far camera noise moves an estimate of least squares: the same noise once more, and the same method again.

Under white camera error e the equation error of (13)-(14) is e_k - (1 + alpha) e_{k-1} + alpha e_{k-2}. It correlates
with the last increment, which is a regressor, so that the estimate is biased. To first order the bias is linear in the
variance of the noise: as much noise again moves the estimate as far again (simulation-extrapolation: Cook and Stefanski
1994, J. Am. Stat. Assoc. 89, 1314-1328).
"""

from collections.abc import Callable

import numpy as np

from jaxident.array_types import Array, Increment
from jaxident.errors import InputError, WorkError
from jaxident.log import Log

DRAWS = 2
"""Refits, each with noise of its own: they bound the cost. No other number was tried."""
MOVED = 3.0
"""Standard deviations beyond which a move is no chance."""


def camera_error(residuals: Increment, alpha: Array) -> tuple[float, float]:
    """Standard deviations [m], [rad] of white camera error that alone would leave such one-step residuals (samples,):

    var = sigma^2 (1 + (1 + alpha)^2 + alpha^2)."""
    sizes = []
    for part, a in zip(residuals, np.asarray(alpha, float), strict=True):
        left = np.asarray(part)[np.isfinite(part)]
        power = float(np.mean(left**2)) if left.size else 0.0
        sizes.append(float(np.sqrt(power / (1.0 + (1.0 + a) ** 2 + a**2))))
    return sizes[0], sizes[1]


def noisier(log: Log, error: tuple[float, float], random: np.random.Generator) -> Log:
    """The log with white camera error (position [m], heading [rad]) added to every pose."""
    sizes = {"x": error[0], "y": error[0], "theta": error[1]}
    return log._replace(
        **{name: np.asarray(getattr(log, name)) + size * random.normal(size=len(log.t)) for name, size in sizes.items()}
    )


def moves(
    again: Callable[[Log], np.ndarray],
    log: Log,
    estimate: np.ndarray,
    deviation: np.ndarray,
    error: tuple[float, float],
) -> np.ndarray:
    """By how much (n,) as much camera error again moves an estimate (n,): the mean over DRAWS, 0 where it is less than
    MOVED standard deviations (n,). `again` estimates from a log; a draw at which it fails says nothing."""
    random, found = np.random.default_rng(0), []
    for _ in range(DRAWS):
        try:
            found.append(again(noisier(log, error, random)))
        except (InputError, WorkError):
            continue
    if not found:
        return np.zeros_like(estimate)
    shift = np.mean(found, axis=0) - estimate
    return np.where(np.abs(shift) > MOVED * deviation, shift, 0.0)

"""Confidence intervals of what is counted and measured over cases."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

NORMAL_95 = 1.959963984540054
DRAWS = 4000


def wilson(hits: int, count: int, z: float = NORMAL_95) -> tuple[float, float]:
    """The 95 % interval of a share, Wilson 1927; (0, 1) for no cases."""
    if count == 0:
        return 0.0, 1.0
    share, spread = hits / count, z * z / count
    centre = (share + 0.5 * spread) / (1.0 + spread)
    half = z * math.sqrt(share * (1.0 - share) / count + 0.25 * spread / count) / (1.0 + spread)
    return max(centre - half, 0.0), min(centre + half, 1.0)


def bootstrap(values: ArrayLike, statistic: Callable[[np.ndarray], float], seed: int = 0) -> tuple[float, float]:
    """The 95 % percentile interval of a statistic over cases drawn again with replacement; NaN for no cases."""
    values = np.asarray(values, float)
    if len(values) == 0:
        return math.nan, math.nan
    rng = np.random.default_rng(seed)
    drawn = [statistic(values[rng.integers(len(values), size=len(values))]) for _ in range(DRAWS)]
    return tuple(float(q) for q in np.quantile(drawn, [0.025, 0.975]))  # type: ignore[return-value]


def matched(first: np.ndarray, second: np.ndarray, z: float = NORMAL_95) -> tuple[float, float]:
    """The 95 % interval of the difference of two shares of the same cases, Agresti and Min 2005: half a case more in
    each cell of the table of pairs, so that no difference in few cases is not taken for none at all."""
    gained, lost = (float(np.sum(a > b) + 0.5) for a, b in ((second, first), (first, second)))
    count = len(first) + 2.0
    centre = (gained - lost) / count
    half = z * math.sqrt(gained + lost - (gained - lost) ** 2 / count) / count
    return max(centre - half, -1.0), min(centre + half, 1.0)

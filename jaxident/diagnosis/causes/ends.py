"""Which of several ends of a search is taken, where a search was made from several beginnings.

Log evidence alone does not tell. A noise law with much slip, and terms that the corrected model lacks, may explain
poses as well as effects do. On a Husky's log two ends differed by 37 in 41000. The one with more evidence missed unseen
runs by 0.50 m within a second, the other by 0.15 m. So ends are asked what a user asks of the model: to foretell poses.
"""

from collections.abc import Sequence

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.fit.refit import Data, Solution
from jaxident.diagnosis.motion.linear import START_STATES
from jaxident.diagnosis.noise.law import first_law, numbers_seen
from jaxident.diagnosis.preparation.prepare import BURN

SURELY = 1.645
"""Standard errors by which an end must foretell better than that with more evidence: by chance in one case of twenty.
No other value was tried."""
KNOWN = 1e-9
"""Part of the mean information on start states that every window has besides: a window that tells nothing of a start
speed leaves it as it is. No other value was tried."""


def preferred(log_evidence: Sequence[float], missed: Sequence[Array]) -> int:
    """The place of the end with the highest log evidence, or of one that surely foretells better.

    missed: of each end, what `misses` says of the same windows (windows,).
    """
    best = int(np.argmax(log_evidence))
    for k, own in enumerate(missed):
        if k != best and _foretells_better(own, missed[best]):
            best = k
    return best


def _foretells_better(own: Array, other: Array) -> bool:
    """Whether one end runs away in fewer windows than another, or in as many and misses the poses by less, the mean
    difference more than SURELY standard errors."""
    runaways = int(np.sum(np.isposinf(own))), int(np.sum(np.isposinf(other)))
    if runaways[0] != runaways[1]:
        return runaways[0] < runaways[1]
    both = np.isfinite(own) & np.isfinite(other)
    apart = own[both] - other[both]
    return len(apart) > 1 and bool(np.mean(apart) < -SURELY * np.std(apart, ddof=1) / np.sqrt(len(apart)))


def misses(data: Data, fit: Solution) -> np.ndarray:
    """Mean squares (windows,) over the camera's variances by which a fit misses the poses past the first BURN rows of
    each window, foretold from these rows alone under the noise law, as `predict` does. NaN of a window without poses
    there, infinite where the fit runs away.

    The whitener is lower triangular, rows in the order of time. So the start states are least squares on the first
    white residuals; the whitener's own part for later rows takes what is left of these back to metres and radians.
    """
    windows, early = data.windows, 3 * BURN
    white = data.whitener @ np.concatenate([fit.linear.starts, fit.linear.residual[..., None]], axis=2)
    slopes, residual = white[..., :START_STATES], white[..., START_STATES:]
    answers = slopes[:, :early].transpose(0, 2, 1)
    own = answers @ slopes[:, :early]
    own = own + KNOWN * np.diag(np.mean(np.diagonal(own, axis1=1, axis2=2), axis=0))
    left = residual - slopes @ np.linalg.solve(own, answers @ residual[:, :early])
    seen = numbers_seen(windows)[:, early:]
    late = data.whitener[:, early:, early:] + (1.0 - seen)[..., None] * np.eye(seen.shape[1])
    missed = np.linalg.solve(late, left[:, early:])[..., 0]
    law, poses = first_law(windows), np.sum(seen, axis=1)
    missed = missed / np.tile([law.position, law.position, law.heading], len(seen[0]) // 3)
    squares = np.sum(missed**2, axis=1) / np.where(poses > 0, poses, np.nan)
    return np.where((poses > 0) & ~np.isfinite(squares), np.inf, squares)

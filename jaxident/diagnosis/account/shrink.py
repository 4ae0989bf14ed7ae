"""How far the gap shrinks: the share of the refitted model's excess that the corrected model takes away."""

from typing import NamedTuple

import numpy as np

from jaxident.array_types import Array

RESAMPLES = 1000
LEVEL = 0.9
LOW, HIGH = 0.5 - LEVEL / 2, 0.5 + LEVEL / 2
BLOCK = 3
"""Starts that are resampled together: neighbours share the robot's manoeuvre."""


class Shrink(NamedTuple):
    """shrink = 1 - (after - floor) / (refitted - floor) and its 90 % interval; None where no gap stands out."""

    value: float | None
    interval: tuple[float, float] | None


def shrink_of(
    refitted: Array, after: Array, floor: float, draws: Array, wander: Array, seed: int = 0, least: Array | None = None
) -> Shrink:
    """The shrink from squared errors (starts, 3) over the camera's variance, before and after; none where the gap
    before does not stand out from the floor.

    What is saved, refitted - after, is free of the floor: both share the noise. What is left, after - floor, is known
    as well as starts agree and as laws do that are as likely (`draws` of the floor). The interval's lower end knows
    that no model misses by less than the uncertainty of its own parameters does (`wander` (draws,)): where noise
    happens to be low, after < floor, the shrink is above 1, but not surely. It is that of a lower floor if that may be
    the true one (`least` (draws,)).
    """
    kept = np.isfinite(refitted).all(axis=1) & np.isfinite(after).all(axis=1)
    refitted, after = refitted[kept].mean(axis=1), after[kept].mean(axis=1)
    if not len(refitted):
        return Shrink(None, None)
    picks = blocks(np.random.default_rng(seed), len(refitted), len(draws))
    saved, resampled = (refitted - after)[picks].mean(axis=1), after[picks].mean(axis=1)
    left = resampled - draws
    if np.quantile(saved + left, LOW) <= 0.0:
        return Shrink(None, None)
    gap, most = (_at_least(saved, rest, wander) for rest in (left, left if least is None else resampled - least))
    value = float(1.0 - (after.mean() - floor) / (refitted.mean() - floor))
    low, high = np.quantile(saved / most, LOW), np.quantile(1.0 - left / gap, HIGH)
    return Shrink(value, (min(float(low), value), max(float(high), value)))


def _at_least(saved: Array, left: Array, wander: Array) -> np.ndarray:
    """The gap: what is saved and what is left, which is no less than parameters wander."""
    return np.maximum(saved + np.maximum(left, wander), 1e-9)


def interval(errors: Array) -> tuple[float, float]:
    """90 % interval of a mean of squared errors (starts, 3) by resampled starts."""
    mean = errors[np.isfinite(errors).all(axis=1)].mean(axis=1)
    found = mean[blocks(np.random.default_rng(2), len(mean), RESAMPLES)].mean(axis=1)
    low, high = np.quantile(found, [LOW, HIGH])
    return float(low), float(high)


def taken(before: Array, after: Array, total: Array, unit: Array, seed: int) -> tuple[float, float]:
    """The share of a total that one model takes away from another's error, and the probability that it takes none.
    before, after (starts, 3): errors [m, m, rad] of both; unit (3,): the camera's variances; total (starts, 3): squares
    over these."""
    gained, whole = np.mean((before**2 - after**2) / unit, axis=1), np.mean(total, axis=1)
    kept = np.isfinite(gained) & np.isfinite(whole)
    if not kept.any() or not np.isfinite(after[np.isfinite(before)]).all():
        return 0.0, 1.0
    gained, whole = gained[kept], whole[kept]
    drawn = gained[blocks(np.random.default_rng(seed), len(gained), RESAMPLES)].mean(axis=1)
    return float(gained.mean() / whole.mean()), float(np.mean(drawn <= 0.0))


def blocks(rng, count: int, resamples: int) -> np.ndarray:
    """Resampled places (resamples, count) in blocks."""
    length = min(BLOCK, count)
    starts = rng.integers(0, count, size=(resamples, -(-count // length)))
    return ((starts[..., None] + np.arange(length)) % count).reshape(resamples, -1)[:, :count]

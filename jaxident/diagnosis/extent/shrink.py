"""How far the gap shrinks: the share of the refitted model's excess that the corrected model takes away."""

from typing import NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.extent.floor import Floor

RESAMPLES = 1000
LEVEL = 0.9
LOW, HIGH = 0.5 - LEVEL / 2, 0.5 + LEVEL / 2
BLOCK = 3
"""Windows that are resampled together: neighbours overlap and share the robot's manoeuvre."""


class Shrink(NamedTuple):
    """shrink = 1 - (after - floor) / (refitted - floor) and its 90 % interval; None where no gap stands out."""

    value: float | None
    interval: tuple[float, float] | None


def shrink_of(
    refitted: Array, after: Array, floor: Floor, wander: Array, seed: int = 0, least: Array | None = None
) -> Shrink:
    """The shrink from squared errors (windows, 3) before and after; none where the gap before does not stand out,
    neither from replays of noise nor from one resample to the next.

    What is saved, refitted - after, is free of the floor: both share the noise. What is left, after - floor, is known
    no better than replays of the floor agree, and as far as windows differ by more than noise. The interval's lower
    end knows that no model misses by less than the uncertainty of its own parameters does (`wander` (replays,), see
    floor): where noise happens to be low, after < floor, the shrink is above 1, but not surely. It is that of a lower
    floor if that may be the true one (`least` (replays,)).
    """
    kept = np.isfinite(refitted).all(axis=1) & np.isfinite(after).all(axis=1)
    refitted, after = refitted[kept].mean(axis=1), after[kept].mean(axis=1)
    if not len(refitted) or refitted.mean() <= np.quantile(floor.replays, HIGH):
        return Shrink(None, None)
    rng, replays = np.random.default_rng(seed), len(floor.replays)
    picks = _blocks(rng, len(refitted), replays)
    saved, resampled = (refitted - after)[picks].mean(axis=1), after[picks].mean(axis=1)
    unit = rng.normal(size=replays)

    def left_above(noise: Array) -> np.ndarray:
        beyond_noise = np.sqrt(max(np.var(resampled) - np.var(noise), 0.0))
        return after.mean() - noise + beyond_noise * unit

    left = left_above(floor.replays)
    if np.quantile(saved + left, LOW) <= 0.0:
        return Shrink(None, None)
    gap, most = (_at_least(saved, rest, wander) for rest in (left, left if least is None else left_above(least)))
    value = float(1.0 - (after.mean() - floor.value) / (refitted.mean() - floor.value))
    low, high = np.quantile(saved / most, LOW), np.quantile(1.0 - left / gap, HIGH)
    return Shrink(value, (min(float(low), value), max(float(high), value)))


def _at_least(saved: Array, left: Array, wander: Array) -> np.ndarray:
    """The gap: what is saved and what is left, which is no less than parameters wander."""
    return np.maximum(saved + np.maximum(left, wander), 1e-9)


def interval(errors: Array) -> tuple[float, float]:
    """90 % interval of a mean of squared errors (windows, 3) by resampled windows."""
    mean = errors[np.isfinite(errors).all(axis=1)].mean(axis=1)
    found = mean[_blocks(np.random.default_rng(2), len(mean), RESAMPLES)].mean(axis=1)
    low, high = np.quantile(found, [LOW, HIGH])
    return float(low), float(high)


def _blocks(rng, count: int, resamples: int) -> np.ndarray:
    """Resampled places (resamples, count) in blocks."""
    length = min(BLOCK, count)
    starts = rng.integers(0, count, size=(resamples, -(-count // length)))
    return ((starts[..., None] + np.arange(length)) % count).reshape(resamples, -1)[:, :count]

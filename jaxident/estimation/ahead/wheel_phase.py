"""The angle at which a wheel begins, for laws that go by it: no camera sees it, but poses before a start tell it."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from jaxident.array_types import Array
from jaxident.estimation.ahead.stretches import Starts

GRID = 12
"""Angles that are tried, round the circle. No other number was tried."""
CLOSER = 3.0
"""How much closer together three angles are that are tried about the best one. No other was tried."""
FOLLOWED = 100
"""Rows at most between two starts at which the whole circle is tried, half of what the filter takes in. From one to the
next the poses tell how far the wheels have turned, and three angles about that are tried at each start."""
UNKNOWN = np.pi / np.sqrt(3.0)
"""Deviation [rad] of an angle of which nothing is known."""

Misfit = Callable[[Array, Sequence[int]], Array]
"""Sums of squares (n, starts) with wheels at each of some phases (n, laws, starts), some of the laws acting."""


def phases_of(misfit: Misfit, laws: Sequence[int], shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Phases (laws, starts) [rad], 0 for laws not in `laws`, and their deviations [rad]; shape: laws, starts. The laws,
    the one that brings most first, are looked for one after the other, each beside those before it; then all but the
    last once more beside all."""
    phase, step = np.zeros(shape), 2.0 * np.pi / GRID
    for k, acting in [(k, laws[: n + 1]) for n, k in enumerate(laws)] + [(k, laws) for k in laws[:-1]]:
        whole = _squares(misfit, phase, k, acting, step * np.arange(GRID))
        phase[k] = step * whole.argmin(axis=0)
        phase[k], _ = _vertex(misfit, phase, k, acting, step)
    return closer(misfit, laws, phase)


def closer(misfit: Misfit, laws: Sequence[int], phase: Array) -> tuple[np.ndarray, np.ndarray]:
    """Phases (laws, starts) that fit best near some, and their deviations [rad]."""
    phase, deviation = np.array(phase), np.full(phase.shape, UNKNOWN)
    for k in laws:
        phase[k], deviation[k] = _vertex(misfit, phase, k, laws, 2.0 * np.pi / GRID / CLOSER)
    return phase, deviation


def followed(starts: Starts) -> np.ndarray:
    """Of each start the number of that one, itself or before it in its run, whose phases it goes on from (starts,): one
    that knew two thirds of as many rows, and stands less than FOLLOWED before it."""
    own = np.arange(len(starts.row))
    for run in np.unique(starts.run):
        here = np.flatnonzero(starts.run == run)
        last = -1
        for k in here[np.argsort(starts.row[here], kind="stable")]:
            if last < 0 or starts.row[k] - starts.row[last] >= min(FOLLOWED, starts.row[last] / 2):
                last = k
            own[k] = last
    return own


def _squares(misfit: Misfit, phase: Array, law: int, acting: Sequence[int], angles: Iterable[Array]) -> np.ndarray:
    """Sums of squares (angles, starts) with the wheel of one law at some angles."""
    of_law = (np.arange(len(phase)) == law)[:, None]
    return misfit(np.stack([np.where(of_law, angle, phase) for angle in angles]), acting)


def _vertex(
    misfit: Misfit, phase: Array, law: int, acting: Sequence[int], step: float
) -> tuple[np.ndarray, np.ndarray]:
    """Phase (starts,) of one law where a parabola through three values, a step apart, is least, at most a step away,
    and its deviation."""
    middle = phase[law]
    before, here, after = _squares(misfit, phase, law, acting, (middle - step, middle, middle + step))
    bend = np.maximum(before - 2.0 * here + after, 1e-12)
    best = middle + step * np.clip(0.5 * (before - after) / bend, -1.0, 1.0)
    return best, np.minimum(step * np.sqrt(2.0 / bend), UNKNOWN)

"""The angle at which a wheel begins, for laws that go by it: no camera sees it, but poses before a start tell it."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from jaxident.array_types import Array
from jaxident.estimation.ahead.stretches import Starts

GRID = 12
"""Angles that are tried, round the circle; a parabola through the best one and its neighbours gives the rest."""
ZOOMS, CLOSER = 2, 4.0
"""Times that three angles closer together are tried, and how much closer. No others were tried."""
APART = 100
"""Rows between two starts at which phases are looked for, half of what the filter takes in. With all starts a
prediction took five times as long."""
UNKNOWN = np.pi / np.sqrt(3.0)
"""Deviation [rad] of an angle of which nothing is known."""


def phases_of(misfit: Callable[[Array, Sequence[int]], Array], laws: Sequence[int], shape: tuple[int, int]) -> tuple:
    """Phases (laws, starts) [rad], 0 for laws not in `laws`, and their deviations [rad].

    misfit(phases, acting): sums of squares (starts,) with some laws acting; shape: laws, starts. Each law is looked for
    by itself first, and where there are several, once more beside the others.
    """
    phase, deviation = np.zeros(shape), np.zeros(shape)
    rounds = [(k, [k]) for k in laws] + [(k, list(laws)) for k in laws if len(laws) > 1]
    for k, acting in rounds:
        phase[k], deviation[k] = _best(misfit, phase, k, acting)
    return phase, deviation


def followed(starts: Starts) -> np.ndarray:
    """Of each start the number of that one, itself or before it in its run, whose phases it goes on from (starts,).

    From one to the next lie APART rows at least; between them the poses tell how far the wheels have turned."""
    own = np.arange(len(starts.row))
    for run in np.unique(starts.run):
        last = -1
        for k in np.flatnonzero(starts.run == run)[np.argsort(starts.row[starts.run == run], kind="stable")]:
            if last < 0 or starts.row[k] - starts.row[last] >= APART:
                last = k
            own[k] = last
    return own


def _best(misfit, phase: Array, law: int, acting: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """The phase (starts,) of one law that fits best, and its deviation."""

    def squares(angles: Iterable[Array]) -> np.ndarray:
        of_law = (np.arange(len(phase)) == law)[:, None]
        return np.array([misfit(np.where(of_law, angle, phase), acting) for angle in angles])

    step = 2.0 * np.pi / GRID
    whole = squares(step * np.arange(GRID))
    at = whole.argmin(axis=0)
    best, bend = _vertex(step * at, step, *(np.take_along_axis(whole, (at + k)[None] % GRID, 0)[0] for k in (-1, 0, 1)))
    for _ in range(ZOOMS):
        step = step / CLOSER
        best, bend = _vertex(best, step, *squares([best - step, best, best + step]))
    return best, np.minimum(np.sqrt(2.0 / bend), UNKNOWN)


def _vertex(middle: Array, step: float, before: Array, here: Array, after: Array) -> tuple[np.ndarray, np.ndarray]:
    """Where a parabola through three values is least, at most a step away, and its second derivative."""
    bend = np.maximum(before - 2.0 * here + after, 1e-12)
    return middle + step * np.clip(0.5 * (before - after) / bend, -1.0, 1.0), bend / step**2

"""Which rows a log of several streams has: one per event, or even ones; and what of each stream stands in each row."""

import numpy as np

from jaxident.errors import InputError

ROUNDING = 1e-3
"""Rounding of time stamps, in periods: a command that comes this much after a row is still the row's own."""
SAME_TIME = 1e-6
"""Times less than this [s] apart are one: adding an offset to decimal stamps moves them by a rounding error."""
MOST_ROWS = 20_000_000
"""Most rows of an even log; more than that is two clocks mistaken for one."""

Rows = tuple[np.ndarray, np.ndarray, list[np.ndarray]]
"""Times of the rows, the command in force, and for each sensor its measurement or -1 for none, both as indices."""


def by_event(held_t: np.ndarray, sensors: list[np.ndarray]) -> Rows:
    """A row for each command (commands,) and each measurement that is not before the first command; sensors: times
    (measurements,) of each."""
    t, moved = held_t, []
    for own in sensors:
        last = np.maximum(np.searchsorted(t, own + SAME_TIME, side="right") - 1, 0)
        moved.append(np.where(np.abs(own - t[last]) <= SAME_TIME, t[last], own))
        t = np.union1d(t, moved[-1][moved[-1] >= held_t[0]])
    return t, np.searchsorted(held_t, t, side="right") - 1, [_at(t, own) for own in moved]


def _at(t: np.ndarray, own: np.ndarray) -> np.ndarray:
    """The measurement (rows,) whose time is that of the row, -1 for none."""
    nearest = np.minimum(np.searchsorted(own, t), len(own) - 1)
    return np.where(own[nearest] == t, nearest, -1)


def by_period(held_t: np.ndarray, sensors: list[np.ndarray], end: float, period: float) -> Rows:
    """As `by_event`, on the even grid; times are compared as counts of periods since the first row."""
    with np.errstate(over="ignore"):  # infinitely many rows are too many too
        rows = np.floor((end - held_t[0]) / period + ROUNDING) + 1
    if rows > MOST_ROWS:
        raise InputError(
            f"period: {period:g} s makes {rows:.3g} rows between {held_t[0]:.10g} s and {end:.10g} s; are both streams "
            "on one clock?"
        )
    row = np.arange(int(rows))
    in_force = np.searchsorted((held_t - held_t[0]) / period, row + ROUNDING, side="right") - 1
    return held_t[0] + period * row, in_force, [_nearest((own - held_t[0]) / period, len(row)) for own in sensors]


def _nearest(count: np.ndarray, rows: int) -> np.ndarray:
    """The measurement (rows,) nearest to each row within half a period, -1 for none; each is used once at most."""
    nearest = np.floor(count + 0.5)
    order = np.lexsort((np.abs(count - nearest), nearest))  # by row, the nearest first
    row_of_own, first = np.unique(nearest[order], return_index=True)
    inside = (row_of_own >= 0) & (row_of_own < rows)
    found = np.full(rows, -1)
    found[row_of_own[inside].astype(int)] = order[first[inside]]
    return found

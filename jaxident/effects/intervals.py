"""The time grid of the full simulator: substeps of the camera's intervals, and what happens between the rows.

Between two points of the grid the command at the end of the delay line is held and the payload stays as it is, so that
a delay of any real length switches where it should, whatever the steps.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp

from jaxident.array_types import Array, Wheels


class Grid(NamedTuple):
    """Intervals from each point of the grid to the next.

    start [s], command, row (the camera row before it), changed (a tuple: whether each load has): of each interval.
    step [s]: of each interval, or where nothing happens between the rows, of the intervals
    within each row. at_row (samples,): the point at which each camera row lies.
    """

    start: Any
    step: Any
    command: Wheels
    row: Any
    changed: Any
    at_row: Any

    def spread(self, value: Array) -> Array:
        """A value per step as a value per interval."""
        return value if len(self.step) == len(self.start) else value[self.row]


def make_grid(
    t: Array, command: Wheels, substeps: int, *, arrivals: Array | None = None, changes: Sequence[Array] = ()
) -> Grid:
    """The grid for camera times and commands (samples,), times (samples,) at which they take effect, never decreasing,
    None for at once, and times [s] at which loads change.

    Commands given before the first row are zero; the last command acts on nothing, and may be missing. Without arrivals
    and changes, (samples - 1) substeps intervals; each arrival of a command, and a change, cuts one in two. Points at
    the same time keep the order rows, arrivals: the derivative at zero delay is that of a growing delay.
    """
    samples, long = len(t), jnp.diff(t)
    inside = t[:-1, None] + long[:, None] * (jnp.arange(substeps) / substeps)
    points = jnp.append(inside.ravel(), t[-1])
    if arrivals is None and not changes:
        row = jnp.repeat(jnp.arange(samples - 1), substeps)
        at_row = substeps * jnp.arange(samples)
        return Grid(points[:-1], long / substeps, Wheels(*(jnp.asarray(u)[row] for u in command)), row, (), at_row)
    events, numbers = _events(jnp.zeros(0) if arrivals is None else jnp.minimum(arrivals, t[-1]), t, changes)
    after = jnp.searchsorted(points, events, side="right")
    happens = jnp.zeros(len(points) + len(events), jnp.int32).at[after + jnp.arange(len(events))].set(1)
    past = jnp.cumsum(happens)
    place = jnp.arange(len(past), dtype=jnp.int32) - past
    merged = jnp.where(happens == 1, events[past - 1], points[place])
    changed = tuple((past > number)[:-1] for number in numbers)
    row = place[:-1] // substeps
    arrived = row + 1 if arrivals is None else past[:-1] - sum(changed)
    acting = jnp.arange(samples) < samples - 1
    line = (jnp.concatenate([jnp.zeros(1), jnp.where(acting, u, 0.0)]) for u in command)
    at_row = substeps * jnp.arange(samples) + jnp.searchsorted(events, t)
    return Grid(merged[:-1], jnp.diff(merged), Wheels(*(u[arrived] for u in line)), row, changed, at_row)


def _events(arrivals: Array, t: Array, changes: Sequence[Array]) -> tuple[Array, list[Array]]:
    """Arrivals and changes in the order of time, and the numbers of the changes among them."""
    events = arrivals
    numbers: list[Any] = []
    for instant in changes:
        change = jnp.clip(instant, t[0], t[-1])
        number = jnp.searchsorted(events, change)
        events = _insert(events, number, change)
        numbers = [*(one + (one >= number) for one in numbers), number]
    return events, numbers


def _insert(values: Array, place: Array, value: Array) -> Array:
    """The values (n,) with another one before `place`."""
    rows = jnp.arange(len(values) + 1)
    longer = jnp.append(values, value)
    return jnp.where(rows < place, longer, jnp.where(rows == place, value, jnp.roll(longer, 1)))

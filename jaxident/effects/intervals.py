"""The time grid of the full simulator: camera rows, the moments at which delayed commands arrive, a payload change.

Between two points of the sorted grid the command at the end of the delay line is held, so that a delay of any real
length switches where it should, whatever the steps. Without a delay every second interval has length zero.
"""

from typing import Any, NamedTuple

import jax.numpy as jnp

from jaxident.array_types import Array, Wheels

ROW, ARRIVAL, CHANGE = 0, 1, 2


class Grid(NamedTuple):
    """Sorted points, of which there are 2 samples + 1, and the 2 samples intervals from each to the next.

    start, step [s]: of each interval; command: what the delay line gives in it; row: the camera row before it;
    changed: whether the payload has changed; at_row (samples,): the point at which each camera row lies.
    """

    start: Any
    step: Any
    command: Wheels
    row: Any
    changed: Any
    at_row: Any


def make_grid(t: Array, command: Wheels, delay: Array, change: Array) -> Grid:
    """The grid for camera times and commands (samples,), a delay [s] and the time [s] of a payload change.

    Commands given before the first row are zero; the last command acts on nothing, and may be missing. Points at the
    same time keep the order rows, arrivals, change: the derivative at zero delay is that of a growing delay.
    """
    samples = len(t)
    points = jnp.concatenate([t, jnp.minimum(t + delay, t[-1]), jnp.clip(change, t[0], t[-1])[None]])
    kinds = jnp.repeat(
        jnp.array([ROW, ARRIVAL, CHANGE]), jnp.array([samples, samples, 1]), total_repeat_length=len(points)
    )
    order = jnp.argsort(points, stable=True)
    points, kinds = points[order], kinds[order]
    arrived = jnp.cumsum(kinds == ARRIVAL)[:-1]
    acting = jnp.arange(samples) < samples - 1
    line = Wheels(*(jnp.concatenate([jnp.zeros(1), jnp.where(acting, u, 0.0)]) for u in command))
    return Grid(
        start=points[:-1],
        step=jnp.diff(points),
        command=Wheels(*(u[arrived] for u in line)),
        row=jnp.cumsum(kinds == ROW)[:-1] - 1,
        changed=jnp.cumsum(kinds == CHANGE)[:-1] > 0,
        at_row=jnp.argsort(order)[:samples],
    )

"""One row of the two regressions (15) and (16) from one sample, also where camera poses are missing.

Unknowns of each equation, in this order: [a, d_r, D_r d_r, -e_r, d_l, D_l d_l, -e_l].
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Increment, Wheels
from jaxident.estimation.increments.observations import Observations
from jaxident.robot.dead_zone import dead_zone

UNKNOWNS = 7
Vector = tuple[Any, ...]
"""Seven scalars: a regressor or the unknowns of one equation. Under vmap each becomes a row of trials."""


class Memory(NamedTuple):
    """What the next row needs of the past.

    past: the last increment, measured, or predicted inside a gap. known: whether there is one yet in this run.
    total: regressors of both equations summed since the last pose; count: how many. The last three are None for a
    single run without missing poses, which then costs nothing extra.
    """

    past: Increment
    known: Any = None
    total: tuple[Vector, Vector] | None = None
    count: Any = None


class Row(NamedTuple):
    """Regressors of both equations, the measured increment, and whether the row may be used (None: it may)."""

    length: Vector
    turn: Vector
    increment: Increment
    usable: Any


def key_terms(last: Array, command: Wheels, before: Wheels, width: Wheels) -> Vector:
    """Regressor of (15) or (16): the equation's last increment, and for each wheel the switched command u_{k-1},
    the switch f_{k-1} of (17)-(18) and m_{k-2}, all at the current dead-zone estimate."""

    def wheel(u: Array, u_before: Array, d: Array) -> Vector:
        outside = jnp.abs(u) > d
        return jnp.where(outside, u, 0.0), jnp.where(outside, -jnp.sign(u), 0.0), dead_zone(u_before, d)

    right = wheel(command.right, before.right, width.right)
    return (last, *right, *wheel(command.left, before.left, width.left))


def dot(a: Vector, b: Vector) -> Array:
    """Sum of products of two vectors of scalars."""
    return sum(x * y for x, y in zip(a, b, strict=True))


def empty_memory() -> Memory:
    """Memory at the start of a log whose poses may be missing."""
    zero = (0.0,) * UNKNOWNS
    return Memory(Increment(0.0, 0.0), False, (zero, zero), 0.0)


def next_row(
    memory: Memory, unknowns: tuple[Vector, Vector], width: Wheels, sample: Observations
) -> tuple[Row, Memory]:
    """The row that a sample adds, and the memory after it.

    Where no pose is missing this is (15)-(16) as printed. Over a gap the equations of its samples are summed: the
    sum of increments is measured, and the increments inside come from the current estimate, moved by an equal share
    of the sum's error once the next pose arrives. With a gap of one sample the two agree.
    """
    inputs = sample.command, sample.command_before, width
    rows = key_terms(memory.past.length, *inputs), key_terms(memory.past.turn, *inputs)
    if memory.total is None:
        return Row(rows[0], rows[1], sample.increment, None), Memory(sample.increment)
    known = memory.known & sample.inside
    count = jnp.where(sample.inside, memory.count + 1.0, 0.0)
    total = _add_where(known, memory.total[0], rows[0]), _add_where(known, memory.total[1], rows[1])
    past = Increment(
        *(
            _last_increment(measured, dot(row, theta), dot(summed, theta), count, known, sample.measured)
            for measured, row, summed, theta in zip(sample.increment, rows, total, unknowns, strict=True)
        )
    )
    kept = jax.tree.map(lambda x: jnp.where(sample.seen, 0.0, x), total)
    after = Memory(past, known | sample.measured, kept, jnp.where(sample.seen, 0.0, count))
    return Row(total[0], total[1], sample.increment, known & sample.measured), after


def _add_where(known: Array, total: Vector, row: Vector) -> Vector:
    return tuple(jnp.where(known, old + new, 0.0) for old, new in zip(total, row, strict=True))


def _last_increment(measured, predicted, predicted_sum, count, known, closes):
    """Best guess of the sample's own increment: the prediction plus its share of the gap's error; before anything
    is known, the mean increment of the gap."""
    samples = jnp.maximum(count, 1.0)
    share = jnp.where(closes, (measured - predicted_sum) / samples, 0.0)
    return jnp.where(known, predicted + share, measured / samples)

"""What is linear in (13)-(14) solved for in closed form, given the dead zones and the poles.

Variable projection (Golub and Pereyra 1973): what the best numerators leave of the measured increments, and how that
answers the dead zones and poles, in Kaufman's form (1975), which misses only what vanishes with the residual itself.
A point is (4,): the dead zones D_r and D_l, then the poles of both channels.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array
from jaxident.estimation.observations import Observations
from jaxident.estimation.readings import Reading
from jaxident.numerics import safe_divide
from jaxident.robot.dead_zone import dead_zone

RIDGE = 1e-13
"""Smallest pivot, relative to the diagonal: an input that never leaves its dead zone gets the coefficient 0."""


class Projected(NamedTuple):
    """residual (2, samples) of both channels [m], [rad]; numerator (2, 4), the coefficients of m_r and m_l at k-1,
    then at k-2; slope (2, 3, samples), of the residual by either dead zone and the channel's own pole."""

    residual: Any
    numerator: Any
    slope: Any


def project(reading: Reading, observations: Observations, point: Array) -> Projected:
    """What is left at a point (4,), and how it changes around it."""
    commands = jnp.stack([*observations.command, *observations.command_before])
    widths = jnp.tile(point[:2], 2)[:, None]
    passed = dead_zone(commands, widths)
    switch = jnp.where(jnp.abs(commands) > widths, -jnp.sign(commands), 0.0)

    def channel(pole: Array, increments: Array) -> Projected:
        regression = reading.regress(pole, jnp.vstack([passed, switch]), increments)
        inputs, switches = regression.columns[:4], regression.columns[4:]
        weights, rest = _fit(inputs, regression.target[None])
        first = weights[0]
        by_width = (first[:, None] * switches).reshape(2, 2, -1).sum(axis=0)
        weights, left = _fit(inputs, jnp.vstack([by_width, regression.slope(first), rest]))
        return Projected(left[3], first + weights[3], -left[:3])

    return jax.vmap(channel)(point[2:], jnp.stack(observations.increment))


def linear_residual(reading: Reading, observations: Observations, increments: Array) -> Array:
    """What a fit of one channel without dead zones leaves, (samples,), the pole among its coefficients."""
    commands = jnp.stack([*observations.command, *observations.command_before])
    regression = reading.regress(jnp.zeros(()), commands, increments)
    columns = jnp.vstack([regression.columns, regression.slope(jnp.zeros(0))])
    return _fit(columns, regression.target[None])[1][0]


def _fit(columns: Array, targets: Array) -> tuple[Array, Array]:
    """Weights (t, n) of columns (n, samples) in targets (t, samples), and what they leave of these."""
    table = jnp.vstack([columns, targets])
    weights = eliminate(table @ table.T, len(columns))[: len(columns), len(columns) :].T
    return weights, targets - weights @ columns


def eliminate(table: Array, count: int) -> Array:
    """Gauss-Jordan elimination of the first `count` of n signals from their inner products (n, n, ...).

    Afterwards [i, j] holds, for i < count <= j, the least-squares weight of signal i in signal j; for i, j >= count
    the inner product of what remains of the two. Plain arithmetic runs over thousands of tables at once, where LAPACK
    would be called for each.
    """
    diagonal = [table[i, i] for i in range(count)]
    pivot_row = jnp.arange(len(table)).reshape(-1, *[1] * (table.ndim - 1))
    for i, size in enumerate(diagonal):
        row = table[i] * _inverse(table[i, i], size)
        table = jnp.where(pivot_row == i, row, table - table[:, i, None] * row)
    return table


def profile(reading: Reading, observations: Observations, point: Array, rights: Array, lefts: Array):
    """Sums of squared residuals and best poles, both (2, n, m), for all pairs of n right and m left dead zones.

    The poles are eliminated like the numerators: exactly in one step, to first order around `point` in free run. A
    few products of all signals serve every pair; cancellation leaves an error of about 1e-13 of the target's square.
    """
    commands = observations.command, observations.command_before
    centre = jnp.vstack([dead_zone(jnp.stack(u), point[:2, None]) for u in commands])
    right, left = (
        jnp.vstack([dead_zone(u[wheel], widths[:, None]) for u in commands])
        for wheel, widths in enumerate((rights, lefts))
    )

    def channel(pole: Array, increments: Array) -> tuple[Array, Array]:
        columns, target, slope_under = reading.regress(pole, centre, increments)
        behind = jnp.stack([slope_under(_fit(columns, target[None])[0][0]), target])
        right_columns, left_columns = (reading.regress(pole, side, increments).columns for side in (right, left))
        products = _schur(_pairs(right_columns, left_columns, behind), 4, 6)
        move = safe_divide(products[4, 5], products[4, 4], 0.0)
        return jnp.maximum(products[5, 5] - move * products[4, 5], 0.0), pole + move

    return jax.vmap(channel)(point[2:], jnp.stack(observations.increment))


Products = dict[tuple[int, int], Array]
"""Inner products of signals i <= j, entry by entry: arrays that broadcast against each other over many tables."""


def _schur(products: Products, count: int, size: int) -> Products:
    """What remains of the inner products of `size` signals once the first `count` have explained their share.

    Entry by entry instead of as one array: the compiler then makes one kernel of the whole elimination.
    """
    left = dict(products)
    for k in range(count):
        inverse = _inverse(left[k, k], products[k, k])
        for i in range(k + 1, size):
            weight = left[k, i] * inverse
            for j in range(i, size):
                left[i, j] = left[i, j] - weight * left[k, j]
    return left


def _pairs(right: Array, left: Array, behind: Array) -> Products:
    """Inner products of two signals each of right (2 n, samples), left (2 m, samples) and behind (2, samples), for
    every pair of a right and a left dead zone: entries broadcast to (n, m). The signals of k-1 come first, then those
    of k-2. Products of inputs alone are shared where their channels are."""
    cross, right_behind, left_behind, own = right @ left.T, right @ behind.T, left @ behind.T, behind @ behind.T
    n, m = len(right) // 2, len(left) // 2
    rights, lefts = (slice(0, n), slice(n, None)), (slice(0, m), slice(m, None))
    entries: Products = {}
    for i in range(2):
        for j in range(2):
            entries[i, 2 + j] = cross[rights[i], lefts[j]]
            entries[i, 4 + j] = right_behind[rights[i], j, None]
            entries[2 + i, 4 + j] = left_behind[None, lefts[i], j]
            if i <= j:
                entries[i, j] = jnp.sum(right[rights[i]] * right[rights[j]], axis=1)[:, None]
                entries[2 + i, 2 + j] = jnp.sum(left[lefts[i]] * left[lefts[j]], axis=1)[None]
                entries[4 + i, 4 + j] = own[i, j]
    return entries


def _inverse(pivot: Array, size: Array) -> Array:
    """1 / pivot, no smaller than RIDGE of the diagonal that it began as; 0 for a signal of zeros."""
    return safe_divide(1.0, jnp.maximum(pivot, RIDGE * size), 0.0)

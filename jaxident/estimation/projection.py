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
    n, m = len(rights), len(lefts)
    commands = jnp.stack(observations.command), jnp.stack(observations.command_before)
    centre = [dead_zone(u, point[:2, None]) for u in commands]
    passed = [dead_zone(u[k], d[:, None]) for k, d in enumerate((rights, lefts)) for u in commands]

    def channel(pole: Array, increments: Array) -> tuple[Array, Array]:
        columns, target, slope_under = reading.regress(pole, jnp.vstack([*centre, *passed]), increments)
        slope = slope_under(_fit(columns[:4], target[None])[0][0])
        right, left = columns[4 : 4 + 2 * n].reshape(2, n, -1), columns[4 + 2 * n :].reshape(2, m, -1)
        (slopes, both), (_, squares) = _schur(_pairs(right, left, jnp.stack([slope, target])), 4)
        move = safe_divide(both, slopes, 0.0)
        return jnp.maximum(squares - move * both, 0.0), pole + move

    return jax.vmap(channel)(point[2:], jnp.stack(observations.increment))


def _schur(table: Array, count: int) -> Array:
    """What remains of inner products (n, n, ...) once the first `count` signals have explained their share."""
    diagonal = [table[i, i] for i in range(count)]
    for size in diagonal:
        row = table[0, 1:] * _inverse(table[0, 0], size)
        table = table[1:, 1:] - table[1:, 0, None] * row
    return table


def _pairs(right: Array, left: Array, behind: Array) -> Array:
    """Inner products (6, 6, n, m) of right (2, n, samples), left (2, m, samples) and behind (2, samples) signals, for
    every pair of a right and a left dead zone. Products of inputs alone are shared where their channels are."""
    shape = 2, 2, right.shape[1], left.shape[1]
    blocks = {
        (0, 0): jnp.einsum("ink,jnk->ijn", right, right)[..., None],
        (0, 1): jnp.einsum("ink,jmk->ijnm", right, left),
        (0, 2): jnp.einsum("ink,jk->ijn", right, behind)[..., None],
        (1, 1): jnp.einsum("imk,jmk->ijm", left, left)[:, :, None],
        (1, 2): jnp.einsum("imk,jk->ijm", left, behind)[:, :, None],
        (2, 2): (behind @ behind.T)[..., None, None],
    }
    full = [[blocks[i, j] if i <= j else blocks[j, i].swapaxes(0, 1) for j in range(3)] for i in range(3)]
    return jnp.concatenate([jnp.concatenate([jnp.broadcast_to(b, shape) for b in row], axis=1) for row in full])


def _inverse(pivot: Array, size: Array) -> Array:
    """1 / pivot, no smaller than RIDGE of the diagonal that it began as; 0 for a signal of zeros."""
    return safe_divide(1.0, jnp.maximum(pivot, RIDGE * size), 0.0)

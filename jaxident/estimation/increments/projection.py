"""What is linear in (13)-(14) solved for in closed form, given the dead zones and the poles.

Variable projection (Golub and Pereyra 1973): what the best numerators leave of the measured increments, and how that
answers the dead zones and poles, in Kaufman's form (1975), which misses only what vanishes with the residual itself.
A point is (4,): the dead zones D_r and D_l, then the poles of both channels.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, ChannelSamples, Column, Samples, SearchPoint, Signals, Square
from jaxident.estimation.increments.input_forms import Reading
from jaxident.estimation.increments.observations import Observations
from jaxident.numerics import safe_divide
from jaxident.robot.dead_zone import dead_zone

RIDGE = 1e-13
"""Smallest pivot, relative to the diagonal: an input that never leaves its dead zone gets the coefficient 0."""


class Projected(NamedTuple):
    """residual (2, samples) of both channels [m], [rad]; numerator (2, 4), the coefficients of m_r and m_l at k-1,
    then at k-2; products (2, 4, 4), inner products of the residual's slopes by either dead zone and by the channel's
    own pole, and of the residual itself."""

    residual: Any
    numerator: Any
    products: Any


def project(reading: Reading, observations: Observations, point: SearchPoint) -> Projected:
    """What is left at a point (4,), and how it changes around it."""
    commands = jnp.stack([*observations.command, *observations.command_before])
    widths = jnp.tile(point[:2], 2)[:, None]
    passed = dead_zone(commands, widths)
    switch = jnp.where(jnp.abs(commands) > widths, -jnp.sign(commands), 0.0)

    signals = jnp.concatenate([passed, switch])

    def channel(pole: Array, increments: Array) -> Projected:
        columns, target, slope_under = reading.regress(pole, signals, increments)
        own = columns @ columns.T
        first = _weights(own[:4, :4], (columns @ target)[:4, None])[0][0]
        rest = target - jnp.concatenate([first, jnp.zeros(4)]) @ columns
        # The fit repeated on what it left loses no digits. Its targets are mixed from products, not from signals.
        behind = jnp.stack([slope_under(first), rest])
        across = columns @ behind.T
        table = jnp.block([[own, across], [across.T, behind @ behind.T]])
        mixture = _mixture(first)
        across = table[:4] @ mixture.T
        weights, products = _weights(own[:4, :4], across, mixture @ table @ mixture.T)
        return Projected(rest - jnp.concatenate([weights[3], jnp.zeros(4)]) @ columns, first + weights[3], products)

    return jax.vmap(channel)(point[2:], jnp.stack(observations.increment))


def _mixture(first: SearchPoint) -> Array:
    """The residual's slopes by either dead zone and the pole, and the residual, as mixtures (4, 10) of four passed
    inputs, their four switches, the prediction's slope by the pole, and the residual; first (4,): the weights."""
    wheels = -jnp.tile(jnp.eye(2), 2) * first
    return jnp.block(
        [[jnp.zeros((2, 4)), wheels, jnp.zeros((2, 2))], [jnp.zeros((2, 8)), jnp.diag(jnp.array([-1.0, 1.0]))]]
    )


def linear_residual(reading: Reading, observations: Observations, increments: Samples) -> Samples:
    """What a fit of one channel without dead zones leaves, (samples,), the pole among its coefficients."""
    commands = jnp.stack([*observations.command, *observations.command_before])
    regression = reading.regress(jnp.zeros(()), commands, increments)
    columns = jnp.vstack([regression.columns, regression.slope(jnp.zeros(0))])
    return regression.target - _fit(columns, regression.target) @ columns


def _fit(columns: Signals, target: Samples) -> Column:
    """Least-squares weights (n,) of columns (n, samples) in a target (samples,)."""
    return _weights(columns @ columns.T, (columns @ target)[:, None])[0][0]


def _weights(own: Square, across: Array, among: Array | None = None) -> tuple[Array, Array]:
    """From inner products of n columns (n, n), of these with t targets (n, t), and of the targets (t, t): weights
    (t, n), and the inner products (t, t) of what they leave."""
    n, t = across.shape
    table = jnp.block([[own, across], [across.T, jnp.zeros((t, t)) if among is None else among]])
    table = eliminate(table, n)
    return table[:n, n:].T, table[n:, n:]


def triangle(products: Square) -> Square:
    """The upper triangular R (n, n) with R' R = products (n, n): n numbers a signal that stand for its samples where
    inner products alone count. Dependent signals leave zeros."""
    left, rows = products, []
    for i in range(len(products)):
        row = left[i] * jnp.sqrt(_inverse(left[i, i], products[i, i]))
        rows.append(jnp.where(jnp.arange(len(products)) < i, 0.0, row))
        left = left - rows[-1][:, None] * rows[-1]
    return jnp.stack(rows)


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


def inputs_of(observations: Observations) -> Array:
    """Commands (2, 2, samples) of either wheel, at k-1 and at k-2: what `profile` works on, laid out once."""
    pairs = zip(observations.command, observations.command_before, strict=True)
    return jnp.stack([jnp.stack(pair) for pair in pairs])


def profile(
    reading: Reading, inputs: Array, increments: ChannelSamples, point: SearchPoint, rights: Column, lefts: Array
):
    """Sums of squared residuals and best poles, both (2, n, m), for all pairs of n right and m left dead zones.

    inputs (2, 2, samples) as `inputs_of` lays them out, increments (2, samples). The poles are eliminated like the
    numerators: exactly in one step, to first order around `point` in free run. A few products of all signals serve
    every pair; cancellation leaves an error of about 1e-13 of the target's square. A hot loop: joined and sliced
    arrays cost more here than all arithmetic, so that signals are made in one sweep and multiplied as they lie.
    """
    centre = dead_zone(inputs, point[:2, None, None]).reshape(4, -1)
    passed = [_pass(*side) for side in zip(inputs, (rights, lefts), strict=True)]

    def channel(pole: Array, increments: Array) -> tuple[Array, Array]:
        columns, target, slope_under = reading.regress(pole, centre, increments)
        behind = jnp.stack([slope_under(_fit(columns, target)), target])
        right, left = (reading.regress(pole, signals, increments).columns for signals in passed)
        products = _schur(_pairs(right, left, behind), 4, 6)
        move = safe_divide(products[4, 5], products[4, 4], 0.0)
        return jnp.maximum(products[5, 5] - move * products[4, 5], 0.0), pole + move

    return jax.vmap(channel)(point[2:], increments)


def _pass(commands: ChannelSamples, widths: Column) -> Array:
    """What passes n dead zones of one wheel's commands (2, samples): (2 n, samples), those of k-1 first."""
    now, limits = commands[:, None], widths[:, None]
    return (now - jnp.clip(now, -limits, limits)).reshape(-1, commands.shape[1])


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


def _pairs(right: Array, left: Array, behind: ChannelSamples) -> Products:
    """Inner products of two signals each of right (2 n, samples), left (2 m, samples) and behind (2, samples), for
    every pair of a right and a left dead zone: entries broadcast to (n, m). The signals of k-1 come first, then those
    of k-2. Products of inputs alone are shared where their channels are."""
    cross, right_behind, left_behind, own = right @ left.T, right @ behind.T, left @ behind.T, behind @ behind.T
    (n, right_own), (m, left_own) = (_own(side) for side in (right, left))
    entries: Products = {}
    for i in range(2):
        for j in range(2):
            entries[i, 2 + j] = cross[i * n : (i + 1) * n, j * m : (j + 1) * m]
            entries[i, 4 + j] = right_behind[i * n : (i + 1) * n, j, None]
            entries[2 + i, 4 + j] = left_behind[None, i * m : (i + 1) * m, j]
            if i <= j:
                entries[i, j], entries[2 + i, 2 + j] = right_own[i + j, :, None], left_own[None, i + j]
                entries[4 + i, 4 + j] = own[i, j]
    return entries


def _own(side: Array) -> tuple[int, Array]:
    """How many dead zones n a wheel's signals (2 n, samples) have, and the inner products (3, n) of those of k-1 with
    themselves, of k-1 with k-2, of k-2 with themselves."""
    now, before = side.reshape(2, -1, side.shape[1])
    products = jnp.stack([now * now, now * before, before * before])
    return len(now), products @ jnp.ones(side.shape[1])  # a product adds up faster than a sum


def _inverse(pivot: Array, size: Array) -> Array:
    """1 / pivot, no smaller than RIDGE of the diagonal that it began as; 0 for a signal of zeros."""
    return safe_divide(1.0, jnp.maximum(pivot, RIDGE * size), 0.0)

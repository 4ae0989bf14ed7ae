"""The linear part of (13)-(14) in closed form, given the dead zones, and in free run the poles.

Variable projection (Golub and Pereyra 1973): what is left of the measured increments when the best numerators, and
with them whatever else is linear, have explained their share. The two readings of (21) differ only in what they make
of an input signal before it becomes a column of the regression.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array
from jaxident.estimation.observations import Observations
from jaxident.numerics import solve_positive
from jaxident.robot.dead_zone import dead_zone

RIDGE = 1e-13
"""Added to the diagonal of scaled normal equations: an input that never leaves its dead zone gets the coefficient 0."""

Reading = Callable[[Array, Array, Array], tuple[Array, Array]]
"""From a pole, input signals (n, samples) and a channel's increments (samples,) to columns, the inputs' first, and
target, both 0 where nothing is measured."""


class Projected(NamedTuple):
    """residual (2, samples) of both channels [m], [rad]; alpha (2,); numerator (2, 4), the coefficients of m_r and
    m_l at k-1, then at k-2."""

    residual: Any
    alpha: Any
    numerator: Any


def one_step_reading(observations: Observations) -> tuple[Reading, Array]:
    """(21) with the measured last increment on the right, and which samples count: those whose increment and the one
    before each span a single sample, that is three poses in a row. The pole is the last column's coefficient."""
    single = observations.measured & (observations.first | _earlier(observations.seen))
    use = single & ~observations.first & _earlier(single)

    def read(_, signals: Array, increments: Array) -> tuple[Array, Array]:
        columns = jnp.vstack([signals, _earlier(increments)])
        return jnp.where(use, columns, 0.0), jnp.where(use, increments, 0.0)

    return read, use


def free_run_reading(observations: Observations) -> Reading:
    """(21) with the model's own last increment on the right.

    The increment at the first sample of each run is one more linear unknown, taken out of columns and target. Where
    poses are missing, the sum of increments since the last one is compared with the measured one that spans them.
    """
    run = jnp.cumsum(observations.first | ~observations.inside) - 1
    restart = observations.first | _earlier(observations.seen) | ~observations.inside

    def read(alpha: Array, signals: Array, increments: Array) -> tuple[Array, Array]:
        response, start = _respond(alpha, signals, observations.first, restart)
        start = jnp.where(observations.measured, start, 0.0)
        energy = jax.ops.segment_sum(start * start, run, len(start))
        signals = jnp.where(observations.measured, jnp.vstack([response, increments]), 0.0)
        share = (
            jax.ops.segment_sum((signals * start).T, run, len(start)) / jnp.where(energy > 0.0, energy, 1.0)[:, None]
        )
        signals = signals - start * share[run].T
        return signals[:-1], signals[-1]

    return read


def project(reading: Reading, observations: Observations, point: Array) -> Projected:
    """What is left at a point: the dead zones (2,), followed in free run by the poles."""
    signals = _passed(observations, point[:1], point[1:2])
    poles = point[2:] if len(point) > 2 else jnp.zeros(2)
    fits = [
        _least_squares(*reading(pole, signals, increments))
        for pole, increments in zip(poles, observations.increment, strict=True)
    ]
    residual, unknowns = (jnp.stack(part) for part in zip(*fits, strict=True))
    return Projected(residual, point[2:] if len(point) > 2 else unknowns[:, 4], unknowns[:, :4])


def grid_squares(reading: Reading, observations: Observations, rights: Array, lefts: Array, poles: Array) -> Array:
    """Sums of squared residuals (2, n, m) for all pairs of n right and m left dead zones, at one pole per channel.

    One matrix of inner products holds those of every pair, which makes a grid point some hundred times cheaper than
    `project`; cancellation leaves an error of about 1e-13 of the target's own sum of squares.
    """
    n, m = len(rights), len(lefts)
    signals = _passed(observations, rights, lefts)

    def channel(pole: Array, increments: Array) -> Array:
        columns, target = reading(pole, signals, increments)
        table = jnp.vstack([columns, target])
        gram = table @ table.T
        right, left = jnp.arange(n)[:, None], n + jnp.arange(m)[None, :]
        others = range(2 * (n + m), len(table))
        rows = [
            jnp.broadcast_to(row, (n, m)) for row in (right, left, right + n + m, left + n + m, *map(jnp.array, others))
        ]
        return _remainder(jnp.stack([jnp.stack([gram[a, b] for b in rows]) for a in rows]))

    return jnp.stack([channel(*pair) for pair in zip(poles, observations.increment, strict=True)])


def _remainder(gram: Array) -> Array:
    """The last column's square that the others do not explain, from inner products (columns, columns, ...)."""
    diagonal = jnp.diagonal(gram)
    for i in range(len(gram) - 1):
        pivot = jnp.maximum(gram[i, i], RIDGE * diagonal[..., i])
        inverse = jnp.where(pivot > 0.0, 1.0 / jnp.where(pivot > 0.0, pivot, 1.0), 0.0)
        gram = gram - gram[:, i, None] * gram[i] * inverse
    return jnp.maximum(gram[-1, -1], 0.0)


def _passed(observations: Observations, rights: Array, lefts: Array) -> Array:
    """m at k-1 for each right and each left dead zone, then the same at k-2: (2 (n + m), samples)."""
    return jnp.vstack(
        [
            dead_zone(command, width[:, None])
            for commands in (observations.command, observations.command_before)
            for command, width in zip(commands, (rights, lefts), strict=True)
        ]
    )


def _respond(alpha: Array, signals: Array, first: Array, restart: Array) -> tuple[Array, Array]:
    """Response to signals (n, samples), and to a unit increment at the first sample of each run, both summed since
    the last pose."""
    drive = jnp.vstack([jnp.where(first, 0.0, signals), jnp.where(first, 1.0, 0.0)]).T

    def body(carry, now):
        last, total = carry
        new, first, restart = now
        last = jnp.where(first, 0.0, alpha * last) + new
        total = jnp.where(restart, 0.0, total) + last
        return (last, total), total

    zero = 0.0 * (drive[0] + alpha)
    _, response = jax.lax.scan(body, (zero, zero), (drive, first, restart))
    return response[:, :-1].T, response[:, -1]


def _least_squares(columns: Array, target: Array) -> tuple[Array, Array]:
    """Residual (samples,) and coefficients (n,) of a target on columns (n, samples), by refined normal equations.

    The coefficients count as constants in derivatives: Kaufman's form (1975) of the residual's slope, which misses
    only what vanishes with the residual itself.
    """
    fixed = jax.lax.stop_gradient(columns)
    size = jnp.sqrt(jnp.sum(fixed * fixed, axis=1))
    scale = jnp.where(size > 0.0, size, 1.0)
    unit = fixed / scale[:, None]
    gram = unit @ unit.T + RIDGE * jnp.eye(len(unit))
    first = solve_positive(gram, unit @ jax.lax.stop_gradient(target))
    rest = target - (first / scale) @ columns
    second = solve_positive(gram, unit @ rest)
    return rest - second @ unit, (first + jax.lax.stop_gradient(second)) / scale


def _earlier(signal: Array) -> Array:
    """The sample before; 0 (False) before the first."""
    return jnp.concatenate([jnp.zeros_like(signal[:1]), signal[:-1]])

"""Iterated least squares with key-term separation: the dead-zone Hammerstein model as a chain of linear fits.

A yardstick. With the dead zones of the last round in the switches and in m_{k-2}, (15)-(16) are linear in seven
unknowns each; their ratios are the next dead zones (Voros 1997, Automatica 33, 1141; 2003, J. Electr. Eng. 54, 3).
Camera noise biases it as it biases the paper's recursion: both regress a noisy increment on its own noisy past.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import (
    Array,
    ChannelSamples,
    Column,
    DifferenceMatrix,
    DifferenceVector,
    EquationUnknowns,
    PerWheel,
    SampleFlags,
    Samples,
    Signals,
    Square,
    Wheels,
)
from jaxident.estimation.increments.batch_covariance import pool
from jaxident.estimation.increments.input_forms import earlier, usable
from jaxident.estimation.increments.observations import Observations
from jaxident.estimation.increments.regressors import UNKNOWNS, key_terms
from jaxident.numerics import in_blocks, solve_positive
from jaxident.robot.model import DIFFERENCE_ORDER

ROUNDS = 40
RELAXATION = 0.5
"""Part of the way that a round takes. The separated term m_{k-1} carries half of what a dead zone does, m_{k-2} of the
last round the other half with nearly the same weight: a whole step would fall as far beyond the truth as it began
before it, and swing for ever."""
POLE_FIRST = np.array([6, 0, 1, 2, 3, 4, 5])
"""From the order of a fit, in which the pole comes last, to that of `regressors`."""
BLOCK = 40
"""Trials at once where many are mapped."""


class Batch(NamedTuple):
    """Estimate (12,) in DIFFERENCE_ORDER, its covariance (12, 12) to first order, unknowns (2, 7) of both equations
    before they agree on dead zones, and whether all is finite, from more samples than unknowns."""

    estimate: Any
    covariance: Any
    unknowns: Any
    ok: Any


def fit_key_terms(observations: Observations, *, d_max: Array, rounds: int = ROUNDS) -> Batch:
    """The estimate from observations (samples,) of one log; dead zones within [0, d_max]. Pure: runs under jit and
    vmap, which cuts many trials into blocks. Double precision."""

    def one(observations: Observations, d_max: Array) -> Batch:
        use, increments = usable_rows(observations), jnp.stack(observations.increment)

        def body(_, carry):
            width, _ = carry
            found = _round(observations, use, increments, width)
            return step_towards(width, found[0][10:], d_max), found

        # The last round, too, lies in the loop: beside other estimators XLA's CPU compiler fails on it outside.
        _, found = jax.lax.fori_loop(0, rounds + 1, body, (jnp.zeros(2), no_estimate()))
        return finish(found, jnp.sum(use), d_max)

    return in_blocks(one, BLOCK)(observations, jnp.asarray(d_max))


def no_estimate() -> tuple[DifferenceVector, DifferenceMatrix, EquationUnknowns]:
    """What a round finds, before the first: estimate (12,), covariance (12, 12), unknowns (2, 7)."""
    size = len(DIFFERENCE_ORDER)
    return jnp.zeros(size), jnp.zeros((size, size)), jnp.zeros((2, UNKNOWNS))


def usable_rows(observations: Observations) -> SampleFlags:
    """Samples (samples,) with a measured increment of their own and one before."""
    if observations.measured is None:
        return jnp.arange(len(observations.increment.length)) > 0
    return usable(observations)


def step_towards(width: PerWheel, found: PerWheel, d_max: Array) -> PerWheel:
    """The dead zones (2,) of the next round. Where none were found, too few samples were left outside of the last: back
    towards 0."""
    aim = jnp.where(jnp.isfinite(found), jnp.clip(found, 0.0, d_max), 0.0)
    return width + RELAXATION * (aim - width)


def input_columns(observations: Observations, width: PerWheel) -> Array:
    """The six columns (6, samples) of (15)-(16) that come from commands, at dead zones (2,)."""
    return jnp.stack(key_terms(jnp.zeros(()), observations.command, observations.command_before, Wheels(*width))[1:])


def finish(found: tuple[DifferenceVector, DifferenceMatrix, EquationUnknowns], count: Array, d_max: Array) -> Batch:
    """The result of a last round on `count` samples, dead zones within their bounds."""
    estimate, covariance, unknowns = found
    estimate = estimate.at[10:].set(jnp.clip(estimate[10:], 0.0, d_max))
    finite = jnp.all(jnp.isfinite(estimate)) & jnp.all(jnp.isfinite(covariance))
    return Batch(estimate, covariance, unknowns, finite & (count > UNKNOWNS))


def solve_instrumental(instruments: Signals, columns: Signals, target: Samples) -> tuple[Column, Square]:
    """Weights (n,) of columns (n, samples) in a target (samples,) with Z (target - columns' w) = 0 for the instruments
    Z, and their covariance (n, n) where what is left is white; the columns themselves as instruments make it least
    squares.

    w = (Z C')^-1 Z y, covariance s^2 (Z C')^-1 Z Z' (C Z')^-1 (Soederstroem and Stoica 1983, eq. 4.13). The fit is
    repeated on what it left, which loses no digits. A column of zeros gets the weight 0. Columns that lean on noise
    come last: the elimination divides by how well each is seen through its instrument beyond those before.
    """
    tall, wide = (1.0 / jnp.maximum(jnp.sqrt(jnp.sum(part**2, axis=1)), 1e-300) for part in (instruments, columns))
    instruments, columns = instruments * tall[:, None], columns * wide[:, None]
    absent = jnp.diag(jnp.where(jnp.any(columns != 0.0, axis=1), 0.0, 1.0))
    inverse = jax.vmap(solve_positive, (None, 1), 1)(instruments @ columns.T + absent, jnp.eye(len(columns)))
    weights = inverse @ (instruments @ target)
    weights = weights + inverse @ (instruments @ (target - weights @ columns))
    left = target - weights @ columns
    spare = jnp.maximum(jnp.sum(jnp.any(columns != 0.0, axis=0)) - len(columns), 1)
    spread = jnp.sum(left**2) / spare * inverse @ (instruments @ instruments.T) @ inverse.T
    return weights * wide, spread * wide * wide[:, None]


def _round(
    observations: Observations, use: SampleFlags, increments: ChannelSamples, width: PerWheel
) -> tuple[DifferenceVector, DifferenceMatrix, EquationUnknowns]:
    """Least squares in both equations at given dead zones: pooled estimate, covariance, unknowns."""
    inputs = jnp.where(use, input_columns(observations, width), 0.0)

    def channel(increment: Array) -> tuple[Array, Array]:
        columns = jnp.concatenate([inputs, jnp.where(use, earlier(increment), 0.0)[None]])
        weights, spread = solve_instrumental(columns, columns, jnp.where(use, increment, 0.0))
        return weights[POLE_FIRST], spread[POLE_FIRST[:, None], POLE_FIRST]

    unknowns, spread = jax.vmap(channel)(increments)
    return (*pool(unknowns, spread), unknowns)

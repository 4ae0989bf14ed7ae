"""Refined instrumental variables for the difference equations (13)-(14): they stand noise that biases least squares.

A yardstick. Camera noise sits in the last increment of (15)-(16); its instrument is the increment that the last round's
model simulates from the commands alone (Soederstroem and Stoica 1983, ch. 8). Refined (Young 2011, ch. 7): both
equations, their regressors and their instruments pass 1 / A, A the pole of the last round, and that of the heading 1 /
(1 - q^-1) as well, which leaves its noise white: the heading's increments are differences of white errors. Path lengths
are not quite, because the direction along which a camera error counts turns with the robot; there the sum does harm.
Filters begin at rest; what they have not seen before comes as a^k, and with the sum as 1, both estimated along. Dead
zones by key-term separation as in `key_term_fit`.
"""

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, DifferenceMatrix, DifferenceVector, EquationUnknowns, PerWheel, Signals
from jaxident.estimation.increments.batch_covariance import pool
from jaxident.estimation.increments.input_forms import earlier
from jaxident.estimation.increments.key_term_fit import (
    BLOCK,
    Batch,
    finish,
    fit_key_terms,
    input_columns,
    no_estimate,
    solve_instrumental,
    step_towards,
)
from jaxident.estimation.increments.observations import Observations
from jaxident.numerics import in_blocks

ROUNDS = 15
FIRST_ROUNDS = 5
"""Rounds before the heading's are summed: a sum shows a dead zone that is far off as drift, and hides all else."""
LARGEST_POLE = 0.999
"""Poles of filters and instruments: those of an unstable equation would grow without bound."""


def fit_instrumental(observations: Observations, *, d_max: Array, rounds: int = ROUNDS) -> Batch:
    """The estimate from `complete_observations` (samples,) of one even run without gaps; dead zones within [0, d_max].

    Begins with least squares without dead zones. Pure: runs under jit and vmap, which cuts many trials into blocks.
    Double precision.
    """

    def one(observations: Observations, d_max: Array) -> Batch:
        first = fit_key_terms(observations, d_max=d_max, rounds=0).unknowns

        def body(count, carry):
            unknowns, width, _ = carry
            found = _round(observations, unknowns, width, count >= FIRST_ROUNDS)
            return found[2], step_towards(width, found[0][10:], d_max), found

        begin = first, jnp.zeros(2), no_estimate()
        *_, found = jax.lax.fori_loop(0, FIRST_ROUNDS + rounds + 1, body, begin)
        return finish(found, jnp.asarray(len(observations.increment.length)), d_max)

    return in_blocks(one, BLOCK)(observations, jnp.asarray(d_max))


def _round(
    observations: Observations, unknowns: EquationUnknowns, width: PerWheel, summed: Array
) -> tuple[DifferenceVector, DifferenceMatrix, EquationUnknowns]:
    """One round from unknowns (2, 7) and dead zones (2,) of the last: pooled estimate, covariance, unknowns; summed:
    whether the heading's is."""
    inputs = input_columns(observations, width)[:, 1:]

    def channel(unknowns: Array, increment: Array, summed: Array) -> tuple[Array, Array]:
        pole = jnp.clip(unknowns[0], -LARGEST_POLE, LARGEST_POLE)
        simulated = _decay(pole, (unknowns[1:] @ inputs)[None])[0]
        impulse = jnp.zeros_like(simulated).at[0].set(1.0)
        signals = jnp.stack([increment[:-1], earlier(simulated), increment[1:], impulse])
        *passed, fading = _decay(pole, jnp.concatenate([inputs, signals]))
        passed = jnp.stack(passed)
        passed = jnp.where(summed, jnp.cumsum(passed, axis=1), passed)
        transients = jnp.stack([fading, jnp.where(summed, jnp.ones_like(fading), 0.0)])
        columns, instruments = (jnp.concatenate([passed[:6], transients, passed[k : k + 1]]) for k in (6, 7))
        weights, spread = solve_instrumental(instruments, columns, passed[8])
        kept = jnp.array([8, 0, 1, 2, 3, 4, 5])
        return weights[kept], spread[kept[:, None], kept]

    increments = jnp.stack(observations.increment)
    found, spread = jax.vmap(channel)(unknowns, increments, jnp.stack([jnp.zeros((), bool), summed]))
    return (*pool(found, spread), found)


def _decay(pole: Array, signals: Signals) -> Signals:
    """Signals (n, samples) through 1 / (1 - pole q^-1), from rest."""

    def body(last, now):
        new = pole * last + now
        return new, new

    return jax.lax.scan(body, 0.0 * (signals[:, 0] + pole), signals.T)[1].T

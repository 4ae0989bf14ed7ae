"""The two readings of (21): what stands on the right of (13)-(14) as the last increment.

`one_step` takes the measured one, `free_run` the model's own. To the search both look alike: a reading turns input
signals and increments into columns and a target, given a pole, and says how the prediction answers the pole.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, SampleFlags, Signals
from jaxident.errors import InputError
from jaxident.estimation.increments.observations import Observations
from jaxident.numerics import safe_divide

NAMES = ("free_run", "one_step")


class Regression(NamedTuple):
    """One channel at one pole: columns (n, samples) and target (samples,), 0 where nothing is measured.

    slope(weights): how the prediction (samples,) under these weights (k,) of the first k columns answers the pole.
    """

    columns: Array
    target: Array
    slope: Callable[[Array], Array]


class Reading(NamedTuple):
    """regress(pole, signals, increments): the regression of one channel's increments (samples,) on input signals
    (n, samples). pole, coordinate: from an unbounded coordinate to the pole and back."""

    regress: Callable[[Array, Array, Array], Regression]
    pole: Callable[[Array], Array]
    coordinate: Callable[[Array], Array]


def reading_of(observations: Observations, name: str) -> Reading:
    """The reading called `name`, InputError if there is none."""
    if name not in NAMES:
        raise InputError(f"reading {name!r}: one of {', '.join(NAMES)}")
    return one_step(observations) if name == "one_step" else free_run(observations)


def usable(observations: Observations) -> SampleFlags:
    """Samples whose increment and the one before each span a single sample: three poses in a row."""
    single = observations.measured & (observations.first | earlier(observations.seen))
    return single & ~observations.first & earlier(single)


def one_step(observations: Observations) -> Reading:
    """The measured last increment on the right; |alpha| is free."""
    use = usable(observations)

    def regress(pole: Array, signals: Array, increments: Array) -> Regression:
        past = jnp.where(use, earlier(increments), 0.0)
        target = jnp.where(use, increments, 0.0) - pole * past
        return Regression(jnp.where(use, signals, 0.0), target, lambda _: past)

    return Reading(regress, lambda coordinate: coordinate, lambda pole: pole)


def free_run(observations: Observations) -> Reading:
    """The model's own last increment on the right; |alpha| < 1.

    The increment at the first sample of each run is one more linear unknown, taken out of columns and target. Where
    poses are missing, the sum of increments since the last one is compared with the measured one that spans them.
    """
    runs = _runs(observations)
    impulse = jnp.where(runs.first, 1.0, 0.0)

    def regress(pole: Array, signals: Array, increments: Array) -> Regression:
        drive = jnp.vstack([jnp.where(runs.first, 0.0, signals), impulse])
        own, summed = _respond(runs, pole, drive)
        response, start = summed[:-1], summed[-1]
        share = _shares(runs, start, jnp.vstack([response, jnp.where(runs.measured, increments, 0.0)]))
        target = jnp.where(runs.measured, increments, 0.0) - start * share[-1]

        def slope(weights: Array) -> Array:
            # x_k = a x_{k-1} + f_k, hence dx_k/da = a dx_{k-1}/da + x_{k-1}, from the best start increments.
            begin = share[-1] - weights @ share[: len(weights)]
            modelled = weights @ own[: len(weights)] + begin * own[-1]
            _, answer = _respond(runs, pole, jnp.where(runs.first, 0.0, earlier(modelled))[None])
            return (answer - start * _shares(runs, start, answer))[0]

        return Regression(response - start * share[:-1], target, slope)

    return Reading(regress, jnp.tanh, jnp.arctanh)


class _Runs(NamedTuple):
    """All (samples,): the run a sample belongs to, whether it is the run's first, whether the sum of increments begins
    anew, and whether there is a measured increment to compare it with."""

    index: Array
    first: Array
    restart: Array
    measured: Array


def _runs(observations: Observations) -> _Runs:
    first, seam = observations.first, ~observations.inside
    return _Runs(jnp.cumsum(first | seam) - 1, first, first | seam | earlier(observations.seen), observations.measured)


def _respond(runs: _Runs, pole: Array, drive: Signals) -> tuple[Signals, Signals]:
    """Increments (n, samples) under a drive, whose first sample in a run is the run's start, and the same summed
    since the last pose where one is measured."""

    def body(carry, now):
        last, total = carry
        new, first, restart = now
        last = jnp.where(first, 0.0, pole * last) + new
        total = jnp.where(restart, 0.0, total) + last
        return (last, total), (last, total)

    zero = 0.0 * (drive[:, 0] + pole)
    _, (own, summed) = jax.lax.scan(body, (zero, zero), (drive.T, runs.first, runs.restart))
    return own.T, jnp.where(runs.measured, summed.T, 0.0)


def _shares(runs: _Runs, start: Array, signals: Signals) -> Array:
    """How much of the start's response each run of signals (n, samples) holds, at every sample of the run."""

    def over_run(values: Array) -> Array:
        return jax.ops.segment_sum(values.T, runs.index, len(runs.index))[runs.index].T

    return safe_divide(over_run(start * signals), over_run((start * start)[None]), 0.0)


def earlier(signal: Array) -> Array:
    """The sample before; 0 (False) before the first."""
    return jnp.concatenate([jnp.zeros_like(signal[:1]), signal[:-1]])

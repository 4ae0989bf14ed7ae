"""From a log to the difference equations by a yardstick: key-term least squares or instrumental variables."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array, Increment
from jaxident.errors import InputError
from jaxident.estimation.increments.input_forms import earlier, usable
from jaxident.estimation.increments.instrumental import fit_instrumental
from jaxident.estimation.increments.key_term_fit import Batch, fit_key_terms
from jaxident.estimation.increments.observations import Observations, complete_observations, observe_log
from jaxident.log import Log
from jaxident.robot.dead_zone import effective_command
from jaxident.robot.difference import Difference, predict_increment

YARDSTICKS = ("instrumental-variables", "key-term-least-squares")


def identify_batch(log: Log, method: str, d_max: float) -> tuple[Difference, Array, Batch, Increment]:
    """Parameters, dead zones (2,), the fit behind them and one-step residuals [m], [rad] (samples,), NaN where there is
    none, of a joined even log. InputError for instrumental variables on several runs or where poses are missing."""
    if method == "instrumental-variables":
        _check_unbroken(log)
    found, residuals = _fit(Log(*(jnp.asarray(column) for column in log)), jnp.asarray(d_max), method)
    return *split_vector(found.estimate), found, residuals


def split_vector(estimate: Array) -> tuple[Difference, Array]:
    """Parameters of (13)-(14) and dead zones (2,) of a vector (12,) in DIFFERENCE_ORDER."""
    return Difference(estimate[:2], estimate[2:6].reshape(2, 2), estimate[6:10].reshape(2, 2)), estimate[10:]


def _check_unbroken(log: Log) -> None:
    """The instruments' filters run through: no seam of runs, no gap."""
    runs = len(log.runs())
    if runs > 1:
        raise InputError(f"method 'instrumental-variables': takes one run, the log holds {runs}")
    gaps = ~np.isfinite(np.stack(log.pose)).all(axis=0)
    if gaps.any():
        raise InputError(
            f"method 'instrumental-variables': no pose at t = {log.t[np.argmax(gaps)]:g} s; it takes logs without gaps"
        )


@partial(jax.jit, static_argnames="method")
def _fit(log: Log, d_max: Array, method: str) -> tuple[Batch, Increment]:
    observations = observe_log(log)
    if method == "instrumental-variables":
        increments = Increment(*observations.increment)
        found = fit_instrumental(complete_observations(log.command, increments), d_max=d_max)
    else:
        found = fit_key_terms(observations, d_max=d_max)
    return found, _residuals(observations, found.estimate)


def _residuals(observations: Observations, estimate: Array) -> Increment:
    """What (13)-(14) leave of each increment, the measured last one on the right."""
    difference, width = split_vector(estimate)
    past = Increment(*(earlier(part) for part in observations.increment))
    passed = (effective_command(u, width) for u in (observations.command, observations.command_before))
    expected = predict_increment(difference, past, *passed)
    use = usable(observations)
    return Increment(*(jnp.where(use, y - p, jnp.nan) for y, p in zip(observations.increment, expected, strict=True)))

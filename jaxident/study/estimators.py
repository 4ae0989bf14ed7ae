"""The estimators that a study can run, by name: pure functions of one noisy log.

To add one: a function (Sight, settings) -> Finding and an entry in METHODS. Settings are Python values that fix the
compiled program.
"""

import functools
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Increment, Pose, Wheels
from jaxident.errors import InputError
from jaxident.estimation.identify import D_MAX_SHARE, SETUP_SAMPLES, SETUP_SHARE, SMALLEST_LOG
from jaxident.estimation.identify_recursive import parameter_covariance
from jaxident.estimation.increments import recursive
from jaxident.estimation.increments.batch_covariance import batch_covariance
from jaxident.estimation.increments.initialise import Setup, initialise
from jaxident.estimation.increments.input_forms import NAMES, reading_of, usable
from jaxident.estimation.increments.instrumental import fit_instrumental
from jaxident.estimation.increments.key_term_fit import Batch, fit_key_terms
from jaxident.estimation.increments.observations import complete_observations, observe_log, tail
from jaxident.estimation.increments.projection import project
from jaxident.estimation.poses.maximum_likelihood import fit_runs
from jaxident.estimation.poses.parameters import Law, to_vector
from jaxident.estimation.poses.runs import Runs
from jaxident.estimation.uncertainty.precision import difference_covariance
from jaxident.log import Log
from jaxident.robot.difference import to_difference
from jaxident.robot.model import DIFFERENCE_ORDER, difference_vector
from jaxident.robot.path_length import path_length
from jaxident.study.sight import (
    AT_REST,
    FOUND,
    NO_START,
    NOT_ARRIVED,
    NOT_FINITE,
    Choice,
    Finding,
    Method,
    Setting,
    Sight,
    places_of_rows,
)

UNKNOWNS_OF_ONE_CHANNEL = 6
"""Numbers that one channel's residuals determine: its pole, four numerator coefficients, its share of two widths."""


def settings_of(choice: Choice) -> dict[str, Any]:
    """All settings of a choice, defaults included."""
    known = METHODS[choice.method].settings
    return {key: setting.default for key, setting in known.items()} | dict(choice.settings)


def runs_alone(choice: Choice) -> bool:
    """Whether programs with this estimator run one at a time in a process; see `Method`."""
    return METHODS[choice.method].alone


def check_choice(choice: Choice, runs: int, where: str) -> None:
    """InputError for an unknown method or setting, a value that is not right, or more runs than a method takes."""
    if choice.method not in METHODS:
        raise InputError(f"{where}: method: {choice.method!r} is not one of {', '.join(METHODS)}")
    if runs > 1 and METHODS[choice.method].one_run:
        raise InputError(f"{where}: method: {choice.method} takes one run; set `runs` to 1, or take another method")
    known = METHODS[choice.method].settings
    for key, value in choice.settings:
        if key not in known:
            raise InputError(f"{where}: unknown setting {key!r}; {choice.method} takes {', '.join(known)}")
        if not known[key].valid(value):
            raise InputError(f"{where}: {key}: is {value!r}; {known[key].right}")


def see(command: Wheels, pose: Pose, period: Array, wheels: Wheels | None = None, runs: int = 1) -> Sight:
    """What estimators see of commands, measured poses and, if any, wheel speeds (rows,) of some runs of one length, one
    after the other, at an even period [s]."""
    run, row = map(jnp.asarray, places_of_rows(runs, len(pose.x)))
    log = Log(row * period, *command, *pose, run)
    # without seams no masks are needed, which makes the recursion faster
    whole = complete_observations(command, path_length(pose)) if runs == 1 else tail(observe_log(log), 1)

    @functools.cache
    def setup(count: int, reading: str, d_max_share: float) -> Setup:
        early = observe_log(Log(*(column[:count] for column in log)))
        return initialise(early, d_max=d_max_share * largest, reading=reading)

    largest = jnp.max(jnp.abs(jnp.stack(command)))
    return Sight(log, whole, setup, largest, wheels, runs)


def estimate(choice: Choice, sight: Sight, moves: Array) -> Finding:
    """Run one estimator; numbers of a failed estimate are NaN, so that nothing can average them. A robot that never
    moves (`moves`) fails whatever is found in the camera's noise."""
    run = METHODS[choice.method].run
    if run is None:  # what is not compiled is put in its place later
        none = jnp.full(len(DIFFERENCE_ORDER), jnp.nan)
        return Finding(none, none, jnp.asarray(NOT_FINITE, jnp.int8))
    found = run(sight, settings_of(choice))
    finite = jnp.all(jnp.isfinite(found.estimate))
    reason = jnp.where(found.reason != FOUND, found.reason, jnp.where(finite, FOUND, NOT_FINITE))
    reason = jnp.where(moves, reason, AT_REST).astype(jnp.int8)
    value, deviation = (jnp.where(reason == FOUND, part, jnp.nan) for part in (found.estimate, found.deviation))
    return Finding(value, deviation, reason)


def batch(sight: Sight, settings: dict[str, Any]) -> Finding:
    """PAPER section VI on the first rows (default: all): linear least squares, then the nonlinear cost (21)."""
    rows = len(sight.log.t)
    first, setup, variance = _start(sight, settings, settings["setup_samples"] or rows, 1.0)
    return _finding(first, setup, variance, batch_covariance)


def recursively(sight: Sight, settings: dict[str, Any]) -> Finding:
    """The paper's estimator: `batch` on the setup time (default: 200 rows or three tenths), then (15)-(18)."""
    rows = len(sight.log.t)
    count = settings["setup_samples"] or max(SETUP_SAMPLES, int(SETUP_SHARE * rows))
    first, setup, variance = _start(sight, settings, count, settings["forgetting"])
    late = tail(sight.observations, min(rows, count) - 2)
    if not len(late.command.right):
        return _finding(first, setup, variance, batch_covariance)

    def body(carry, sample):
        estimate, squares, used = carry
        estimate, info = recursive.absorb(estimate, sample)
        new = jnp.stack([e * e / s for e, s in zip(info.error, info.scale, strict=True)])
        return (estimate, squares + jnp.where(info.used, new, 0.0), used + info.used), None

    (last, squares, used), _ = jax.lax.scan(body, (first, jnp.zeros(2), 0), late)
    return _finding(last, setup, squares / jnp.maximum(used, 1))


def likelihood(sight: Sight, settings: dict[str, Any]) -> Finding:
    """Maximum likelihood on the poses, and on wheel speeds where there are some, under white noise of camera and
    wheels, in physical parameters."""
    log, wheels = sight.log, sight.wheels if settings["wheels"] else None
    law, period = Law(settings["coupling"], wheels=wheels is not None), log.t[1] - log.t[0]
    command, pose, wheels = jax.tree.map(lambda column: column.reshape(sight.runs, -1), (log.command, log.pose, wheels))
    every = jnp.ones(command.right.shape, bool)
    runs = Runs(period, command, pose, every, wheels, None if wheels is None else Wheels(every, every))
    fit = fit_runs(runs, settings["d_max_share"] * sight.largest, law)
    covariance = difference_covariance(to_vector(fit.robot, law), fit.covariance, period, law)
    estimate = difference_vector(to_difference(fit.robot.drive, period), fit.robot.dead_zone)
    return Finding(estimate, jnp.sqrt(jnp.diagonal(covariance)), jnp.where(fit.ok, FOUND, NOT_ARRIVED))


def key_terms(sight: Sight, settings: dict[str, Any]) -> Finding:
    """A yardstick: least squares with key-term separation, iterated over all rows (Voros 1997)."""
    return _of_batch(fit_key_terms(sight.observations, d_max=settings["d_max_share"] * sight.largest))


def instrumental(sight: Sight, settings: dict[str, Any]) -> Finding:
    """A yardstick: refined instrumental variables over all rows (Young 2011)."""
    return _of_batch(fit_instrumental(sight.observations, d_max=settings["d_max_share"] * sight.largest))


def _of_batch(found: Batch) -> Finding:
    deviation = jnp.sqrt(jnp.maximum(jnp.diagonal(found.covariance), 0.0))
    return Finding(found.estimate, deviation, jnp.where(found.ok, FOUND, NOT_FINITE))


def _start(sight: Sight, settings: dict[str, Any], count: int, forgetting: float):
    """The recursion at the end of the setup time, the setup itself, and the variance (2,) of its residuals."""
    count = min(count, len(sight.log.t))
    setup = sight.setup(count, settings["reading"], settings["d_max_share"])
    early = jax.tree.map(lambda column: column[: count - 2], sight.observations)
    d_max = settings["d_max_share"] * sight.largest
    first = recursive.start(setup.difference, setup.dead_zone, early, d_max, forgetting)
    whole = observe_log(Log(*(column[:count] for column in sight.log)))
    point = jnp.concatenate([setup.dead_zone, setup.difference.alpha])
    left = project(reading_of(whole, settings["reading"]), whole, point).residual
    spare = jnp.maximum(jnp.sum(usable(whole)) - UNKNOWNS_OF_ONE_CHANNEL, 1)
    return first, setup, jnp.sum(left**2, axis=1) / spare


def _finding(last: recursive.Estimate, setup: Setup, variance: Array, covariance_of=parameter_covariance) -> Finding:
    covariance = covariance_of(last, Increment(variance[0], variance[1]))
    deviation = jnp.sqrt(jnp.maximum(jnp.diagonal(covariance), 0.0))
    reason = jnp.where(setup.ok, FOUND, NO_START)
    return Finding(difference_vector(*recursive.parameters(last)), deviation, reason)


def _number(low: float, high: float) -> Callable[[Any], bool]:
    return lambda value: not isinstance(value, bool) and isinstance(value, int | float) and low < value <= high


def _seconds(value: Any) -> bool:
    return _number(0.0, 1e3)(value) or (value == 0 and not isinstance(value, bool))


_PAPER = {
    "setup_samples": Setting(
        0,
        lambda value: type(value) is int and (value == 0 or value >= SMALLEST_LOG),
        f"0 (the default rule) or a whole number of rows from {SMALLEST_LOG} on",
    ),
    "reading": Setting("one_step", lambda value: value in NAMES, f"one of {', '.join(NAMES)}"),
    "d_max_share": Setting(D_MAX_SHARE, _number(0.0, 0.999), "a number above 0 and below 1"),
}
_WHOLE = {"d_max_share": _PAPER["d_max_share"]}
_POSES = {
    key: Setting(default, lambda value: isinstance(value, bool), right)
    for key, default, right in (("wheels", True, "true, or false for the poses alone"),
                                ("coupling", False, "true for robots whose speeds change each other"))
}  # fmt: skip
BEST = "maximum-likelihood"
"""The method whose errors come near the Cramér-Rao bound."""
DIAGNOSE = "diagnose"
"""The method that names effects as well, and takes seconds a trial."""
METHODS = {
    "batch": Method(batch, _PAPER),
    "recursive": Method(
        recursively,
        _PAPER | {"forgetting": Setting(1.0, _number(0.0, 1.0), "a number above 0 and at most 1")},
    ),
    "key-term-least-squares": Method(key_terms, _WHOLE),
    "instrumental-variables": Method(instrumental, _WHOLE, one_run=True),
    BEST: Method(likelihood, _WHOLE | _POSES, alone=True),
    DIAGNOSE: Method(None, {"horizon": Setting(0.0, _seconds, "0 (the default rule) or seconds")}),
}
"""Every estimator by name."""

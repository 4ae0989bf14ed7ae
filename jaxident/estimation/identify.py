"""One identification from start to end: logs in, model out."""

import dataclasses
from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array, Increment, Pose, Wheels
from jaxident.errors import InputError, WorkError
from jaxident.estimation import recursive
from jaxident.estimation.checks import check_informative
from jaxident.estimation.identify_batch import YARDSTICKS, identify_batch
from jaxident.estimation.identify_poses import identify_poses
from jaxident.estimation.initialise import Setup, initialise
from jaxident.estimation.least_squares import full_covariance
from jaxident.estimation.maximum_likelihood import Fit
from jaxident.estimation.observations import observe_log
from jaxident.estimation.suspicions import log_suspicions
from jaxident.estimation.verdict import at_bound, bound_doubts
from jaxident.log import Log, even_period, join
from jaxident.numerics import require_float64
from jaxident.robot.difference import Difference
from jaxident.robot.model import DIFFERENCE_ORDER, Model, Provenance, Spread, difference_vector

METHODS = ("maximum-likelihood", "paper", *YARDSTICKS)
SETUP_SAMPLES = 200
SETUP_SHARE = 0.3
SMALLEST_LOG = 20
D_MAX_SHARE = 0.9


class History(NamedTuple):
    """The recursion after each sample (samples,): parameters in DIFFERENCE_ORDER and their standard deviations, each
    (samples, 12), and what the sample taught."""

    parameters: Any
    standard_deviation: Any
    used: Any


class Identification(NamedTuple):
    """A model, the covariance of its parameters in `model.parameter_order`, residuals with NaN where there is none, and
    whether every stage converged.

    By maximum likelihood: residuals a `Pose` [m], [rad] (rows,), and the fit. Otherwise one-step residuals, an
    `Increment` [m], [rad] (samples,), and by the paper how the recursion came about. suspicions: what the log says
    against the method's assumptions, a line each.
    """

    model: Model
    covariance: Any
    residuals: Pose | Increment
    ok: Any
    fit: Fit | None = None
    setup: Any = None
    history: Any = None
    suspicions: tuple[str, ...] = ()


def identify(
    logs: Log | Sequence[Log],
    method: str = "maximum-likelihood",
    *,
    noise_law: str = "auto",
    coupling: bool = False,
    setup_time: float | None = None,
    forgetting: float | None = None,
    d_max: float | None = None,
    reading: str | None = None,
) -> Identification:
    """The model of the robot behind one or several logs, runs in the order given.

    method "maximum-likelihood": physical parameters from whole runs, uneven or not, under a noise_law "white", "ar1",
    "slip", "slip-ar1" or, by default, "auto": white unless its residuals are coloured, then the likeliest; with
    `coupling` of the two speeds if asked for. method "paper": batch initialisation on the setup time (section VI), then
    recursive least squares (15)-(18) over the rest of an even log. Its settings: setup_time [s] from the start
    (default: 200 samples or three tenths, whichever is more); forgetting in (0, 1] (default 1); reading of (21):
    "one_step" (default), as the recursion reads it and best on real robots, or "free_run". methods
    "instrumental-variables" (one even run without gaps) and "key-term-least-squares" (even runs): yardsticks, the same
    equations from all samples at once. d_max bounds the dead zones [unit of the command] (default: 0.9 of the largest
    command). Needs double precision; InputError says what a log lacks, WorkError that the result is not finite.
    """
    require_float64("identify")
    _check_method(method, coupling, {"setup time": setup_time, "forgetting": forgetting, "reading": reading})
    log = join(logs)
    check_informative(log)
    largest = float(np.nanmax(np.abs(np.stack(log.command))))
    d_max = D_MAX_SHARE * largest if d_max is None else d_max
    check_settings(1.0 if forgetting is None else forgetting, d_max, largest)
    if method == "paper":
        settings = setup_time, 1.0 if forgetting is None else forgetting, reading or "one_step"
        paper = _identify_as_paper(log, d_max, *settings)
        return _with_bounds(paper._replace(suspicions=log_suspicions(log)), d_max)
    if method in YARDSTICKS:
        return _with_bounds(_identify_by_yardstick(log, method, d_max)._replace(suspicions=log_suspicions(log)), d_max)
    found = identify_poses(log, d_max, noise_law, coupling)
    every = found.model, found.model.covariance, found.residuals, found.fit.ok
    return _with_bounds(Identification(*every, fit=found.fit, suspicions=found.suspicions), d_max)


def _with_bounds(found: Identification, d_max: float) -> Identification:
    """The identification, its model and its suspicions telling what stands at a bound of its search."""
    bounds = at_bound(found.model, d_max)
    origin = found.model.provenance._replace(at_bound=tuple(bounds))
    model = dataclasses.replace(found.model, provenance=origin)
    return found._replace(model=model, suspicions=found.suspicions + bound_doubts(bounds))


def _check_method(method: str, coupling: bool, of_the_paper: dict[str, Any]) -> None:
    if method not in METHODS:
        raise InputError(f"method {method!r}: choose from {', '.join(METHODS)}")
    if method != "maximum-likelihood" and coupling:
        raise InputError(f"coupling: a term of maximum likelihood; the method {method!r} has none such")
    given = [name for name, value in of_the_paper.items() if value is not None]
    if method != "paper" and given:
        raise InputError(f"{given[0]}: a setting of the method 'paper'; {method} has none such")


def _identify_as_paper(
    log: Log, d_max: float, setup_time: float | None, forgetting: float, reading: str
) -> Identification:
    period = even_period(log)
    setup_rows = count_setup_rows(log, period, setup_time)
    estimate, setup, history, residuals, covariance = identify_recursively(
        Log(*(jnp.asarray(column) for column in log)), setup_rows, d_max, forgetting, reading
    )
    model = _model(*recursive.parameters(estimate), covariance, period, "paper")
    return Identification(model, covariance, residuals, setup.ok, setup=setup, history=history)


def _identify_by_yardstick(log: Log, method: str, d_max: float) -> Identification:
    period = even_period(log)
    if len(log.t) < SMALLEST_LOG:
        raise InputError(f"{len(log.t)} rows: the method needs at least {SMALLEST_LOG}")
    difference, dead_zone, found, residuals = identify_batch(log, method, d_max)
    model = _model(difference, dead_zone, found.covariance, period, method)
    return Identification(model, found.covariance, residuals, found.ok)


def _model(difference: Difference, dead_zone: Array, covariance: Array, period: float, method: str) -> Model:
    """The estimate as a model; WorkError where it is not finite."""
    if not all(np.all(np.isfinite(a)) for a in (*difference, dead_zone, covariance)):
        raise WorkError("the estimate is not finite: the log does not determine the model")
    return Model(
        period,
        difference,
        dead_zone,
        standard_deviation=_spread(jnp.sqrt(jnp.diagonal(covariance))),
        covariance=covariance,
        parameter_order=DIFFERENCE_ORDER,
        provenance=Provenance(method=method),
    )


def check_settings(forgetting: float, d_max: float, largest: float) -> None:
    """InputError for a forgetting factor outside (0, 1] or a dead-zone bound outside (0, largest command)."""
    if not 0.0 < forgetting <= 1.0:
        raise InputError(f"forgetting {forgetting:g}: the factor lies above 0 and at most at 1")
    if not 0.0 < d_max < largest:
        raise InputError(f"d-max {d_max:g}: the bound lies above 0 and below the largest command, {largest:g}")


def count_setup_rows(log: Log, period: float, setup_time: float | None) -> int:
    """How many rows the setup time covers."""
    rows = len(log.t)
    if rows < SMALLEST_LOG:
        raise InputError(f"{rows} rows: the method needs at least {SMALLEST_LOG}")
    if setup_time is None:
        return min(rows, max(SETUP_SAMPLES, int(SETUP_SHARE * rows)))
    if setup_time < SMALLEST_LOG * period:
        raise InputError(f"setup time {setup_time:g} s: at least {SMALLEST_LOG} samples, {SMALLEST_LOG * period:g} s")
    return min(rows, round(setup_time / period))


@partial(jax.jit, static_argnames=("setup_rows", "reading"))
def identify_recursively(log: Log, setup_rows: int, d_max: Array, forgetting: Array, reading: str):
    """Section VI on the first rows, then the recursion over the rest: pure, for one log of arrays (samples,).

    Returns the last estimate, the setup, the history and residuals after the setup, and the covariance (12, 12).
    """
    observations = observe_log(log)
    early = jax.tree.map(lambda column: column[: setup_rows - 1], observations)
    setup = initialise(early, d_max=d_max, reading=reading)
    estimate = recursive.start(setup.difference, setup.dead_zone, early, d_max, forgetting)
    late = recursive.tail(observations, setup_rows - 1)
    estimate, (steps, info) = recursive.run(estimate, late)
    variance = _noise_variance(info, setup)
    parameters, deviations = jax.vmap(lambda one: _summary(one, variance))(steps)
    history = History(parameters, deviations, info.used)
    covariance = parameter_covariance(estimate, variance)
    residuals = Increment(*(jnp.where(info.used, e, jnp.nan) for e in info.error))
    return estimate, setup, history, residuals, covariance


def _noise_variance(info: recursive.Info, setup: Setup) -> Increment:
    """Variance of each equation's error, from the normalised prediction errors; the setup's where none followed."""
    used = jnp.sum(info.used)
    return Increment(
        *(
            jnp.where(used > 0, jnp.sum(jnp.where(info.used, e**2 / s, 0.0)) / jnp.maximum(used, 1), w**2)
            for e, s, w in zip(info.error, info.scale, setup.weight, strict=True)
        )
    )


def parameter_covariance(estimate: recursive.Estimate, variance: Increment) -> Array:
    """Covariance (12, 12) in DIFFERENCE_ORDER: that of both equations' unknowns, carried to first order.

    The dead zones enter as the unbounded average: at a bound the clipped one would claim to be certain.
    """

    def from_unknowns(unknowns):
        length, turn = (e._replace(unknowns=u) for e, u in zip((estimate.length, estimate.turn), unknowns, strict=True))
        moved = estimate._replace(length=length, turn=turn)
        ratios = recursive.dead_zone_ratios(moved)
        average = Wheels(*(0.5 * (first + second) for first, second in zip(*ratios, strict=True)))
        return difference_vector(*recursive.parameters(moved._replace(dead_zone=average)))

    unknowns = (estimate.length.unknowns, estimate.turn.unknowns)
    slopes = jax.jacfwd(from_unknowns)(unknowns)
    total = 0.0
    for slope, equation, v in zip(slopes, (estimate.length, estimate.turn), variance, strict=True):
        columns = jnp.stack(slope, axis=-1)
        total = total + v * columns @ full_covariance(equation) @ columns.T
    return total


def _summary(estimate: recursive.Estimate, variance: Increment) -> tuple[Array, Array]:
    return difference_vector(*recursive.parameters(estimate)), jnp.sqrt(
        jnp.maximum(jnp.diagonal(parameter_covariance(estimate, variance)), 0.0)
    )


def _spread(deviation: Array) -> Spread:
    return Spread(
        alpha=deviation[:2],
        delta=deviation[2:6].reshape(2, 2),
        epsilon=deviation[6:10].reshape(2, 2),
        dead_zone=deviation[10:],
    )

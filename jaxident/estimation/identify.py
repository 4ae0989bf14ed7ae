"""One identification from start to end: logs in, model out."""

import dataclasses
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array, Increment, Pose
from jaxident.errors import InputError, WorkError
from jaxident.estimation.identify_batch import YARDSTICKS, identify_batch
from jaxident.estimation.identify_poses import identify_poses
from jaxident.estimation.identify_recursive import identify_recursively
from jaxident.estimation.increments import recursive
from jaxident.estimation.increments.observations import poses_only
from jaxident.estimation.poses.maximum_likelihood import Fit
from jaxident.estimation.suspicions.checks import check_informative
from jaxident.estimation.suspicions.log_suspicions import log_suspicions
from jaxident.estimation.suspicions.wheel_suspicions import check_wheels
from jaxident.estimation.uncertainty.more_noise import camera_error, moves
from jaxident.estimation.uncertainty.verdict import at_bound, bound_doubts
from jaxident.log import Log, even_period, join
from jaxident.numerics import require_float64
from jaxident.robot.difference import Difference
from jaxident.robot.model import DIFFERENCE_ORDER, Model, Provenance, Spread, difference_vector

METHODS = ("maximum-likelihood", "paper", *YARDSTICKS)
SETUP_SAMPLES = 200
SETUP_SHARE = 0.3
SMALLEST_LOG = 20
D_MAX_SHARE = 0.9


class Identification(NamedTuple):
    """What `identify` found.

    Attributes:
        model: the model, with standard deviations.
        covariance: of its parameters, in `model.parameter_order`.
        residuals: NaN where there is none. By maximum likelihood a `Pose` [m], [rad] (rows,), otherwise one-step
            residuals, an `Increment` [m], [rad] (samples,).
        ok: whether every stage converged.
        fit: by maximum likelihood: the fit itself.
        setup: by the paper's method: the batch initialisation.
        history: by the paper's method: the estimates along the recursion.
        suspicions: what the log says against the assumptions, a line each.
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
    """Identify the model of a robot from one or several logs.

    The maximum likelihood finds physical parameters under which the measured poses are likeliest. The paper's method
    is Mendes and Medeiros': batch initialisation (section VI), then recursive least squares (15)-(18). Needs double
    precision.

    Args:
        logs: commands and poses. Several logs are runs of the same robot, in the order given.
        method: "maximum-likelihood" takes whole runs, evenly sampled or not. It uses wheel speeds as well, unless they
            contradict the camera. "paper" takes even logs. Two yardsticks solve the paper's equations from all
            samples at once: "instrumental-variables" (one even run without gaps), "key-term-least-squares" (even runs).
        noise_law: for the maximum likelihood: "white", "ar1", "slip" or "slip-ar1" (`Noise` explains the parts). "auto"
            takes white, and the likeliest of all where the residuals of white are coloured.
        coupling: for the maximum likelihood: whether either speed may act on the other.
        setup_time: for the paper's method: time of the batch initialisation from the start [s]. By default 200 samples
            or three tenths of the log, whichever is more.
        forgetting: for the paper's method: forgetting factor in (0, 1], by default 1.
        d_max: largest dead zone that is looked for [unit of the command], by default 0.9 of the largest command.
        reading: for the paper's method: how (21) is read, "one_step" (default, best on real robots) or "free_run".

    Returns:
        Identification: the model with its standard deviations, the covariance, the residuals, `ok` (whether every stage
            converged), and suspicions about the log.

    Raises:
        InputError: an unknown method, a setting that does not suit the method, or a log that lacks what it needs.
        WorkError: nothing finite comes out.

    Examples:
        >>> import jax, jaxident as ji
        >>> ji.start_jax()
        >>> robot = ji.load_model("published")
        >>> inputs = ji.excite(jax.random.key(0), "multilevel", 600, robot.sample_period)
        >>> found = ji.identify(ji.simulate(robot, inputs), "key-term-least-squares")
        >>> found.model.dead_zone.round(2).tolist()
        [0.25, 0.2]
    """
    require_float64("identify")
    _check_method(method, coupling, {"setup time": setup_time, "forgetting": forgetting, "reading": reading})
    log, doubts = _chosen_sensors(join(logs), method)
    largest = float(np.nanmax(np.abs(np.stack(log.command))))
    d_max = D_MAX_SHARE * largest if d_max is None else d_max
    check_settings(1.0 if forgetting is None else forgetting, d_max, largest)
    if method != "maximum-likelihood":
        settings = setup_time, 1.0 if forgetting is None else forgetting, reading or "one_step"
        again = partial(_identify_as_paper, d_max=d_max, settings=settings)
        if method in YARDSTICKS:
            again = partial(_identify_by_yardstick, method=method, d_max=d_max)
        found = _with_moves(again(log), log, again)._replace(suspicions=log_suspicions(log))
    else:
        found = _identify_by_likelihood(log, d_max, noise_law, coupling)
    return _with_bounds(found._replace(suspicions=(*found.suspicions, *doubts)), d_max)


def _identify_by_likelihood(log: Log, d_max: float, noise_law: str, coupling: bool) -> Identification:
    found = identify_poses(log, d_max, noise_law, coupling)
    every = found.model, found.model.covariance, found.residuals, found.fit.ok
    return Identification(*every, fit=found.fit, suspicions=found.suspicions)


def _chosen_sensors(log: Log, method: str) -> tuple[Log, tuple[str, ...]]:
    """The log without wheel speeds that the method or the camera has no use for, and what is to be said of them;
    InputError for a log that shows nothing."""
    check_informative(log)
    if log.wheel_r is None or not np.isfinite([log.wheel_r, log.wheel_l]).any():
        return poses_only(log), ()
    if method != "maximum-likelihood":
        return poses_only(log), (f"wheel speeds are not used: the method {method} knows poses alone",)
    check = check_wheels(log)
    return log if check.usable else poses_only(log), check.lines


def _with_moves(found: Identification, log: Log, again: Callable[[Log], Identification]) -> Identification:
    """The identification, each variance the wider by the square of how far as much camera error again moves its number
    (`more_noise`)."""

    def vector(log: Log) -> np.ndarray:
        found = again(log)
        if not bool(found.ok):
            raise WorkError("no convergence")
        return _vector(found)

    if not bool(found.ok):
        return found
    deviation = np.sqrt(np.diagonal(found.covariance))
    error = camera_error(Increment(*found.residuals[:2]), found.model.difference.alpha)
    moved = moves(vector, log, _vector(found), deviation, error)
    covariance = jnp.asarray(np.asarray(found.covariance) + np.diag(moved**2))
    spread = _spread(jnp.sqrt(jnp.diagonal(covariance)))
    model = dataclasses.replace(found.model, covariance=covariance, standard_deviation=spread)
    return found._replace(model=model, covariance=covariance)


def _vector(found: Identification) -> np.ndarray:
    """The numbers (12,) of a model of the difference equations, in DIFFERENCE_ORDER."""
    return np.asarray(difference_vector(found.model.difference, found.model.dead_zone))


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


def _identify_as_paper(log: Log, d_max: float, settings: tuple[float | None, float, str]) -> Identification:
    setup_time, forgetting, reading = settings
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


def _spread(deviation: Array) -> Spread:
    return Spread(
        alpha=deviation[:2],
        delta=deviation[2:6].reshape(2, 2),
        epsilon=deviation[6:10].reshape(2, 2),
        dead_zone=deviation[10:],
    )

"""Free-run prediction from many rows of a log, each start state filtered from the rows before it alone."""

import warnings
from typing import Any, NamedTuple

import numpy as np

from jaxident.effects.checks import check_effects
from jaxident.effects.law_kinds import check_discovered
from jaxident.errors import InputError
from jaxident.estimation.ahead import session
from jaxident.estimation.ahead.beyond_range import beyond_range
from jaxident.estimation.ahead.predict_difference import run_difference_ahead
from jaxident.estimation.ahead.run_ahead import Ahead, run_ahead
from jaxident.estimation.ahead.session_check import new_session
from jaxident.estimation.ahead.stretches import Starts, every
from jaxident.log import Log
from jaxident.numerics import require_float64
from jaxident.robot.difference import Difference
from jaxident.robot.model import Model, require_physical
from jaxident.robot.simulate import check_period


class Prediction(NamedTuple):
    """Free runs of a model, one entry per predicted row (rows,).

    Attributes:
        run: number of the run.
        start: row of the run that the free run starts from.
        step: rows since.
        t: time [s].
        x: predicted position [m].
        y: predicted position [m].
        theta: predicted heading [rad].
        sd_x: standard deviation of x [m]; `predict` says of what.
        sd_y: standard deviation of y [m].
        sd_theta: standard deviation of theta [rad].
        run_up: whether the start comes from a run-up of earlier commands, because the filter did not converge there.
    """

    run: Any
    start: Any
    step: Any
    t: Any
    x: Any
    y: Any
    theta: Any
    sd_x: Any
    sd_y: Any
    sd_theta: Any
    run_up: Any = False


def predict(
    model: Model,
    log: Log,
    horizon: int,
    *,
    burn_in: int = 20,
    stride: int | None = None,
    session_time: float | None = None,
) -> Prediction:
    """Predict the poses of a log from its commands, in free runs from many rows of it.

    Free runs begin at rows burn_in, burn_in + stride, ... of each run. A physical model, with effects or without,
    begins from the state that a filter finds in the rows before (`run_ahead`); they also tell the angles of wheels that
    discovered laws go by. Where the filter does not converge, the free run begins from the speed that earlier commands
    give from rest, at the last pose. A model of free numerators is fitted to the poses of the burn-in. A UserWarning
    tells of free runs that leave what a discovered law has seen, and of a log whose poses say that it begins a session.
    Needs double precision.

    Args:
        model: the robot.
        log: commands and poses, one run or several. Runs too short to begin in are left out.
        horizon: rows of a free run. One that reaches the end of its run ends there.
        burn_in: rows that the filter of the start sees; with slip at least FORGOTTEN seconds.
        stride: rows between two starts, by default the horizon.
        session_time: time of the first row in the robot's session [s], for effects that drift. By default where the log
            stood among those that the model was made from, or right after them.

    Returns:
        Prediction: one entry per predicted row: run, start, step, time [s], pose [m], [rad] and its standard deviation.
            The deviation holds the start state, slip and the covariance of the parameters; for free numerators the fit
            of the start alone. `prediction_error` compares it with the log.

    Raises:
        InputError: no run is long enough, a number of rows below 1, or effects that cannot act together.

    Examples:
        >>> import dataclasses, jax, jaxident as ji
        >>> ji.start_jax()
        >>> robot = dataclasses.replace(ji.load_model("published"), noise=ji.Noise(position=5e-4, heading=5e-3))
        >>> inputs = ji.excite(jax.random.key(0), "multilevel", 300, robot.sample_period)
        >>> log = ji.simulate(robot, inputs, key=jax.random.key(1))
        >>> print(ji.predict(robot, log, horizon=30))
        9 free runs of 1 s, 9 end at a measured pose
        error there: ...
    """
    require_float64("predict")
    if model.effects or model.discovered:
        require_physical(model)
        check_effects(model.effects)
        check_discovered(model.discovered)
    stride = horizon if stride is None else stride
    for name, value, least in (("horizon", horizon, 1), ("burn-in", burn_in, 1), ("stride", stride, 1)):
        if value < least:
            raise InputError(f"{name} {value}: at least {least} row is needed")
    starts = every(log, burn_in, stride)
    if isinstance(model.dynamics, Difference):
        check_period(model, log)
        ahead = run_difference_ahead(model, log, starts, horizon, burn_in)
    else:
        begin, known = session.time_in_session(model, log, log) if session_time is None else (session_time, True)
        ahead = run_ahead(model, log, starts, horizon, burn_in=burn_in, session_time=begin)
        lines = beyond_range(model, log, starts, ahead.pose, begin)
        if not known and (line := new_session(model, log, horizon, burn_in, begin)):
            lines.append(line)
        for line in lines:
            warnings.warn(line, stacklevel=2)
    return _flatten(log, starts, ahead)


def _flatten(log: Log, starts: Starts, ahead: Ahead) -> Prediction:
    """One row per predicted row that the log still has."""
    runs = log.runs()
    lengths = np.array([len(run.t) for run in runs])
    count, horizon = ahead.pose.shape[:2]
    step = np.broadcast_to(np.arange(1, horizon + 1), (count, horizon))
    kept = starts.row[:, None] + step < lengths[starts.run][:, None]
    run, start, run_up = (
        np.broadcast_to(column[:, None], kept.shape)[kept]
        for column in (np.array([run.run[0] for run in runs])[starts.run], starts.row, ahead.run_up)
    )
    t = np.concatenate([np.asarray(runs[k].t)[row + 1 :][:horizon] for k, row in zip(*starts, strict=True)])
    deviation = np.sqrt(np.maximum(np.diagonal(ahead.covariance, axis1=2, axis2=3), 0.0))
    x, y, theta, sd_x, sd_y, sd_theta = np.concatenate([ahead.pose, deviation], axis=2)[kept].T
    return Prediction(run, start, step[kept], t, x, y, theta, sd_x, sd_y, sd_theta, run_up)


def prediction_error(prediction: Prediction, log: Log) -> dict[str, Any]:
    """How far the free runs end from the measured poses, over the longest runs whose last row has a pose: median and
    root mean square, beside what the predictions' own deviations say (`expected`, without camera error). `starts`:
    free runs that reach the horizon; `run_up`: those that began from a run-up; `failed`: those that are not finite,
    which count in no mean."""
    last = np.flatnonzero(prediction.step == prediction.step.max())
    runs = {int(run.run[0]): run for run in log.runs()}
    ends = [(runs[int(prediction.run[k])], int(prediction.start[k]), int(prediction.step[k]), k) for k in last]
    seconds = [float(run.t[start + step] - run.t[start]) for run, start, step, _ in ends]
    measured = np.array([[run.pose[c][start + step] for c in range(3)] for run, start, step, _ in ends])
    modelled = np.stack([prediction.x, prediction.y, prediction.theta], axis=1)[last]
    deviation = np.stack([prediction.sd_x, prediction.sd_y, prediction.sd_theta], axis=1)[last]
    finite = np.isfinite(modelled).all(axis=1) & np.isfinite(deviation).all(axis=1)
    seen = np.isfinite(measured).all(axis=1) & finite
    dx, dy, turn = (measured - modelled)[seen].T
    position, heading = np.hypot(dx, dy), np.abs((turn + np.pi) % (2.0 * np.pi) - np.pi)
    own = [root_mean_square(column) for column in deviation[seen].T] if seen.any() else [np.nan] * 3
    summary: dict[str, Any] = {
        "starts": len(last), "compared": int(seen.sum()), "failed": int(np.sum(~finite)),
        "run_up": int(np.sum(prediction.run_up[last])), "seconds": float(np.median(seconds)),
    }  # fmt: skip
    for name, error, told in (("position", position, np.hypot(own[0], own[1])), ("heading", heading, own[2])):
        summary[f"{name}_median"] = float(np.median(error)) if seen.any() else None
        summary[f"{name}_rms"] = root_mean_square(error) if seen.any() else None
        summary[f"{name}_expected"] = float(told) if seen.any() else None
    return summary


def root_mean_square(values: np.ndarray) -> float:
    """Of numbers (n,) of any size: the square of a pose that ran away is beyond double precision, its root is not."""
    largest = float(np.max(np.abs(values)))
    return largest * float(np.sqrt(np.mean((values / largest) ** 2))) if largest > 0.0 else 0.0

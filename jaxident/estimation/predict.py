"""Free-run prediction from many rows of a log, each start state estimated from the rows before it alone."""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Pose, Wheels
from jaxident.effects.checks import check_effects
from jaxident.errors import InputError
from jaxident.estimation.free_run import Fit, Window, fit_with_noise, free_run, over_windows
from jaxident.estimation.predict_filtered import filter_rows, run_ahead_filtered
from jaxident.log import Log
from jaxident.numerics import require_float64
from jaxident.robot.difference import Difference
from jaxident.robot.model import Model, require_physical
from jaxident.robot.simulate import check_period

LEAD = 30
"""Rows before the burn-in whose commands tell effects with a memory (a delay, a lag, play) where they stand."""


class Prediction(NamedTuple):
    """One entry per predicted row (rows,): the run, the row of it that the prediction starts from, the steps since,
    the time [s], the pose [m], [rad] and its standard deviation (`predict` says from what)."""

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


def predict(model: Model, log: Log, horizon: int, *, burn_in: int = 20, stride: int | None = None) -> Prediction:
    """Free runs over `horizon` rows from rows burn_in, burn_in + stride, ... of each run (stride: the horizon).

    A physical model with a noise law starts from the filtered state (`predict_filtered`: over the last `burn_in` rows,
    with slip over at least FORGOTTEN), and the deviations tell of start state, slip and the covariance of the
    parameters. For other models the state at the first of the last `burn_in` rows is fitted to the poses up to the
    start by Gauss-Newton, each channel weighted by the fit's own noise; the deviations tell of that fit alone. So it is
    for models with effects, whose free runs begin LEAD rows earlier; runs follow each other in session time, and what
    is random among effects does not act. Runs too short to start in are left out; a free run ends with its run.
    InputError where no run is long enough, and for effects that `check_effects` refuses. Needs double precision.
    """
    require_float64("predict")
    if model.effects:
        require_physical(model)
        check_effects(model.effects)
    stride = horizon if stride is None else stride
    for name, value, least in (("horizon", horizon, 1), ("burn-in", burn_in, 1), ("stride", stride, 1)):
        if value < least:
            raise InputError(f"{name} {value}: at least {least} row is needed")
    if isinstance(model.dynamics, Difference):
        check_period(model, log)
    filtered = None if model.effects else filter_rows(model, burn_in)
    before = filtered or burn_in + (LEAD if model.effects else 0)
    numbers, starts, windows = _cut(log, horizon, burn_in, stride, before, burn_in if model.effects else before)
    if filtered is None:
        early = jax.tree.map(lambda column: column[:, : before + 1] if column.ndim == 2 else column, windows)
        run = _run_ahead(model, windows, fit_with_noise(model, early))
        run = jax.tree.map(lambda column: column[:, before + 1 :], run)
    else:
        run = _filter_all(model, windows, before)
    pose, deviation = jax.tree.map(np.asarray, run)
    return _flatten(log, numbers, starts, windows, pose, deviation, before)


def _cut(
    log: Log, horizon: int, burn_in: int, stride: int, before: int, seen: int
) -> tuple[np.ndarray, np.ndarray, Window]:
    """Run index, start row and window of every start, `before` rows before it, `seen` of them with their poses.

    Rows past the end of a run repeat with time going on; those before its beginning hold no pose and no command.
    """
    numbers, starts, windows, passed = [], [], [], 0.0
    for number, run in enumerate(log.runs()):
        period = float(np.median(np.diff(run.t))) if len(run.t) > 1 else 1.0
        for start in range(burn_in, len(run.t) - 1, stride):
            rows = np.arange(start - before, start + horizon + 1)
            inside = np.clip(rows, 0, len(run.t) - 1)
            t = np.asarray(run.t)[inside] + period * (rows - inside)
            pose = Pose(*(np.asarray(column)[inside] for column in run.pose))
            known = np.isfinite(pose.x) & (rows <= start) & (rows >= max(start - seen, 0))
            command = Wheels(*(np.where(rows < 0, 0.0, np.asarray(u)[inside]) for u in run.command))
            pose = Pose(*(np.where(known, column, 0.0) for column in pose))
            windows.append(Window(t, command, pose, known, passed + t[0] - float(run.t[0])))
            numbers.append(number)
            starts.append(start)
        passed += float(run.t[-1] - run.t[0])
    if not windows:
        raise InputError(f"no run is longer than the burn-in of {burn_in} rows: nothing to predict")
    return np.array(numbers), np.array(starts), jax.tree.map(lambda *columns: np.stack(columns), *windows)


@partial(jax.jit, static_argnames="before")
def _filter_all(model: Model, windows: Window, before: int) -> tuple[Pose, Pose]:
    return over_windows(lambda window: run_ahead_filtered(model, window, before), windows)


@jax.jit
def _run_ahead(model: Model, windows: Window, fits: Fit) -> tuple[Pose, Pose]:
    """Poses of whole windows (windows, rows) and their standard deviations, from the fitted start states."""

    def one(window, fit):
        poses = free_run(model, window)
        slopes = jax.jacfwd(poses)(fit.start)
        spread = (jnp.sqrt(jnp.einsum("ki,ij,kj->k", slope, fit.covariance, slope)) for slope in slopes)
        return poses(fit.start), Pose(*spread)

    return over_windows(lambda pair: one(*pair), (windows, fits))


def _flatten(log, numbers, starts, windows, pose, deviation, before) -> Prediction:
    """One row per predicted row that the log still has."""
    lengths = np.array([len(run.t) for run in log.runs()])
    names = np.array([run.run[0] for run in log.runs()])
    horizon = pose.x.shape[1]
    step = np.broadcast_to(np.arange(1, horizon + 1), pose.x.shape)
    kept = starts[:, None] + step < lengths[numbers][:, None]
    times = np.asarray(windows.t)[:, before + 1 :][kept]
    values = (column[kept] for column in (*pose, *deviation))
    run, start = (np.broadcast_to(column[:, None], pose.x.shape)[kept] for column in (names[numbers], starts))
    return Prediction(run, start, step[kept], times, *values)


def prediction_error(prediction: Prediction, log: Log) -> dict[str, Any]:
    """How far the free runs end from the measured poses, over the longest runs whose last row has a pose."""
    last = np.flatnonzero(prediction.step == prediction.step.max())
    runs = {int(run.run[0]): run for run in log.runs()}
    ends = [(runs[int(prediction.run[k])], int(prediction.start[k]), int(prediction.step[k]), k) for k in last]
    seconds = [float(run.t[start + step] - run.t[start]) for run, start, step, _ in ends]
    seen = [
        (prediction.x[k] - run.x[row], prediction.y[k] - run.y[row], prediction.theta[k] - run.theta[row])
        for run, start, step, k in ends
        if np.isfinite(run.x[row := start + step])
    ]
    dx, dy, turn = np.array(seen).reshape(-1, 3).T
    position, heading = np.hypot(dx, dy), np.abs((turn + np.pi) % (2.0 * np.pi) - np.pi)
    summary: dict[str, Any] = {"starts": len(last), "compared": len(seen), "seconds": float(np.median(seconds))}
    for name, error in (("position", position), ("heading", heading)):
        summary[f"{name}_median"] = float(np.median(error)) if seen else None
        summary[f"{name}_rms"] = float(np.sqrt(np.mean(error**2))) if seen else None
    return summary

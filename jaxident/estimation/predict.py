"""Free-run prediction from many rows of a log, each start state estimated from the rows before it alone."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array, Pose, State, Wheels
from jaxident.errors import InputError
from jaxident.estimation.predict_filtered import filter_rows, run_ahead_filtered
from jaxident.log import Log
from jaxident.numerics import require_float64, wrap
from jaxident.robot.dead_zone import effective_command
from jaxident.robot.difference import Difference
from jaxident.robot.drive import force, hold
from jaxident.robot.model import Model, require_physical
from jaxident.robot.simulate import check_period, run_difference, run_forces

ITERATIONS = 8
WINDOWS_AT_ONCE = 256
SMALLEST_NOISE = 1e-9
"""Camera noise [m, rad] that noise-free logs are weighted by."""

SPEED_PRIOR = 10.0
"""Standard deviation of the start speeds before any pose is seen [m/s, rad/s]: wider than any robot meant here."""


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


class Window(NamedTuple):
    """A stretch of a log, rows before and after the start: times, commands, poses (rows,), and which poses count."""

    t: Any
    command: Wheels
    pose: Pose
    known: Any


def predict(model: Model, log: Log, horizon: int, *, burn_in: int = 20, stride: int | None = None) -> Prediction:
    """Free runs over `horizon` rows from rows burn_in, burn_in + stride, ... of each run (stride: the horizon).

    A physical model with a noise law starts from the filtered state (`predict_filtered`: over the last `burn_in` rows,
    with slip over at least FORGOTTEN), and the deviations tell of start state, slip and the covariance of the
    parameters. For other models the state at the first of the last `burn_in` rows is fitted to the poses up to the
    start by Gauss-Newton, each channel weighted by the fit's own noise; the deviations tell of that fit alone. Runs
    too short to start in are left out; a free run ends with its run. InputError where no run is long enough, or for a
    model with effects, which this prediction does not know. Needs double precision.
    """
    require_float64("predict")
    if model.effects:
        raise InputError(f"effect {model.effects[0].name!r}: prediction runs nominal models only")
    stride = horizon if stride is None else stride
    for name, value, least in (("horizon", horizon, 1), ("burn-in", burn_in, 1), ("stride", stride, 1)):
        if value < least:
            raise InputError(f"{name} {value}: at least {least} row is needed")
    if isinstance(model.dynamics, Difference):
        check_period(model, log)
    filtered = filter_rows(model, burn_in)
    before = burn_in if filtered is None else filtered
    numbers, starts, windows = _cut(log, horizon, burn_in, stride, before)
    if filtered is None:
        early = jax.tree.map(lambda column: column[:, : before + 1], windows)
        run = _run_ahead(model, windows, _fit_with_noise(model, early))
        run = jax.tree.map(lambda column: column[:, before + 1 :], run)
    else:
        run = _filter_all(model, windows, before)
    pose, deviation = jax.tree.map(np.asarray, run)
    return _flatten(log, numbers, starts, windows, pose, deviation, before)


def _cut(log: Log, horizon: int, burn_in: int, stride: int, before: int) -> tuple[np.ndarray, np.ndarray, Window]:
    """Run index, start row and window of every start, `before` rows before it.

    Rows past the end of a run repeat with time going on; those before its beginning hold no pose and no command.
    """
    numbers, starts, windows = [], [], []
    for number, run in enumerate(log.runs()):
        period = float(np.median(np.diff(run.t))) if len(run.t) > 1 else 1.0
        for start in range(burn_in, len(run.t) - 1, stride):
            rows = np.arange(start - before, start + horizon + 1)
            inside = np.clip(rows, 0, len(run.t) - 1)
            t = np.asarray(run.t)[inside] + period * (rows - inside)
            pose = Pose(*(np.asarray(column)[inside] for column in run.pose))
            known = np.isfinite(pose.x) & (rows <= start) & (rows >= 0)
            command = Wheels(*(np.where(rows < 0, 0.0, np.asarray(u)[inside]) for u in run.command))
            windows.append(Window(t, command, Pose(*(np.where(known, c, 0.0) for c in pose)), known))
            numbers.append(number)
            starts.append(start)
    if not windows:
        raise InputError(f"no run is longer than the burn-in of {burn_in} rows: nothing to predict")
    return np.array(numbers), np.array(starts), jax.tree.map(lambda *columns: np.stack(columns), *windows)


def _free_run(model: Model, window: Window) -> Callable[[Array], Pose]:
    """The poses of a window as a function of its first row's state (x, y, theta, v, w)."""
    if isinstance(model.dynamics, Difference):
        difference = model.dynamics
        return lambda start: run_difference(
            difference, model.dead_zone, window.command, State(*start), model.sample_period
        )
    passed = effective_command(window.command, model.dead_zone)
    drive = require_physical(model)
    solution, pull = hold(drive, jnp.diff(window.t)), force(drive, passed)
    return lambda start: run_forces(solution, pull, State(*start)).pose


class Fit(NamedTuple):
    """The state at a window's first row (5,), its covariance (5, 5), and squared residuals [m^2], [rad^2] with their
    degrees of freedom, both (2,)."""

    start: Any
    covariance: Any
    square: Any
    freedom: Any


def _fit_start(model: Model, window: Window, noise: Array) -> Fit:
    """Gauss-Newton fit of the state at the first row of `window` to its known poses.

    A prior of zero speed within SPEED_PRIOR keeps the fit solvable where fewer than two poses are known.
    """
    poses = _free_run(model, window)
    known, scale = window.known, (noise[0], noise[0], noise[1])

    def residual(start):
        pose = poses(start)
        error = (pose.x - window.pose.x, pose.y - window.pose.y, wrap(pose.theta - window.pose.theta))
        parts = [jnp.where(known, e / s, 0.0) for e, s in zip(error, scale, strict=True)]
        weighted = jnp.concatenate([*parts, start[3:] / SPEED_PRIOR])
        return weighted, weighted

    def improve(_, now):
        start, _, _ = now
        slope, error = jax.jacfwd(residual, has_aux=True)(start)
        information = slope.T @ slope + 1e-12 * jnp.eye(5)
        return start - jnp.linalg.solve(information, slope.T @ error), information, error

    first = jnp.argmax(known)
    guess = jnp.stack([*(column[first] for column in window.pose), 0.0, 0.0])
    empty = jnp.zeros((5, 5)), jnp.zeros(3 * len(known) + 2)
    start, information, error = jax.lax.fori_loop(0, ITERATIONS, improve, (guess, *empty))
    by_channel = jnp.sum(error[:-2].reshape(3, -1) ** 2, axis=1)
    square = jnp.stack([(by_channel[0] + by_channel[1]) * noise[0] ** 2, by_channel[2] * noise[1] ** 2])
    freedom = jnp.maximum(jnp.array([2.0, 1.0]) * jnp.sum(known) - jnp.array([3.0, 2.0]), 0.0)
    return Fit(start, jnp.linalg.inv(information), square, freedom)


def _over_windows(function: Callable, windows):
    """The function mapped over windows in blocks, which bounds the memory; the last block is filled up with copies,
    so that all have one shape."""
    count = len(jax.tree.leaves(windows)[0])
    block = min(count, WINDOWS_AT_ONCE)
    rows = jnp.arange(-(-count // block) * block) % count
    blocks = jax.tree.map(lambda leaf: leaf[rows].reshape(-1, block, *leaf.shape[1:]), windows)
    result = jax.lax.map(jax.vmap(function), blocks)
    return jax.tree.map(lambda leaf: leaf.reshape(-1, *leaf.shape[2:])[:count], result)


@jax.jit
def _fit_all(model: Model, windows: Window, noise: Array) -> Fit:
    return _over_windows(lambda window: _fit_start(model, window, noise), windows)


@partial(jax.jit, static_argnames="before")
def _filter_all(model: Model, windows: Window, before: int) -> tuple[Pose, Pose]:
    return _over_windows(lambda window: run_ahead_filtered(model, window, before), windows)


def _fit_with_noise(model: Model, windows: Window) -> Fit:
    """Fits weighted by the camera's noise: the model's, else that of the residual of equally weighted fits."""
    law = model.noise
    if law is not None and float(law.position) > 0.0 and float(law.heading) > 0.0:
        return _fit_all(model, windows, jnp.array([law.position, law.heading]))
    noise = jnp.array([1e-2, 1e-2])
    for _ in range(2):
        fit = _fit_all(model, windows, noise)
        square = jnp.sum(fit.square, axis=0) / jnp.maximum(jnp.sum(fit.freedom, axis=0), 1.0)
        noise = jnp.maximum(jnp.sqrt(square), SMALLEST_NOISE)
    return _fit_all(model, windows, noise)


@jax.jit
def _run_ahead(model: Model, windows: Window, fits: Fit) -> tuple[Pose, Pose]:
    """Poses of whole windows (windows, rows) and their standard deviations, from the fitted start states."""

    def one(window, fit):
        poses = _free_run(model, window)
        slopes = jax.jacfwd(poses)(fit.start)
        spread = (jnp.sqrt(jnp.einsum("ki,ij,kj->k", slope, fit.covariance, slope)) for slope in slopes)
        return poses(fit.start), Pose(*spread)

    return _over_windows(lambda pair: one(*pair), (windows, fits))


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

"""From logs to what a diagnosis works on: scaled commands, windows, and what each run is for."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.causes.lost import Lost
from jaxident.diagnosis.causes.search import Data, Solution, refit
from jaxident.diagnosis.frames import Frames, blind, find_more_outliers, find_outliers, find_repeats, has_outliers
from jaxident.diagnosis.motion.coordinates import neutral_vector, nominal_vector
from jaxident.diagnosis.motion.linear import START_STATES
from jaxident.diagnosis.motion.responses import respond
from jaxident.diagnosis.motion.windows import Windows, cut, take
from jaxident.diagnosis.noise.law import Law, first_law, white_whitener
from jaxident.diagnosis.noise.sizing import size_noise
from jaxident.errors import InputError
from jaxident.estimation.checks import check_informative
from jaxident.estimation.maximum_likelihood import begin
from jaxident.estimation.runs import stack_runs
from jaxident.log import Log, join
from jaxident.robot.drive import Physical

BURN = 20
"""Rows from which a window's start state is estimated before the horizon begins."""
FEWEST = 3
"""Poses among the first rows of a window that tell its start state, five numbers."""
LONGEST, SHORTEST = 60, 20
"""Rows of a horizon where none is asked for: cost grows with their cube, sensitivity with their number."""
HORIZON = 1.0
"""Horizon [s] where none is asked for."""


class Prepared(NamedTuple):
    """The log with commands over `largest`; windows; which of them name, boolean (windows,), the others only judge the
    gap; horizon [s] and its rows; the nominal fit and noise law from the windows that name; the share of commands that
    never arrived, and the gain of saying so: commands are those that did, those `sent` (rows of a run, runs, 2) are
    kept beside them."""

    log: Log
    largest: float
    windows: Windows
    naming: Any
    horizon: float
    frames: Frames
    nominal: Solution
    law: Law
    lost: tuple[float, float] = (0.0, 0.0)
    sent: Any = None


def prepare(
    logs, horizon: float | None, nominal: Array | None = None, like: "Prepared | None" = None, law: Law | None = None
) -> Prepared:
    """Windows, roles and the nominal fit; `nominal` (10,) is where its search begins, from the data alone without.

    With `like` the commands are scaled as there, and with `law` the noise is taken for that: logs of a simulator, often
    free of noise, are judged by what the robot's camera could see. InputError where the log says nothing: no motion, no
    excitation, too few poses.
    """
    log = join(logs)
    check_informative(log)
    largest = float(np.nanmax(np.abs(np.stack(log.command)))) if like is None else like.largest
    log = log._replace(u_r=np.asarray(log.u_r) / largest, u_l=np.asarray(log.u_l) / largest)
    frozen = find_repeats(log) if law is None else np.zeros(len(log.t), bool)
    log = blind(log, frozen)
    period = float(np.median(np.concatenate([np.diff(run.t) for run in log.runs()])))
    rows, horizon = horizon_rows(horizon, period)
    windows = stretches(log, BURN + rows)
    naming = roles(windows)
    if not naming.any() or naming.all():
        raise InputError(
            f"{len(log.t)} rows make {len(naming)} windows of {BURN + rows} rows: too few to name and to judge; "
            "record longer runs, or three of them"
        )
    vector = neutral_vector(starting_point(log) if nominal is None else nominal)
    first = rough_fit(windows, naming, vector, law)
    if law is not None:
        return Prepared(log, largest, windows, naming, horizon, Frames(frozen, frozen), first, law)
    outlying = find_outliers(log, windows, first)
    if outlying.any():
        windows, naming, first = without_rows(log, outlying, first)
    if has_outliers(outlying):
        outlying |= find_more_outliers(blind(log, outlying), windows, first)
        windows, naming, first = without_rows(log, outlying, first)
    responses = respond(np.exp(first.vector[:2]), first.linear.residual, windows)
    law = size_noise(first.linear.residual, first.linear.starts, windows, responses, naming)
    return Prepared(log, largest, windows, naming, horizon, Frames(frozen, outlying), first, law)


def repaired(prepared: Prepared, lost: Lost, worth: float) -> Prepared:
    """With the commands that arrived in place of those that were sent, which is worth some gain."""
    log = prepared.log
    arrived = np.concatenate([lost.arrived[: len(run.t), k] for k, run in enumerate(log.runs())])
    log = log._replace(u_r=arrived[:, 0], u_l=arrived[:, 1])
    windows = prepared.windows._replace(command=lost.arrived)
    share, gain = prepared.lost
    sent = prepared.windows.command if prepared.sent is None else prepared.sent
    return prepared._replace(log=log, windows=windows, lost=(share + lost.share, gain + worth), sent=sent)


def horizon_rows(horizon: float | None, period: float) -> tuple[int, float]:
    """Rows of a horizon [s], and the horizon that they make."""
    if horizon is None:
        rows = int(np.clip(round(HORIZON / period), SHORTEST, LONGEST))
    else:
        rows = round(horizon / period)
        if not 1 <= rows <= 4 * LONGEST:
            raise InputError(
                f"horizon: {horizon:g} s is {rows} samples of this log; "
                f"{period:g} to {4 * LONGEST * period:g} s are allowed"
            )
    return rows, rows * period


def starting_point(log: Log) -> np.ndarray:
    """The nominal coordinates (10,) that the starter of the likelihood finds."""
    runs = jax.tree.map(jnp.asarray, stack_runs(log))
    found = begin(runs, jnp.asarray(0.9)).estimate
    drive = Physical(np.asarray(found.rate), np.asarray(found.gain))
    point = nominal_vector(drive, np.asarray(found.dead_zone))
    if not np.all(np.isfinite(point)) or abs(np.linalg.det(np.asarray(found.gain))) < 1e-9:
        raise InputError("the log does not determine a nominal model: drive both wheels, at several levels")
    return point


def rough_fit(windows: Windows, naming: Array, vector: Array, law: Law | None = None) -> Solution:
    """The nominal fit for white camera noise, of a law or as fourth differences size it."""
    law = first_law(windows) if law is None else law
    return refit(Data(windows, white_whitener(law, windows), naming), vector, first_starts(windows), (), most=6)


def first_starts(windows: Windows) -> np.ndarray:
    """Start states (5, windows) from the first poses seen in each window."""
    pose, seen = np.asarray(windows.pose), np.asarray(windows.seen)
    starts = np.zeros((START_STATES, pose.shape[1]))
    time = np.cumsum(windows.step, axis=0) - windows.step
    for window in range(pose.shape[1]):
        rows = np.flatnonzero(seen[:, window])[:8]
        x, y, theta = pose[rows, window].T
        theta = np.unwrap(theta)
        passed = time[rows[-1], window] - time[rows[0], window]
        middle = theta[len(rows) // 2]
        v = ((x[-1] - x[0]) * np.cos(middle) + (y[-1] - y[0]) * np.sin(middle)) / passed
        w = (theta[-1] - theta[0]) / passed
        starts[:, window] = x[0], y[0], theta[0], v, w
    return starts


def roles(windows: Windows) -> np.ndarray:
    """Windows that name, boolean (windows,); the others, every third run from the second on, only judge the gap.

    Of one or two runs it is stretches of four windows, so that both purposes see early and late.
    """
    order = windows.run if len(np.unique(windows.run)) >= 3 else np.arange(len(windows.run)) // 2
    return order % 3 != 1


def stretches(log: Log, rows: int) -> Windows:
    """Windows of some rows that show their start. Where a second without poses comes first, the speed before is a
    guess: one far off bends a whole fit, or leaves what no number can hold. InputError where there are none."""
    windows = cut(log, rows)
    shown = np.flatnonzero(shows_start(windows))
    if not len(shown):
        raise InputError(f"no stretch of {rows} rows has {FEWEST} poses among its first {BURN}")
    return take(windows, shown)


def shows_start(windows: Windows) -> np.ndarray:
    """Windows, boolean, that have poses enough among their first rows."""
    return np.sum(windows.seen[:BURN], axis=0) >= FEWEST


def without_rows(log: Log, rows: Array, fit: Solution) -> tuple[Windows, np.ndarray, Solution]:
    """Windows, roles and the nominal fit without the poses of some rows, windows as long as those of a fit."""
    windows = stretches(blind(log, rows), fit.linear.residual.shape[1] // 3)
    naming = roles(windows)
    return windows, naming, rough_fit(windows, naming, fit.vector)

"""A log: the columns of a file, and what can be said of its time base.

Row k holds the time t_k, the command applied from t_k until t_{k+1} and the camera pose at t_k.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Pose, Wheels
from jaxident.errors import InputError

EVEN_TOLERANCE = 0.05
"""Largest departure of a time step from the period, in periods: stamps rounded to a millisecond pass up to 60 Hz,
jitter and gaps do not."""


class Log(NamedTuple):
    """Motor commands and camera poses, one entry per row, all arrays (samples,).

    t [s] rises strictly within a run; u_r, u_l in the user's unit; x, y [m], theta [rad], NaN where the camera saw
    nothing; run numbers the runs. A named tuple of arrays: it passes through `jit` and `vmap` as it is.
    """

    t: Any
    u_r: Any
    u_l: Any
    x: Any
    y: Any
    theta: Any
    run: Any

    @property
    def pose(self) -> Pose:
        """The pose columns."""
        return Pose(self.x, self.y, self.theta)

    @property
    def command(self) -> Wheels:
        """The command columns."""
        return Wheels(self.u_r, self.u_l)

    def runs(self) -> list["Log"]:
        """The log cut into its runs, in the order in which they first appear."""
        run = np.asarray(self.run)
        cuts = np.flatnonzero(run[1:] != run[:-1]) + 1
        return [self.rows(a, b) for a, b in pairwise([0, *cuts.tolist(), len(run)])]

    def rows(self, first: int, last: int) -> "Log":
        """Rows first to last, the last not included."""
        return Log(*(column[first:last] for column in self))


def make_log(t, u_r, u_l, x=None, y=None, theta=None, run=None) -> Log:
    """A log from arrays (samples,); columns left out are a camera that saw nothing, and a single run."""
    blind = np.full(np.shape(t), np.nan)
    x, y, theta = (blind if column is None else column for column in (x, y, theta))
    return Log(t, u_r, u_l, x, y, theta, np.zeros(np.shape(t), int) if run is None else run)


def join(logs: "Log | Sequence[Log]") -> Log:
    """Several logs as one, their runs renumbered 0, 1, ... in the order given."""
    logs = [logs] if isinstance(logs, Log) else list(logs)
    runs = [run for log in logs for run in log.runs()]
    numbered = [run._replace(run=np.full(len(run.t), number)) for number, run in enumerate(runs)]
    return Log(*(np.concatenate(columns) for columns in zip(*numbered, strict=True)))


def between(log: Log, first: float | None, last: float | None) -> Log:
    """The rows with first <= t <= last [s]; None leaves a side open. InputError where none is left."""
    t = np.asarray(log.t)
    kept = (t >= (-np.inf if first is None else first)) & (t <= (np.inf if last is None else last))
    if not np.any(kept):
        raise InputError(f"no row between t = {first} and {last} s: the log runs from {t.min():g} to {t.max():g} s")
    return Log(*(np.asarray(column)[kept] for column in log))


def repeats(log: Log) -> np.ndarray:
    """Boolean (samples,): rows whose pose equals the one before in all three numbers."""
    pose = np.stack([np.asarray(column) for column in log.pose])
    same = np.concatenate([[False], np.all(pose[:, 1:] == pose[:, :-1], axis=0)])
    return same & ~first_rows(log)


def blind(log: Log, rows: Any) -> Log:
    """The log without the poses of some rows, boolean (samples,)."""
    x, y, theta = (np.where(rows, np.nan, column) for column in log.pose)
    return log._replace(x=x, y=y, theta=theta)


def run_begins(log: Log) -> np.ndarray:
    """The row (runs,) at which each run begins."""
    return np.flatnonzero(first_rows(log))


def first_rows(log: Log) -> np.ndarray:
    """Boolean (samples,): the first row of each run."""
    run = np.asarray(log.run)
    return np.concatenate([[True], run[1:] != run[:-1]])


def even_period(log: Log) -> float:
    """The sample period [s] that all runs of the log share; InputError naming the first row that breaks it."""
    runs = [run for run in log.runs() if len(run.t) > 1]
    if not runs:
        raise InputError("every run has a single row: no sample period")
    steps = np.concatenate([np.diff(run.t) for run in runs])
    starts = np.concatenate([run.t[:-1] for run in runs])
    median = np.quantile(steps, 0.5, method="lower")
    period = np.mean(steps[np.abs(steps - median) < 0.5 * median])  # without the gaps; stamps may be rounded
    odd = np.flatnonzero(np.abs(steps - period) > EVEN_TOLERANCE * period)
    if odd.size:
        raise InputError(
            f"uneven time steps: the step from t = {starts[odd[0]]:.6g} s takes {steps[odd[0]]:.4g} s, the others "
            f"{period:.4g} s; this method needs an even log, `jaxident convert --period` makes one"
        )
    return float(period)

"""A log: the columns of a file, and what can be said of its time base.

Row k holds the time t_k, the command applied from t_k until t_{k+1}, the camera pose and perhaps wheel speeds at t_k.
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Pose, Wheels
from jaxident.columns import WHEELS, check_both_wheels, columns_of_frame, numbers
from jaxident.errors import InputError
from jaxident.rules import enforce, log_rules, repeat_last

EVEN_TOLERANCE = 0.05
"""Largest departure of a time step from the period, in periods: stamps rounded to a millisecond pass up to 60 Hz,
jitter and gaps do not."""


class _Columns(NamedTuple):
    t: Any
    u_r: Any
    u_l: Any
    x: Any
    y: Any
    theta: Any
    run: Any


class Log(_Columns):
    """Motor commands and camera poses, one entry per row, all arrays (samples,).

    t [s] rises strictly within a run; u_r, u_l in the user's unit; x, y [m], theta [rad], NaN where the camera saw
    nothing; run numbers the runs. A named tuple of arrays: it passes through `jit` and `vmap` as it is, and unpacks
    into its columns. A slice, a mask or an array of rows picks rows: `log[:10]` is a log of ten.

    wheel_r, wheel_l: the robot's own wheel speeds [rad/s], NaN where it measured none. In a log without them both are
    None, and no columns of the tuple; a log with them is a `LogWithWheels`.

    Examples:
        >>> import jaxident as ji
        >>> ji.Log.from_arrays([0.0, 0.1, 0.2], [1, 1, 1], [1, 1, 1], [0, 0.02, 0.04], [0] * 3, [0] * 3)
        Log of 3 rows in 1 run(s), 0.2 s, 100 % with a pose
    """

    __slots__ = ()

    def __new__(cls, t, u_r, u_l, x, y, theta, run, wheel_r=None, wheel_l=None) -> "Log":
        """A log of seven columns, or of nine with both wheels' speeds. InputError for one wheel alone."""
        columns = t, u_r, u_l, x, y, theta, run
        if wheel_r is None and wheel_l is None:
            return tuple.__new__(Log, columns)
        given = {"wheel_r": wheel_r, "wheel_l": wheel_l}
        check_both_wheels("log", [name for name, column in given.items() if column is not None])
        return tuple.__new__(LogWithWheels, (*columns, wheel_r, wheel_l))

    @classmethod
    def from_arrays(cls, t, u_r, u_l, x=None, y=None, theta=None, run=None, wheel_r=None, wheel_l=None) -> "Log":
        """A checked log, float64, from arrays (samples,); what is left out as in `make_log`. InputError names the row
        that breaks a rule of log files."""
        return from_columns(make_log(t, u_r, u_l, x, y, theta, run, wheel_r, wheel_l)._asdict())

    @classmethod
    def from_dataframe(
        cls,
        frame: Any,
        columns: Mapping[str, str] | str | None = None,
        units: Mapping[str, str | float] | None = None,
    ) -> "Log":
        """A checked log from a data frame, or a dict of arrays.

        columns: where its columns have other names, {"t": "time_ms", "theta": "yaw"} or "t=time_ms:ms,theta=yaw:deg".
        units: {"t": "ms", "theta": "deg"}, or numbers to multiply by. A time may be dates or ISO texts (then Unix
        time), a heading four columns qx,qy,qz,qw. Columns that a log has not are ignored. InputError names what
        is wrong.
        """
        return from_frame(frame, columns, units)

    @property
    def pose(self) -> Pose:
        """The pose columns."""
        return Pose(self.x, self.y, self.theta)

    @property
    def command(self) -> Wheels:
        """The command columns."""
        return Wheels(self.u_r, self.u_l)

    @property
    def wheel_r(self) -> Any:
        """Measured speed of the right wheel [rad/s]; None in a log without wheel speeds."""
        return None

    @property
    def wheel_l(self) -> Any:
        """As `wheel_r`, of the left wheel."""
        return None

    def _replace(self, **changes: Any) -> "Log":
        """The log with some columns changed; wheel speeds join it, or as None leave it."""
        return Log(**(self._asdict() | changes))

    def runs(self) -> list["Log"]:
        """The log cut into its runs, in the order in which they first appear."""
        run = np.asarray(self.run)
        cuts = np.flatnonzero(run[1:] != run[:-1]) + 1
        return [self.rows(a, b) for a, b in pairwise([0, *cuts.tolist(), len(run)])]

    def rows(self, first: int, last: int) -> "Log":
        """Rows first to last, the last not included."""
        return Log(*(column[first:last] for column in self))

    def between(self, first: float | None, last: float | None) -> "Log":
        """The rows with first <= t <= last [s]; None leaves a side open. InputError where none is left."""
        return between(self, first, last)

    def __repr__(self) -> str:
        """One line; of columns that JAX traces, their shapes."""
        if not isinstance(self.t, np.ndarray) or self.t.ndim != 1 or not len(self.t):
            return f"Log({', '.join(f'{name}={np.shape(column)}' for name, column in self._asdict().items())})"
        runs, seen = self.runs(), np.isfinite(np.asarray(self.x, float)).mean()
        seconds = sum(float(run.t[-1] - run.t[0]) for run in runs)
        told = f"Log of {len(self.t)} rows in {len(runs)} run(s), {seconds:.4g} s, {100.0 * seen:.3g} % with a pose"
        measured = wheels_measured(self)
        return told if measured is None else f"{told}, {100.0 * measured.mean():.3g} % with both wheel speeds"

    def to_dataframe(self) -> Any:
        """The columns as a pandas data frame."""
        import pandas

        return pandas.DataFrame({name: np.asarray(column) for name, column in self._asdict().items()})

    def __getitem__(self, rows: Any) -> Any:  # type: ignore[override]
        """The rows of a slice, a mask (samples,) or an array of row numbers, as a log; of a number, that column."""
        if isinstance(rows, slice) or np.ndim(rows):
            return Log(*(column[rows if isinstance(rows, slice) else np.asarray(rows)] for column in self))
        return tuple.__getitem__(self, rows)


class LogWithWheels(Log):
    """A log that has wheel speeds: nine columns."""

    __slots__ = ()
    _fields = (*_Columns._fields, *WHEELS)  # type: ignore[assignment]

    def __new__(cls, *columns: Any) -> "LogWithWheels":
        """All nine columns; made by `Log`."""
        return tuple.__new__(cls, columns)

    wheel_r = property(lambda self: tuple.__getitem__(self, 7), doc="Measured speed of the right wheel [rad/s].")
    wheel_l = property(lambda self: tuple.__getitem__(self, 8), doc="Measured speed of the left wheel [rad/s].")


def wheels_measured(log: Log) -> np.ndarray | None:
    """Boolean (samples,): rows with both wheel speeds; None in a log without the columns."""
    return None if log.wheel_r is None else np.isfinite(log.wheel_r) & np.isfinite(log.wheel_l)


def make_log(t, u_r, u_l, x=None, y=None, theta=None, run=None, wheel_r=None, wheel_l=None) -> Log:
    """A log from arrays (samples,); columns left out are a camera that saw nothing, a single run, no wheel speeds."""
    blind = np.full(np.shape(t), np.nan)
    x, y, theta = (blind if column is None else column for column in (x, y, theta))
    return Log(t, u_r, u_l, x, y, theta, np.zeros(np.shape(t), int) if run is None else run, wheel_r, wheel_l)


def from_columns(columns: Mapping[str, Any], name: str = "log") -> Log:
    """A checked log from its columns, float64; `name` says in an error what they belong to."""
    arrays = {column: numbers(column, values) for column, values in columns.items()}
    lengths = {column: len(values) for column, values in arrays.items()}
    if len(set(lengths.values())) > 1:
        raise InputError(f"{name}: columns differ in length: {', '.join(f'{k} {n}' for k, n in lengths.items())}")
    return checked(Log(**arrays), name, lambda row: f"{name}, row {row}")


def from_frame(frame: Any, columns: Any = None, units: Any = None) -> Log:
    """What `Log.from_dataframe` says."""
    return from_columns(make_log(**columns_of_frame(frame, columns, units))._asdict(), "frame")


def require_log(log: Any, caller: str) -> None:
    """InputError naming the call that makes a log, for anything else."""
    if not isinstance(log, Log):
        raise InputError(f"{caller} takes a Log, not a {type(log).__name__}: jaxident.read_log(path) makes one")


def checked(log: Log, name: str, place: Callable[[int], str]) -> Log:
    """The log (float64 arrays) if it keeps the rules of a log, run int64, last commands filled as `read_log` says."""
    if len(log.t) == 0:
        raise InputError(f"{name}: has no rows; a log needs two at least")
    enforce(log_rules(log, first_rows(log)), log._asdict(), place)
    if first_rows(log).all():
        raise InputError(f"{name}: no run has two rows; a log needs one that has")
    u_r, u_l = (repeat_last(command, log.run) for command in log.command)
    return log._replace(u_r=u_r, u_l=u_l, run=log.run.astype(np.int64))


def join(logs: "Log | Sequence[Log]") -> Log:
    """Several logs as one, their runs renumbered 0, 1, ... in the order given."""
    logs = [logs] if isinstance(logs, Log) else list(logs)
    runs = [run for log in logs for run in log.runs()]
    numbered = [run._replace(run=np.full(len(run.t), number)) for number, run in enumerate(runs)]
    if any(log.wheel_r is not None for log in logs):  # where a log has none, none were measured
        numbered = [_with_wheels(run) for run in numbered]
    return Log(*(np.concatenate(columns) for columns in zip(*numbered, strict=True)))


def _with_wheels(run: Log) -> Log:
    if run.wheel_r is not None:
        return run
    return run._replace(wheel_r=np.full(len(run.t), np.nan), wheel_l=np.full(len(run.t), np.nan))


def between(log: Log, first: float | None, last: float | None) -> Log:
    """The rows with first <= t <= last [s]; None leaves a side open. InputError where none is left."""
    t = np.asarray(log.t)
    kept = (t >= (-np.inf if first is None else first)) & (t <= (np.inf if last is None else last))
    if not np.any(kept):
        raise InputError(f"no row between t = {first} and {last} s: the log runs from {t.min():g} to {t.max():g} s")
    return Log(*(np.asarray(column)[kept] for column in log))


def run_begins(log: Log) -> np.ndarray:
    """The row (runs,) at which each run begins."""
    return np.flatnonzero(first_rows(log))


def first_rows(log: Log) -> np.ndarray:
    """Boolean (samples,): the first row of each run."""
    return np.concatenate([[True], np.diff(log.run) != 0])


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
            f"{period:.4g} s; this method needs an even log: `jaxident convert --log LOG --period S --out NEW`"
        )
    return float(period)

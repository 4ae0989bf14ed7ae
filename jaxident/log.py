"""A log: the columns of a file, and what can be said of its time base.

Row k holds the time t_k, the command applied from t_k until t_{k+1} and the camera pose at t_k.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Pose, Wheels
from jaxident.columns import QUATERNION, heading_of, make_columns, numbers, rename, split_heading
from jaxident.errors import InputError
from jaxident.rules import Rule, enforce, pose_rules, rising_time

EVEN_TOLERANCE = 0.05
"""Largest departure of a time step from the period, in periods: stamps rounded to a millisecond pass up to 60 Hz,
jitter and gaps do not."""
LARGEST_RUN = 2**53
"""Beyond this double precision no longer tells one integer from the next."""


class Log(NamedTuple):
    """Motor commands and camera poses, one entry per row, all arrays (samples,).

    t [s] rises strictly within a run; u_r, u_l in the user's unit; x, y [m], theta [rad], NaN where the camera saw
    nothing; run numbers the runs. A named tuple of arrays: it passes through `jit` and `vmap` as it is, and unpacks
    into its columns. A slice, a mask or an array of rows picks rows: `log[:10]` is a log of ten.

    Examples:
        >>> import jaxident as ji
        >>> log = ji.Log.from_arrays([0.0, 0.1, 0.2], [1, 1, 1], [1, 1, 1], [0, 0.02, 0.04], [0] * 3, [0] * 3)
        >>> log
        Log of 3 rows in 1 run(s), 0.2 s, 100 % with a pose
        >>> log[:2].x
        array([0.  , 0.02])
    """

    t: Any
    u_r: Any
    u_l: Any
    x: Any
    y: Any
    theta: Any
    run: Any

    @classmethod
    def from_arrays(cls, t, u_r, u_l, x=None, y=None, theta=None, run=None) -> "Log":
        """A checked log, float64, from arrays (samples,); what is left out as in `make_log`.

        The rules are those of a log file: InputError names the row that breaks one.
        """
        return from_columns(make_log(t, u_r, u_l, x, y, theta, run)._asdict())

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
        return f"Log of {len(self.t)} rows in {len(runs)} run(s), {seconds:.4g} s, {100.0 * seen:.3g} % with a pose"

    def to_dataframe(self) -> Any:
        """The columns as a pandas data frame."""
        import pandas

        return pandas.DataFrame({name: np.asarray(column) for name, column in self._asdict().items()})

    def __getitem__(self, rows: Any) -> Any:  # type: ignore[override]
        """The rows of a slice, a mask (samples,) or an array of row numbers, as a log; of a number, that column."""
        if isinstance(rows, slice) or np.ndim(rows):
            return Log(*(column[rows if isinstance(rows, slice) else np.asarray(rows)] for column in self))
        return tuple.__getitem__(self, rows)


def make_log(t, u_r, u_l, x=None, y=None, theta=None, run=None) -> Log:
    """A log from arrays (samples,); columns left out are a camera that saw nothing, and a single run."""
    blind = np.full(np.shape(t), np.nan)
    x, y, theta = (blind if column is None else column for column in (x, y, theta))
    return Log(t, u_r, u_l, x, y, theta, np.zeros(np.shape(t), int) if run is None else run)


def from_columns(columns: Mapping[str, Any], name: str = "log") -> Log:
    """A checked log from its columns, float64; `name` says in an error what they belong to."""
    arrays = {column: numbers(column, values) for column, values in columns.items()}
    lengths = {column: len(values) for column, values in arrays.items()}
    if len(set(lengths.values())) > 1:
        raise InputError(f"{name}: columns differ in length: {', '.join(f'{k} {n}' for k, n in lengths.items())}")
    return checked(Log(**arrays), name, lambda row: f"{name}, row {row}")


def from_frame(frame: Any, columns: Any = None, units: Any = None) -> Log:
    """What `Log.from_dataframe` says."""
    named = {str(column): column for column in frame.keys()}  # noqa: SIM118 - a frame's, too
    chosen, change = split_heading(named, make_columns(columns, units))
    header = rename(named, chosen, "frame")
    found = {name: frame[named[source]] for name, source in zip(header, named, strict=True)}
    values = {name: numbers(name, found[name]) for name in (*Log._fields, *QUATERNION) if name in found}
    values |= {name: column.convert(values[name]) for name, column in chosen.items() if name in values}
    if "theta" not in values and all(name in values for name in QUATERNION):
        values["theta"] = heading_of(*(values[name] for name in QUATERNION))
        values["theta"] = change.convert(values["theta"]) if change else values["theta"]
    missing = [name for name in ("t", "u_r", "u_l") if name not in values]
    if missing:
        raise InputError(
            f"frame: no column {missing[0]}; there are {', '.join(named)}; name it: columns={{{missing[0]!r}: ...}}"
        )
    return from_columns(make_log(**{name: values[name] for name in Log._fields if name in values})._asdict(), "frame")


def require_log(log: Any, caller: str) -> None:
    """InputError naming the call that makes a log, for anything else."""
    if not isinstance(log, Log):
        raise InputError(f"{caller} takes a Log, not a {type(log).__name__}: jaxident.read_log(path) makes one")


def checked(log: Log, name: str, place: Callable[[int], str]) -> Log:
    """The log (float64 arrays) if it keeps the rules of a log, run int64, last commands filled as `read_log` says."""
    if len(log.t) == 0:
        raise InputError(f"{name}: has no rows; a log needs two at least")
    enforce(_rules(log), log._asdict(), place)
    if first_rows(log).all():
        raise InputError(f"{name}: no run has two rows; a log needs one that has")
    u_r, u_l = (_repeat_last(command, log.run) for command in log.command)
    return log._replace(u_r=u_r, u_l=u_l, run=log.run.astype(np.int64))


def _repeat_last(command: np.ndarray, run: np.ndarray) -> np.ndarray:
    """Every missing command replaced by the one of the row before, 0 where that row is of another run."""
    before = np.concatenate([[0.0], np.where(run[1:] == run[:-1], command[:-1], 0.0)])
    return np.where(np.isnan(command), before, command)


def _rules(log: Log) -> Iterator[Rule]:
    yield Rule("run", ~(log.run == np.round(log.run)) | (np.abs(log.run) >= LARGEST_RUN), "it should be an integer")
    first = first_rows(log)
    starts = np.flatnonzero(first)
    _, new = np.unique(log.run[starts], return_index=True)
    again = np.zeros(len(first), bool)
    again[np.delete(starts, new)] = True
    yield Rule("run", again, "the rows of a run must stand together")
    yield from rising_time(log.t, first)
    last = np.append(first[1:], True)
    for name, command in zip(("u_r", "u_l"), log.command, strict=True):
        yield Rule(name, ~np.isfinite(command) & ~last, "only a run's last row may have no command")
    yield from pose_rules(log.pose)


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
            f"{period:.4g} s; this method needs an even log: `jaxident convert --log LOG --period S --out NEW`"
        )
    return float(period)

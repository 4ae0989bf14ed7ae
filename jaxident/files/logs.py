"""Logs on disk: CSV with the header t,u_r,u_l,x,y,theta and, for several runs in one file, an integer column run.

Row k holds the time t_k [s], the command applied from t_k until t_{k+1} and the camera pose at t_k ([m], [m], [rad]).
Two more columns, wheel_r and wheel_l, may hold what the robot measured of its wheel speeds at t_k [rad/s].
"""

import os
import pathlib
import re
from collections.abc import Mapping, Sequence

import numpy as np

from jaxident.array_types import Pose
from jaxident.columns import WHEELS, Columns, check_both_wheels, make_columns
from jaxident.errors import InputError
from jaxident.files.atomic import writing_text
from jaxident.files.source import Source, explained
from jaxident.files.table import read_table
from jaxident.log import Log, checked, join

COLUMNS = ("t", "u_r", "u_l", "x", "y", "theta")
ROWS_PER_BLOCK = 1 << 16


def read_log(
    path: Source | Sequence[Source],
    columns: Mapping[str, str] | str | None = None,
    units: Mapping[str, str | float] | None = None,
) -> Log:
    """Read a log: a CSV file, a folder of them, or a list of files and folders, one after the other.

    Empty cells of poses and wheel speeds become NaN. The command of the last row of a run may be empty, for it is never
    applied; it is read as a repeat of the command before (0 in a run of a single row). Cells may be parted by
    semicolons or tabs. Further columns are ignored with a UserWarning.

    Args:
        path: the file or folder, or a list of these; "-" is the standard input. A folder stands for its logs
            (`find_logs`).
        columns: where the file has other names, {"t": "time_ms"} or "t=time_ms:ms,theta=yaw:deg". A quaternion in
            qx,qy,qz,qw may stand for theta; a time may be an ISO date (then Unix time).
        units: {"t": "ms", "theta": "deg"}, or numbers to multiply by.

    Returns:
        Log: all runs, arrays (rows,) float64, `run` int64.

    Raises:
        InputError: one line that names the file, the line in it and what would be right.

    Examples:
        >>> import jaxident as ji
        >>> ji.write_log(ji.Log.from_arrays([0.0, 0.1], [1, 1], [1, 1], [0, 0.02], [0, 0], [0, 0]), "log.csv")
        >>> ji.read_log("log.csv")
        Log of 2 rows in 1 run(s), 0.1 s, 100 % with a pose
    """
    return read_whole(path, make_columns(columns, units))


def read_whole(path: Source | Sequence[Source], columns: Columns | None = None) -> Log:
    """A file, a folder or a list of them as one log; see `read_log`."""
    if isinstance(path, str | os.PathLike) and not os.path.isdir(path):
        return read_file(path, columns)
    if not (logs := read_logs(path, columns)):
        raise InputError("no log in an empty list; it takes a path, a folder, or a list of these")
    return join(logs)


def read_file(path: Source, columns: Columns | None = None, poses: bool = True) -> Log:
    """The log of one file; see `read_log`. Without `poses` their columns may be missing."""
    needed = COLUMNS if poses else tuple(name for name in COLUMNS if name not in Pose._fields)
    table = read_table(path, [needed], optional=("run", *WHEELS, *(() if poses else Pose._fields)), columns=columns)
    check_both_wheels(table.name, table.columns)
    none = {name: np.full(len(table.line), np.nan) for name in Pose._fields}
    return checked(Log(**({"run": np.zeros(len(table.line))} | none | table.columns)), table.name, table.place)


def read_logs(paths: Source | Sequence[Source], columns: Columns | None = None, poses: bool = True) -> list[Log]:
    """The logs of files and folders, in the order of `find_logs`; each may hold several runs. Without `poses` their
    columns may be missing."""
    return [read_file(path, columns, poses) for path in find_logs(paths)]


def find_logs(paths: Source | Sequence[Source], prefix: str = "real_") -> list[str]:
    """The log files among files and folders, in the order given; but files whose paths differ in numbers alone come in
    the order of these numbers, as in a folder: how they were listed says nothing then.

    A file stands for itself. A folder stands for its logs (.csv, .csv.gz; not those of its own folders) whose names
    begin with `prefix` or, if there is none, for every log in it, in natural order: run_2 before run_10. InputError
    for a folder without logs.
    """
    found = []
    for path in _listed(paths):
        within = _logs_in(path, prefix) or _logs_in(path, "") if os.path.isdir(path) else [str(path)]
        if not within:
            raise InputError(f"{path}: the folder holds no logs (.csv or .csv.gz)")
        found += within
    numbered = _numbered(found) and not any(os.path.isdir(path) for path in _listed(paths))
    return sorted(found, key=_natural_path) if numbered else found


def find_simulated(paths: Source | Sequence[Source]) -> list[str]:
    """The logs sim_* in the folders among the paths, in natural order; there may be none."""
    return [found for path in _listed(paths) if os.path.isdir(path) for found in _logs_in(path, "sim_")]


def write_log(log: Log, path: Source) -> None:
    """Write a log as CSV, whole or not at all; gzipped if the name ends in .gz.

    Numbers are the shortest that read back as they are. NaN in a pose or a wheel speed becomes an empty cell. The
    column run is there if there is more than one run, those of the wheels if the log has wheel speeds.

    Args:
        log: the log.
        path: the file.

    Raises:
        InputError: a log that `read_log` would refuse, or a file that cannot be written.
        WorkError: the disk is full.

    Examples:
        >>> import jaxident as ji
        >>> ji.write_log(ji.make_log([0.0, 0.1], [1.0, 1.0], [0.5, 0.5]), "commands.csv")
        >>> ji.read_log("commands.csv")
        Log of 2 rows in 1 run(s), 0.1 s, 0 % with a pose
    """
    log = Log(*(np.asarray(column, float) for column in log))
    checked(log, os.fspath(path), lambda row: f"{os.fspath(path)}, row {row}")
    several = log.run[0] != log.run[-1]
    names = (*COLUMNS, *(() if log.wheel_r is None else WHEELS), *(("run",) if several else ()))
    columns = [getattr(log, name) if name != "run" else log.run.astype(np.int64) for name in names]
    with writing_text(path) as stream:
        stream.write(",".join(names) + "\n")
        for start in range(0, len(log.t), ROWS_PER_BLOCK):
            cells = [repr(column[start : start + ROWS_PER_BLOCK].tolist())[1:-1].split(", ") for column in columns]
            block = "\n".join(map(",".join, zip(*cells, strict=True)))
            stream.write(block.replace("nan", "") + "\n")


def require_poses(log: Log, name: str) -> None:
    """InputError naming the log unless the camera saw some run at least twice: less shows no motion."""
    if all(np.isfinite(np.asarray(run.x)).sum() < 2 for run in log.runs()):
        raise InputError(f"{name}: no run has two poses; fill the columns x,y,theta where the camera saw the robot")


def _listed(paths: Source | Sequence[Source]) -> list[pathlib.Path]:
    return [pathlib.Path(path) for path in ([paths] if isinstance(paths, str | os.PathLike) else paths)]


def _logs_in(folder: pathlib.Path, prefix: str) -> list[str]:
    """The folder's logs whose names begin with the prefix, hidden files left out, in natural order."""
    pattern = re.compile(r"(?!\.)" + re.escape(prefix) + r".*\.csv(\.gz)?")
    with explained(str(folder), "CSV"):
        logs = [entry for entry in folder.iterdir() if pattern.fullmatch(entry.name) and entry.is_file()]
    return [str(entry) for entry in sorted(logs, key=_natural)]


def _numbered(paths: Sequence[str]) -> bool:
    """Whether paths are the same but for their numbers, and no two are the same."""
    return len(set(paths)) == len(paths) and len({re.sub("[0-9]+", "0", path) for path in paths}) == 1


def _natural(path: pathlib.Path) -> tuple:
    return _natural_path(path.name)


def _natural_path(path: str) -> tuple:
    """Sorting key that compares runs of digits as numbers: the pieces are text and number by turns."""
    pieces = re.split("([0-9]+)", path)
    return tuple(int(piece) if k % 2 else piece for k, piece in enumerate(pieces)), path

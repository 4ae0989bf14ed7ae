"""Where in a session a log lies: effects that drift depend on it."""

import hashlib

import numpy as np

from jaxident.log import Log
from jaxident.robot.model import Model, Provenance


def session_of(log: Log) -> tuple[tuple[tuple[str, float], ...], float]:
    """The mark and the session time [s] of the first row of each run, one after the other; and the duration of all."""
    runs = log.runs()
    passed = np.concatenate([[0.0], np.cumsum([run.t[-1] - run.t[0] for run in runs])])
    return tuple((mark(run), float(time)) for run, time in zip(runs, passed, strict=False)), float(passed[-1])


def mark(run: Log) -> str:
    """What a run is known by again: the beginning of the SHA-256 of its times and commands."""
    columns = np.nan_to_num(np.stack([np.asarray(column, float) for column in (run.t, run.u_r, run.u_l)]))
    return hashlib.sha256(columns.tobytes()).hexdigest()[:16]


def with_session(origin: Provenance, log: Log) -> Provenance:
    """The provenance of a model made from a log, with the session of its runs."""
    runs, duration = session_of(log)
    return origin._replace(duration=duration, runs=runs)


def time_in_session(model: Model, log: Log, part: Log) -> tuple[float, bool]:
    """Session time [s] of the first row of a part of a log, and whether the model was made from that log: its runs are
    then where they were, and those of any other log come right after them, one after the other."""
    runs, number = log.runs(), float(part.run[0])
    place = [float(run.run[0]) for run in runs].index(number)
    into = float(part.t[0] - runs[place].t[0])
    known = dict(model.provenance.runs).get(mark(runs[place]))
    if known is not None:
        return known + into, True
    return model.provenance.duration + sum(float(run.t[-1] - run.t[0]) for run in runs[:place]) + into, False

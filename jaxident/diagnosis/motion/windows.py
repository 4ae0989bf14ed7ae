"""The logs as a diagnosis sees them: runs for what remembers, windows with a start of their own for what moves."""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.estimation.runs import stack_runs
from jaxident.log import Log

SMALLEST = 8
"""Poses that a window needs: fewer say nothing beyond its start state."""


class Windows(NamedTuple):
    """Runs cut into windows; time first, windows last.

    t (rows of a run, runs) [s]: since the run's first row; session (runs,) [s]: session time of that row; command
    (rows of a run, runs, 2). step (rows, windows) [s]: from each row to the next; pose (rows, windows, 3); seen (rows,
    windows); run (windows,): of which run; first (windows,): its first row there.
    """

    t: Any
    session: Any
    command: Any
    step: Any
    pose: Any
    seen: Any
    run: Any
    first: Any


def cut(log: Log, rows: int, stride: int | None = None, session: Array | None = None) -> Windows:
    """Windows of some rows, one every `stride` (default: rows, so that no pose counts twice), of every run.

    Rows past the end of a run are not seen; what the camera missed neither. session (runs,) overrides the sum of the
    durations before.
    """
    runs = stack_runs(log)
    count, length = runs.seen.shape
    step = np.broadcast_to(np.asarray(runs.step, float), (count, length)) if np.ndim(runs.step) == 0 else runs.step
    t = np.concatenate([np.zeros((count, 1)), np.cumsum(step[:, :-1], axis=1)], axis=1)
    if session is None:
        durations = [run.t[-1] - run.t[0] for run in log.runs()]
        session = np.concatenate([[0.0], np.cumsum(durations)[:-1]])
    stride = rows if stride is None else stride
    firsts = np.arange(0, max(length - 1, 1), stride)
    places = firsts[:, None] + np.arange(rows)
    inside = np.minimum(places, length - 1)
    pose = np.stack(runs.pose, axis=-1)
    seen = runs.seen[:, inside] & (places < length)
    kept = seen.sum(axis=2).ravel() >= SMALLEST

    def windowed(values: np.ndarray) -> np.ndarray:
        return np.moveaxis(values.reshape(-1, *values.shape[2:])[kept], 1, 0)

    return Windows(
        t=t.T, session=np.asarray(session, float), command=np.stack(runs.command, axis=-1).transpose(1, 0, 2),
        step=windowed(step[:, inside]), pose=windowed(pose[:, inside]), seen=windowed(seen),
        run=np.repeat(np.arange(count), len(firsts))[kept], first=np.tile(firsts, count)[kept],
    )  # fmt: skip


def uncut(commands: Array, period: float) -> Windows:
    """Commands (inputs, samples, 2) as runs even at a period [s], each one window of zero poses."""
    count, samples, _ = commands.shape
    t = np.tile(period * np.arange(samples)[:, None], (1, count))
    return Windows(
        t=t, session=np.zeros(count), command=np.asarray(commands).transpose(1, 0, 2), step=np.full(t.shape, period),
        pose=np.zeros((*t.shape, 3)), seen=np.ones(t.shape, bool), run=np.arange(count), first=np.zeros(count, int),
    )  # fmt: skip


def take(windows: Windows, chosen: Array) -> Windows:
    """Some of the windows; the runs stay whole."""
    return windows._replace(
        step=windows.step[:, chosen], pose=windows.pose[:, chosen], seen=windows.seen[:, chosen],
        run=windows.run[chosen], first=windows.first[chosen],
    )  # fmt: skip

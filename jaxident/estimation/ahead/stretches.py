"""Stretches of a log around the rows that predictions start from, cut to one length, for the filter."""

from typing import Any, NamedTuple

import jax
import numpy as np

from jaxident.array_types import Array
from jaxident.effects.past import NO_PAST, Past, past_of_run
from jaxident.errors import InputError
from jaxident.log import Log, join

GUESSED = 8
"""Poses from which the speeds are guessed where a filter begins; it corrects the guess."""
FEWEST = 3
"""Poses below which speeds are not guessed: those of the run-up stay."""


class Stretch(NamedTuple):
    """Rows of a log side by side: t (rows, n) [s] since the first row, session time (n,) [s] there, command (rows, n,
    2), pose (rows, n, 3), seen (rows, n): poses that the filter takes in. first (n,): row of the first of them, from
    which on it filters; speeds (2, n) along and in heading: the guess there, NaN keeps those of the run-up from rest.
    begin (n,): row at which its run begins, moving as it may, or 0. past: what the commands of the whole run left
    behind, leaves (rows, ..., n); no rows where no law asks for it.
    """

    t: Any
    session: Any
    command: Any
    pose: Any
    seen: Any
    first: Any
    speeds: Any
    begin: Any
    past: Past


AXES = Stretch(1, 0, 1, 1, 1, 0, 1, 0, Past(3, 3, 3, 3))
"""The axis of each part of a `Stretch` along which stretches lie side by side."""


class Starts(NamedTuple):
    """Where predictions start: index of the run and row in it, both (starts,)."""

    run: Array
    row: Array


def every(log: Log, burn_in: int, stride: int) -> Starts:
    """Rows burn_in, burn_in + stride, ... of every run. InputError where no run is long enough."""
    rows = [np.arange(burn_in, len(run.t) - 1, stride) for run in log.runs()]
    if not sum(map(len, rows)):
        raise InputError(f"no run is longer than the burn-in of {burn_in} rows: nothing to predict")
    return Starts(np.concatenate([np.full(len(own), k) for k, own in enumerate(rows)]), np.concatenate(rows))


def until_last_start(log: Log, starts: Starts) -> Log:
    """The rows of each run up to its last start: what may be known when predictions begin."""
    runs = log.runs()
    return join([runs[k].rows(0, int(starts.row[starts.run == k].max()) + 1) for k in np.unique(starts.run)])


def cut_stretches(
    log: Log, starts: Starts, lead: int, before: int, horizon: int, session_time: float, *, past: bool = False
) -> Stretch:
    """Stretches (rows, starts) from `lead` + `before` rows before each start to `horizon` rows after it.

    Poses are known up to the start, from `before` rows on. Rows before the beginning of a run hold no command and no
    pose, those past its end repeat, time going on. session_time [s]: that of the first row of the log; runs follow
    each other. past: whether a law asks for what the commands left behind.
    """
    runs = log.runs()
    passed = session_time + np.concatenate([[0.0], np.cumsum([run.t[-1] - run.t[0] for run in runs])])
    parts = [
        _of_run(runs[k], starts.row[starts.run == k], lead, before, horizon, passed[k], past)
        for k in np.unique(starts.run)
    ]
    return jax.tree.map(lambda axis, *own: np.concatenate(own, axis), AXES, *parts)


def _of_run(run: Log, starts: Array, lead: int, before: int, horizon: int, session: float, past: bool) -> Stretch:
    """The stretches of one run."""
    rows = starts + np.arange(-lead - before, horizon + 1)[:, None]
    inside = np.clip(rows, 0, len(run.t) - 1)
    period = float(np.median(np.diff(run.t))) if len(run.t) > 1 else 1.0
    t = np.asarray(run.t)[inside] + period * (rows - inside)
    sent = np.nan_to_num(np.stack(run.command, axis=-1))
    command = np.where((rows >= 0)[..., None], sent[inside], 0.0)
    pose = np.stack(run.pose, axis=-1)[inside]
    seen = np.isfinite(pose).all(axis=-1) & (rows >= 0) & (rows <= starts) & (rows >= starts - before)
    pose = np.where(seen[..., None], pose, 0.0)
    begin = np.maximum(lead + before - starts, 0)
    whole = past_of_run(np.asarray(run.t), sent) if past else NO_PAST
    kept = inside if past else inside[:0]
    left = Past(*(np.moveaxis(part[kept], 1, -1) for part in whole))
    found = Stretch(t - t[0], session + t[0] - run.t[0], command, pose, seen, np.argmax(seen, axis=0), None, begin,
                    left)  # fmt: skip
    return found._replace(speeds=_guess(found))


def _guess(stretch: Stretch) -> np.ndarray:
    """Speeds along and in heading (2, n) by the first poses that are known; NaN where these are too few."""
    count, n = np.minimum(stretch.seen.sum(axis=0), GUESSED), np.arange(stretch.seen.shape[1])
    order = np.argsort(~stretch.seen, axis=0, kind="stable")[:GUESSED]
    rows = order[np.minimum(np.arange(GUESSED)[:, None], np.maximum(count - 1, 0)), n]  # the last known one repeats
    x, y, theta = np.moveaxis(stretch.pose[rows, n], -1, 0)
    theta = np.unwrap(theta, axis=0)
    passed = stretch.t[rows[-1], n] - stretch.t[rows[0], n]
    passed = np.where(count >= FEWEST, passed, np.nan)
    middle = theta[count // 2, n]
    along = (x[-1] - x[0]) * np.cos(middle) + (y[-1] - y[0]) * np.sin(middle)
    return np.stack([along, theta[-1] - theta[0]]) / passed

"""Whether the poses of a log say that a session begins with it. Of effects that drift a model knows when its own logs
began; where in a session another log lies, nobody may have told."""

import dataclasses

import numpy as np

from jaxident.array_types import Array
from jaxident.effects.catalogue import CATALOGUE
from jaxident.estimation.ahead.run_ahead import run_ahead
from jaxident.estimation.ahead.stretches import Starts, every
from jaxident.log import Log, run_begins
from jaxident.numerics import wrap
from jaxident.robot.model import Model

MOST = 100
"""Starts that are looked at, spread evenly. No other number was tried."""
FEWEST, CLEARLY = 8, 4.0
"""Starts that are needed, and standard errors by which the mean logarithm of their squares must be less: few starts
with large errors then tell no more than others. Of 160 logs of four robots that drift, of 10 and 27 s, none that went
on was told of, and 158 that began a session were. No others were tried."""


def drifts(model: Model) -> bool:
    """Whether a model has an effect that goes by session time."""
    return any(CATALOGUE[effect.name].timed for effect in model.effects)


def new_session(model: Model, log: Log, horizon: int, burn_in: int, begin: float) -> str | None:
    """A line where free runs over `horizon` rows miss the poses of a log clearly less if a session begins with it, and
    does not go on as at the end of the model's own logs; else None. begin: session time [s] of the first row if it
    goes on. Distance and turn count alike."""
    duration = model.provenance.duration
    if duration == 0.0 or not drifts(model):
        return None
    starts, measured = _ends(log, every(log, burn_in, horizon), horizon)
    if len(measured) < FEWEST:
        return None
    told, fresh = (_missed(model, log, starts, horizon, burn_in, time, measured) for time in (begin, begin - duration))
    if not _clearly_less(fresh, told):
        return None
    sizes = [" and ".join(f"{1e3 * size:.3g} {unit}" for size, unit in zip(np.sqrt(np.mean(missed**2, axis=0)),
             ("mm", "mrad"), strict=True)) for missed in (fresh, told)]  # fmt: skip
    return (
        f"as a session of its own this log is foretold better: {sizes[0]} root mean square after {horizon} rows, not "
        f"{sizes[1]}. It is taken to go on at session time {begin:.4g} s; --session-time {begin - duration:.4g} (from "
        "Python session_time) takes it for a new session"
    )


def _ends(log: Log, starts: Starts, horizon: int) -> tuple[Starts, np.ndarray]:
    """Starts whose free runs end at a measured pose, MOST at most, and these poses (starts, 3)."""
    ends = run_begins(log)[starts.run] + starts.row + horizon
    inside = starts.row + horizon < np.array([len(run.t) for run in log.runs()])[starts.run]
    poses = np.stack(log.pose, axis=1)
    kept = np.flatnonzero(inside)[np.isfinite(poses[ends[inside]]).all(axis=1)]
    if len(kept) > MOST:
        kept = kept[np.linspace(0, len(kept) - 1, MOST).round().astype(int)]
    return Starts(starts.run[kept], starts.row[kept]), poses[ends[kept]]


def _clearly_less(own: Array, other: Array) -> bool:
    """Whether one model misses by clearly less than another, both (starts, 2); not where one runs away."""
    with np.errstate(all="ignore"):
        scale = np.maximum(np.mean(own**2 + other**2, axis=0), 1e-300)  # data without noise may be met exactly
        less, more = (np.sum(missed**2 / scale, axis=1) + 1e-12 for missed in (own, other))
        apart = np.log(more / less)
        clear = np.mean(apart) > CLEARLY * np.std(apart, ddof=1) / np.sqrt(len(apart))
        return bool(clear and np.mean(more) > np.mean(less))


def _missed(
    model: Model, log: Log, starts: Starts, horizon: int, burn_in: int, session_time: float, measured: Array
) -> np.ndarray:
    """Distance [m] and turn [rad] (starts, 2) by which free runs miss measured poses (starts, 3)."""
    plain = dataclasses.replace(model, covariance=None, parameter_order=())
    pose = run_ahead(plain, log, starts, horizon, burn_in=burn_in, session_time=session_time).pose[:, -1]
    dx, dy, turn = (measured - pose).T
    return np.stack([np.hypot(dx, dy), wrap(turn)], axis=1)

"""What the paper's estimators see of a log: path lengths and turns between measured poses, beside the commands."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Increment, Pose, Wheels
from jaxident.log import Log, first_rows
from jaxident.robot.path_length import increment_between


class Observations(NamedTuple):
    """One entry per sample, that is per row of the log but the very first; all arrays (samples,).

    command is u_{k-1}, held during the sample; command_before u_{k-2}; 0 where the run has none. increment is
    the path length and turn since the last measured pose of the run (the sample's own where no pose is missing), 0
    where there is none. seen: a pose ends the sample. measured: a pose ends it and the run has an earlier one.
    first: the first sample of a run, whose command before is unknown. inside: the sample lies within a run, not
    across the seam of two.
    """

    command: Wheels
    command_before: Wheels
    increment: Increment
    seen: Any
    measured: Any
    first: Any
    inside: Any


def observe_log(log: Log) -> Observations:
    """Observations of a log with any number of runs, poses missing (NaN) or not; arrays (rows,) -> (rows - 1,).

    Where poses are missing the increment spans the gap: its Bezier curve joins the poses at both ends, and its turn
    is taken below half a revolution.
    """
    log = Log(*(jnp.asarray(column) for column in log))
    same_run = log.run[1:] == log.run[:-1]
    rows = jnp.arange(len(log.t))
    seen = jnp.isfinite(log.x) & jnp.isfinite(log.y) & jnp.isfinite(log.theta)
    run_start = jax.lax.cummax(jnp.where(jnp.concatenate([jnp.ones(1, bool), ~same_run]), rows, 0))
    last_seen = jax.lax.cummax(jnp.where(seen, rows, -1))[:-1]
    measured = seen[1:] & (last_seen >= run_start[1:])
    safe = Pose(*(jnp.where(seen, column, 0.0) for column in log.pose))
    before = Pose(*(column[jnp.maximum(last_seen, 0)] for column in safe))
    increment = increment_between(before, Pose(*(column[1:] for column in safe)))
    command = Wheels(*(jnp.where(same_run, u[:-1], 0.0) for u in log.command))
    return Observations(
        command=command,
        command_before=Wheels(*(jnp.concatenate([jnp.zeros_like(u[:1]), u[:-1]]) for u in command)),
        increment=Increment(*(jnp.where(measured, value, 0.0) for value in increment)),
        seen=seen[1:],
        measured=measured,
        first=rows[1:] == run_start[1:] + 1,
        inside=same_run,
    )


def complete_observations(command: Wheels, increment: Increment) -> Observations:
    """Observations (samples - 2, ...) of a single run without missing poses, from its second sample on.

    command (samples, ...), increment (samples - 1, ...) between its poses. They carry no masks, which makes the
    recursion faster; trials may follow on further axes.
    """
    now, before = (Wheels(*(u[cut] for u in command)) for cut in (slice(1, -1), slice(0, -2)))
    return Observations(now, before, Increment(*(part[1:] for part in increment)), None, None, None, None)


def repeats(log: Log) -> np.ndarray:
    """Boolean (samples,): rows whose pose equals the one before in all three numbers."""
    pose = np.stack([np.asarray(column) for column in log.pose])
    same = np.concatenate([[False], np.all(pose[:, 1:] == pose[:, :-1], axis=0)])
    return same & ~first_rows(log)


def blind(log: Log, rows: Any) -> Log:
    """The log without the poses of some rows, boolean (samples,)."""
    x, y, theta = (np.where(rows, np.nan, column) for column in log.pose)
    return log._replace(x=x, y=y, theta=theta)


def poses_only(log: Log) -> Log:
    """The log without wheel speeds."""
    return log if log.wheel_r is None else log._replace(wheel_r=None, wheel_l=None)


def tail(observations: Observations, first: int) -> Observations:
    """The samples from index `first` on."""
    return jax.tree.map(lambda column: column[first:], observations)

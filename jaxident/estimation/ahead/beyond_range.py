"""Predictions that leave the signals at which a discovered law was seen: the curve is held constant there, a guess."""

import numpy as np

from jaxident.array_types import Array
from jaxident.effects.discovered import SIGNALS
from jaxident.estimation.ahead.stretches import Starts, cut_stretches
from jaxident.log import Log
from jaxident.robot.model import Discovered, Model, require_physical

FAR = 0.1
"""By which part of its range a signal has to pass a curve's last knot. Knots end where one row in a hundred lies
beyond; no other value was tried."""


def beyond_range(model: Model, log: Log, starts: Starts, pose: Array, session_time: float) -> list[str]:
    """A line for each discovered law whose range some free runs leave; pose (starts, horizon, 3): as predicted."""
    if not model.discovered:
        return []
    found = signals(model, log, starts, pose, session_time)
    lines = []
    for law in model.discovered:
        count = int(np.sum(np.any(_outside(law, found[law.signal]), axis=0)))
        if count:
            lines.append(
                f"{count} of {len(starts.row)} free runs leave the range {law.at[0]:.3g} to {law.at[-1]:.3g} "
                f"{SIGNALS[law.signal]} of {law.signal} in which the discovered {law.acts_on} was seen: it is held "
                "constant there"
            )
    return lines


def _outside(law: Discovered, signal: Array) -> np.ndarray:
    """Where a signal (rows, starts) lies clearly beyond a law's knots; nowhere where it is NaN."""
    room = FAR * (law.at[-1] - law.at[0])
    return (signal < law.at[0] - room) | (signal > law.at[-1] + room)


def signals(model: Model, log: Log, starts: Starts, pose: Array, session_time: float) -> dict[str, np.ndarray]:
    """What curves may depend on along predicted poses (rows, starts), by name, NaN past the end of a run; both wheels'
    below each other where a law looks at each by itself. Speeds are those between two rows."""
    rows, drive = np.arange(1, pose.shape[1] + 1)[:, None], require_physical(model)
    lengths = np.array([len(run.t) for run in log.runs()])[starts.run]
    stretch = cut_stretches(log, starts, 0, 0, pose.shape[1], session_time)
    x, y, theta = np.where(starts.row + rows < lengths, np.moveaxis(pose, (2, 1), (0, 1)), np.nan)
    t, middle = stretch.t[1:], theta[:-1] + 0.5 * np.diff(theta, axis=0)
    v = (np.diff(x, axis=0) * np.cos(middle) + np.diff(y, axis=0) * np.sin(middle)) / np.diff(t, axis=0)
    w = np.diff(theta, axis=0) / np.diff(t, axis=0)
    command = np.where(np.isfinite(x)[..., None], stretch.command[1:], np.nan)
    push = np.sign(command) * np.maximum(np.abs(command) - np.asarray(model.dead_zone), 0.0)
    speeds = np.stack([drive.rate[0] * v, drive.rate[1] * w], axis=-1) @ np.linalg.pinv(np.asarray(drive.gain)).T
    return {
        "v": v, "w": w, "heading": (theta + np.pi) % (2.0 * np.pi) - np.pi, "x": x, "y": y,
        "time": stretch.session + t + 0.0 * x, "push right": push[..., 0], "push left": push[..., 1],
        "own speed": np.concatenate([speeds[..., 0], speeds[..., 1]]),
        "own push": np.concatenate([push[..., 0], push[..., 1]]),
    }  # fmt: skip

"""Predictions that leave the signals at which a discovered law was seen: the curve is held constant there, a guess."""

import numpy as np

from jaxident.array_types import Array, Wheels
from jaxident.effects.law_kinds import ANGLE, SIGNALS, directions, knots_by_signal, remembered
from jaxident.estimation.ahead.stretches import Starts, cut_stretches
from jaxident.log import Log
from jaxident.numerics import wrap
from jaxident.robot.dead_zone import effective_command
from jaxident.robot.drive import wheel_speeds
from jaxident.robot.model import Model, require_physical

FAR = 0.1
"""By which part of its range a signal has to pass a curve's last knot. Knots end where one row in a hundred lies
beyond; no other value was tried."""


def beyond_range(model: Model, log: Log, starts: Starts, pose: Array, session_time: float) -> list[str]:
    """A line for each discovered law whose range some free runs leave; pose (starts, horizon, 3): as predicted."""
    laws = [law for law in model.discovered if law.signal != ANGLE]  # a wheel's angle has no end
    if not laws:
        return []
    found = signals(model, log, starts, pose, session_time)
    lines = []
    for law in laws:
        ranges = knots_by_signal(law)
        outside = [np.any(_outside(at, found[signal]), axis=0) for signal, at in ranges.items()]
        count = int(np.sum(np.any(outside, axis=0)))
        if count:
            told = " and ".join(f"{at[0]:.3g} to {at[-1]:.3g} {SIGNALS[name]} of {name}" for name, at in ranges.items())
            lines.append(
                f"{count} of {len(starts.row)} free runs leave the range {told} in which the discovered {law.acts_on} "
                "was seen: it is held constant there"
            )
    return lines


def _outside(at: Array, signal: Array) -> np.ndarray:
    """Where a signal (rows, starts) lies clearly beyond some knots; nowhere where it is NaN."""
    room = FAR * (at[-1] - at[0])
    return (signal < at[0] - room) | (signal > at[-1] + room)


def signals(model: Model, log: Log, starts: Starts, pose: Array, session_time: float) -> dict[str, np.ndarray]:
    """What curves may depend on along predicted poses (rows, starts), by name, NaN past the end of a run; both wheels'
    below each other where a law looks at each by itself. Speeds are those between two rows."""
    rows, drive = np.arange(1, pose.shape[1] + 1)[:, None], require_physical(model)
    lengths = np.array([len(run.t) for run in log.runs()])[starts.run]
    stretch = cut_stretches(log, starts, 0, 0, pose.shape[1], session_time, past=True)
    x, y, theta = np.where(starts.row + rows < lengths, np.moveaxis(pose, (2, 1), (0, 1)), np.nan)
    t, turned = stretch.t[1:], np.asarray(wrap(np.diff(theta, axis=0)))
    middle = theta[:-1] + 0.5 * turned
    v = (np.diff(x, axis=0) * np.cos(middle) + np.diff(y, axis=0) * np.sin(middle)) / np.diff(t, axis=0)
    w = turned / np.diff(t, axis=0)
    command = np.where(np.isfinite(x), np.moveaxis(stretch.command[1:], -1, 0), np.nan)
    push = [np.asarray(wheel) for wheel in effective_command(Wheels(*command), model.dead_zone)]
    past = {name: np.asarray(part[1:]).swapaxes(0, 1) for name, part in remembered(stretch.past, axis=1).items()}
    speeds = [np.asarray(wheel) for wheel in wheel_speeds(drive, v, w)]
    return {
        "v": v, "w": w, "heading": np.asarray(wrap(theta)), "x": x, "y": y,
        "time": stretch.session + t + 0.0 * x, "push right": push[0], "push left": push[1],
        **{name: np.asarray(part[1:]) + 0.0 * x for name, part in directions(stretch.past, axis=1).items()},
        "own speed": np.concatenate(speeds), "own push": np.concatenate(push),
        **{name: np.concatenate(part + 0.0 * x) for name, part in past.items()},
    }  # fmt: skip

"""The fit behind `identify_motors`: the answer of wheel speeds to commands, with a delay, dead zones and a lag.

Rates, delay and dead zones are searched for (Gauss-Newton with damping); gains and starts follow from them by least
squares (variable projection, Golub and Pereyra 1973). NumPy alone; needs double precision.
"""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.errors import InputError
from jaxident.estimation.poses.wheel_colour import samples_each
from jaxident.estimation.suspicions.clock_offset import follow_commands
from jaxident.estimation.suspicions.wheel_answer import LONGEST
from jaxident.log import Log, run_begins

STEPS, ENOUGH = 60, 1e-9
"""Most steps of the search, and the part of the squares that a step must take away for the search to go on. No
others were tried."""
LOG_RATE, MOST_ZONE = 9.0, 0.9
"""Bounds of the search: of the logarithm of a rate [1/s] either way, and of dead zones in largest commands."""
SMALLEST = 50
"""Rows with both wheel speeds that are needed at least. No other number was tried."""


class WheelRun(NamedTuple):
    """One run: times of its commands [s] and these (n, 2), rows of the log with both wheel speeds, their times, and the
    mean and half the difference (2, rows)."""

    t: Any
    command: Any
    rows: Any
    at: Any
    speed: Any


class MotorFit(NamedTuple):
    """Log rates (2), delay and dead zones (5,); coefficients of both channels; residuals of both (2 rows,), modelled
    (2, rows)."""

    point: Any
    coefficients: tuple[Any, Any]
    residual: Any
    modelled: Any

    @property
    def squares(self) -> float:
        """The sum of squared residuals."""
        return float(self.residual @ self.residual)


def wheel_runs(log: Log) -> list[WheelRun]:
    """The runs with wheel speeds; InputError for too few of them."""
    found, count = [], 0
    for first, run in zip(run_begins(log), log.runs(), strict=True):
        both = np.stack([np.asarray(run.wheel_r, float), np.asarray(run.wheel_l, float)])
        rows = np.flatnonzero(np.isfinite(both).all(axis=0))
        t = np.asarray(run.t, float) - run.t[0]
        command = np.nan_to_num(np.stack(run.command, axis=1))
        speed = 0.5 * np.stack([both[0] + both[1], both[0] - both[1]])[:, rows]
        if len(rows) > 2 and len(t) > 2:
            found.append(WheelRun(t, command, first + rows, t[rows], speed))
            count += len(rows)
    if count < SMALLEST:
        raise InputError(f"{count} rows with both wheel speeds: at least {SMALLEST} are needed")
    for name, side in (("u_r", 0), ("u_l", 1)):
        if not any(np.any(run.command[:, side]) for run in found):
            raise InputError(f"{name} is 0 throughout: drive both wheels, at several levels")
    return found


def _columns(run: WheelRun, rate: float, delay: float, zones: Array, place: int, count: int) -> np.ndarray:
    """What the gains of both commands and the starts of `count` runs multiply, (rows, 2 + count)."""
    passed = np.sign(run.command) * np.maximum(np.abs(run.command) - zones, 0.0)
    answer = follow_commands(run.t, passed, rate, run.at - delay)[1]
    starts = np.zeros((len(run.at), count))
    starts[:, place] = np.exp(-rate * run.at)
    return np.concatenate([answer, starts], axis=1)


def _both(runs: list[WheelRun], point: Array) -> list[np.ndarray]:
    """The columns of both channels, all runs one after another."""
    return [
        np.concatenate([_columns(r, np.exp(point[c]), point[2], point[3:], k, len(runs)) for k, r in enumerate(runs)])
        for c in (0, 1)
    ]


def fitted(runs: list[WheelRun], point: Array) -> MotorFit:
    """Gains and starts by least squares at a point."""
    speed = np.concatenate([run.speed for run in runs], axis=1)
    columns = _both(runs, point)
    found = [np.linalg.lstsq(own, y, rcond=1e-10)[0] for own, y in zip(columns, speed, strict=True)]
    modelled = np.stack([own @ each for own, each in zip(columns, found, strict=True)])
    # both wheels together: r^2 + l^2 = 2 m^2 + 2 h^2
    return MotorFit(point, (found[0], found[1]), 2.0**0.5 * (speed - modelled).ravel(), modelled)


def search(runs: list[WheelRun], point: Array, largest: float, late: bool = True) -> MotorFit:
    """The best fit downhill of a point; `late`: whether a delay is looked for."""
    zone = MOST_ZONE * largest
    low, high = np.array([-LOG_RATE] * 2 + [0.0] * 3), np.array([LOG_RATE] * 2 + [LONGEST, zone, zone])
    free = [0, 1, 2, 3, 4] if late else [0, 1, 3, 4]
    now, damping = fitted(runs, np.clip(point, low, high)), 1e-3
    for _ in range(STEPS):
        slopes = _slopes(lambda point: fitted(runs, point).residual, now.point, largest)[:, free]
        own = slopes.T @ slopes
        step, size = np.zeros(5), np.diagonal(own)
        step[free] = -np.linalg.solve(own + damping * np.diag(size + 1e-12 * size.max()), slopes.T @ now.residual)
        there = fitted(runs, np.clip(now.point + step, low, high))
        if there.squares < now.squares:
            gained, now, damping = now.squares - there.squares, there, max(0.2 * damping, 1e-9)
            if gained < ENOUGH * now.squares:
                break
        elif (damping := 10.0 * damping) > 1e9:
            break
    return now


def _slopes(residual: Any, point: Array, largest: float) -> np.ndarray:
    """Derivatives (numbers, 5) of residuals by a point, by forward differences."""
    here, steps = residual(point), np.array([1e-6, 1e-6, 1e-6, 1e-6 * largest, 1e-6 * largest])
    return np.stack([(residual(point + h * e) - here) / h for h, e in zip(steps, np.eye(5), strict=True)], axis=1)


def covariance_of(runs: list[WheelRun], fit: MotorFit) -> tuple[np.ndarray, float]:
    """Covariance (9, 9) of the point and both channels' gains, wider where residuals hang together; and how many rows
    then say as much as one."""

    def residual(point: Array) -> np.ndarray:
        modelled = [own @ each for own, each in zip(_both(runs, point), fit.coefficients, strict=True)]
        return 2.0**0.5 * np.concatenate([speed - m for speed, m in zip(speeds, modelled, strict=True)])

    speeds = np.concatenate([run.speed for run in runs], axis=1)
    largest = float(max(np.max(np.abs(run.command)) for run in runs))
    own = _slopes(residual, fit.point, largest)
    columns = [-(2.0**0.5) * each for each in _both(runs, fit.point)]
    rows = len(columns[0])
    linear = np.zeros((2 * rows, 2 * columns[0].shape[1]))
    linear[:rows, : columns[0].shape[1]], linear[rows:, columns[0].shape[1] :] = columns
    slopes = np.concatenate([own, linear], axis=1)
    scale = np.linalg.norm(slopes, axis=0) + 1e-300
    inverse = np.linalg.pinv((slopes / scale).T @ (slopes / scale), rcond=1e-12, hermitian=True)
    variance = fit.squares / max(len(fit.residual) - slopes.shape[1], 1)
    cuts = np.cumsum([len(run.at) for run in runs])[:-1]
    pieces = [piece for half in fit.residual.reshape(2, -1) for piece in np.split(half, cuts)]
    every = max(samples_each(pieces), 1.0)
    kept = [*range(5), 5, 6, 5 + columns[0].shape[1], 6 + columns[0].shape[1]]
    return (variance * every * inverse / scale[:, None] / scale)[np.ix_(kept, kept)], every

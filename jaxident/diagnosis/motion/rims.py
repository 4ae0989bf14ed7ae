"""Wheel speeds of windows, the second sensor: what a model says of them, and how much they count.

The rim of a wheel runs as the robot rolls, and faster where the wheel slides. So command, actuation and drive move
both rim and robot; a slide sideways, random slip and the camera move no rim. Radius and track are free in every
window, and so is the speed of the rims at its start, which slip may have made another than the robot's. NumPy, windows
first; numbers are the rows' mean speeds of both wheels, then half their differences.
"""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array, Wheels
from jaxident.diagnosis.motion.driving import each_of, run_each
from jaxident.diagnosis.motion.paths import rolled
from jaxident.diagnosis.motion.windows import Windows
from jaxident.effects.coordinates import POSES_ONLY, of_wheels
from jaxident.effects.fast_input import Push
from jaxident.effects.law_arrays import Laws
from jaxident.estimation.poses.wheel_colour import samples_each
from jaxident.programs import kept_program

SAME = 1e-6
"""Part of a direction's length below which it is a copy of another one."""
FEWEST = 8
"""Rows with both wheel speeds that a window needs: four numbers are free in each window. No other number was tried."""
LEAST = 1e-4
"""Part of the mean wheel speed that its noise is at least: exact wheels would outweigh everything. No other value was
tried."""


class Rims(NamedTuple):
    """measured (windows, numbers) [rad/s], scale (numbers,): what modelled speeds are multiplied with to become wheel
    speeds; whitener (windows, numbers, numbers), which leaves nothing of what is free in a window;
    noise [rad/s] of a wheel speed there."""

    measured: Any
    scale: Any
    whitener: Any
    noise: float

    def residual(self, speeds: Array) -> np.ndarray:
        """Measured less modelled wheel speeds of modelled speeds (..., windows, numbers)."""
        return self.measured - self.scale * speeds

    def white(self, columns: Array) -> np.ndarray:
        """Columns of modelled speeds (windows, numbers, n), whitened."""
        return self.whitener @ (self.scale[:, None] * columns)

    def squares(self, speeds: Array) -> np.ndarray:
        """Half the squares (...,  windows) that modelled speeds leave."""
        return 0.5 * np.sum((self.whitener @ self.residual(speeds)[..., None])[..., 0] ** 2, axis=-1)


def untold(windows: Windows) -> frozenset[str]:
    """Effects that these windows never tell from others: those of the camera's clock where no wheel speed is."""
    return POSES_ONLY if windows.wheels is None else frozenset()


_rolled = kept_program(Push, Windows, Wheels, Laws)(each_of(rolled))


def rim_speeds(vectors: Array, starts: Array, windows: Windows) -> np.ndarray:
    """Speed [m/s] and turn rate [rad/s] of the rims (batch, windows, numbers) at vectors (batch, SIZE) and starts
    (batch, 5, windows)."""
    speed, turn = run_each(_rolled, of_wheels(vectors), starts, windows)
    return np.concatenate([speed, turn], axis=1).transpose(0, 2, 1)


def measured_rims(windows: Windows) -> tuple[np.ndarray, np.ndarray]:
    """Mean and half the difference of the wheel speeds (windows, numbers), and where both were measured."""
    right, left = np.moveaxis(np.asarray(windows.wheels), 2, 0)
    return np.concatenate([0.5 * (right + left).T, 0.5 * (right - left).T], axis=1), np.tile(windows.turning.T, (1, 2))


def rims_of(modelled: Any, rates: Array, noise: float | None, windows: Windows) -> Rims | None:
    """Wheel speeds of some noise [rad/s], None for that by differences, beside the rims (`linear.Linear`) of a fit with
    rates (2,); None of windows without."""
    if windows.wheels is None:
        return None
    speeds = modelled.residual
    noise = white_noise(windows) if noise is None else noise
    measured, seen = measured_rims(windows)
    rows = len(windows.step)
    parts = [(slice(0, rows), rates[0]), (slice(rows, 2 * rows), rates[1])]
    time = np.cumsum(windows.step, axis=0).T - windows.step.T
    scale, whitener = np.zeros(2 * rows), np.zeros((len(measured), 2 * rows, 2 * rows))
    shown = seen[:, :rows].sum(axis=1) >= FEWEST
    for part, rate in parts:
        own, here = speeds[:, part] * seen[:, part], seen[:, part] & shown[:, None]
        scale[part] = np.sum(own * measured[:, part]) / max(np.sum(own * own), 1e-300)
        free = _basis(np.stack([own, seen[:, part] * np.exp(-rate * time)], axis=2))
        whitener[:, part, part] = (np.eye(rows) * here[:, None] - free @ free.transpose(0, 2, 1)) * here[:, :, None]
    return Rims(measured, scale, whitener * 2.0**0.5 / noise, noise)


def _basis(columns: Array) -> np.ndarray:
    """Orthogonal unit vectors (windows, rows, n) that span columns; zero for one that is a copy."""
    left, sizes, _ = np.linalg.svd(columns / (np.linalg.norm(columns, axis=1, keepdims=True) + 1e-300), False)
    return left * (sizes > SAME)[:, None]


def white_noise(windows: Windows) -> float:
    """The noise [rad/s] of a wheel speed by third differences, which motion hardly enters. Their variance is 20 times
    the noise's (1 + 9 + 9 + 1); the median, 0.6745 deviations of a normal one, forgives switches."""
    wheels, turning = np.asarray(windows.wheels), np.asarray(windows.turning)
    whole = turning[3:] & turning[2:-1] & turning[1:-2] & turning[:-3]
    change = (wheels[3:] - 3.0 * wheels[2:-1] + 3.0 * wheels[1:-2] - wheels[:-3])[whole]
    size = np.abs(wheels[turning]).mean() if turning.any() else 1.0
    found = float(np.median(np.abs(change))) / 0.6745 / 20.0**0.5 if change.size else 0.0
    return max(found, LEAST * size)


def first_noise(modelled: Any, rates: Array, windows: Windows) -> float | None:
    """The noise [rad/s] of wheel speeds beside a first fit with rates (2,); None of windows without.

    What that fit misses counts as noise until effects explain it. By differences a Husky's wheels err by 0.2 mrad/s:
    so sure of them, a search forgot the poses and ended at gains of 1e31."""
    found = rims_of(modelled, rates, None, windows)
    return None if found is None else sized_noise(found, modelled, windows)


def sized_noise(rims: Rims, modelled: Any, windows: Windows) -> float:
    """The noise [rad/s] with which wheel speeds count beside a fit: as large as its residuals, and larger where these
    hang together (`samples_each`)."""
    before = rims.noise
    left = (rims.whitener @ rims.residual(modelled.residual)[..., None])[..., 0]
    rows = len(windows.step)
    shown = np.abs(rims.whitener).sum(axis=2) > 0.0
    free = float(np.trace(rims.whitener @ rims.whitener.transpose(0, 2, 1), axis1=1, axis2=2).sum()) * before**2 / 2.0
    power, together = float(np.sum(left**2)), samples_each(left.reshape(len(left) * 2, rows))
    size = before * np.sqrt(power / max(free, 1.0) * together) if shown.any() else before
    return max(float(size), white_noise(windows))

"""Wheel speeds whose errors hang together: how far apart they are independent, and what intervals make of it."""

import dataclasses

import jax
import numpy as np
import pytest

import jaxident as ji
from jaxident.array_types import Wheels
from jaxident.estimation.poses.wheel_colour import WHITE_WHEELS, spacing, thinned, wheel_colour
from jaxident.robot.drive import Physical
from jaxident.robot.wheel_sensor import WheelSensor
from jaxident.study.synthetic import excite, simulate_runs

ROBOT = ji.Model(0.05, Physical(np.array([3.0, 5.0]), np.array([[0.5, 0.4], [9.0, -8.5]])), np.array([0.1, 0.12]),
                 wheels=WheelSensor(0.08, 0.2, 0.1))  # fmt: skip


def remembering(rng, rho, shape):
    """Errors of variance 1 with a memory along the last axis."""
    white, found = rng.normal(size=shape), np.zeros(shape)
    found[..., 0] = white[..., 0]
    for k in range(1, shape[-1]):
        found[..., k] = rho * found[..., k - 1] + (1.0 - rho**2) ** 0.5 * white[..., k]
    return found


@pytest.mark.parametrize(("rho", "low", "high"), [(0.0, 1, 2), (0.5, 2, 5), (0.9, 13, 28)])
def test_the_spacing_is_the_memory_of_the_errors(rho, low, high):
    """(1 + rho) / (1 - rho) samples for an AR(1); rows without a sample do not count."""
    rng = np.random.default_rng(0)
    residual, seen = np.zeros((2, 2, 6000)), np.zeros((2, 6000), bool)
    seen[:, ::2] = True
    residual[..., ::2] = remembering(rng, rho, (2, 2, 3000))
    found = spacing(residual, Wheels(seen, seen))
    assert low <= found <= high
    assert (wheel_colour(residual[..., ::2], Wheels(seen[:, ::2], seen[:, ::2])) > WHITE_WHEELS) == (rho > 0.0)
    kept = thinned(_Turning(Wheels(seen, seen)), found).turning.right
    assert kept.sum() == pytest.approx(seen.sum() / found, abs=2)
    assert not np.any(kept & ~seen)


class _Turning:
    """What `thinned` asks of runs."""

    def __init__(self, turning):
        self.turning = turning

    def _replace(self, turning):
        return _Turning(turning)


def driven(seed, rho, rows=600):
    """A log whose wheel speeds err with a memory."""
    log = excite(jax.random.key(seed), "multilevel", rows, 0.05)
    exact = dataclasses.replace(ROBOT, wheels=ROBOT.wheels._replace(noise=0.0))
    log = simulate_runs(exact, log, noise=(1e-3, 5e-3), wheel_noise=0.0, key=jax.random.key(seed + 1000))
    error = 0.1 * remembering(np.random.default_rng(seed), rho, (2, rows))
    return log._replace(wheel_r=log.wheel_r + error[0], wheel_l=log.wheel_l + error[1])


@pytest.mark.slow
def test_errors_that_hang_together_widen_intervals_and_are_told():
    plain, coloured = (ji.identify(driven(3, rho), noise_law="white") for rho in (0.0, 0.9))
    assert not any("wheel speed in" in line for line in plain.suspicions)
    assert any("one wheel speed in" in line for line in coloured.suspicions)
    wide, narrow = (found.model.standard_deviation.wheels.radius for found in (coloured, plain))
    assert wide > 2.0 * narrow


@pytest.mark.slow
def test_intervals_cover_under_errors_with_a_memory():
    """60 robots, rho 0.9: 95 % intervals of radius and track, whose coverage has a standard error of 2 %. Taken for
    independent, the errors would leave them some four times too narrow."""
    held = []
    for seed in range(60):
        rows = {row.parameter: row for row in ji.identify(driven(seed, 0.9), noise_law="white").verdicts}
        truth = {"wheel_radius": 0.08, "wheel_track": 0.2}
        held += [rows[name].low <= value <= rows[name].high for name, value in truth.items()]
    assert np.mean(held) > 0.88

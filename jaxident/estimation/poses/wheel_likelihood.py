"""How likely measured wheel speeds are, and what the sensor looks like at first sight.

Residuals (2, rows), right and left, are measured less modelled wheel speeds over the sensor's noise. The modelled
speeds are those of the drive alone: random slip comes after the wheel, so it enters the poses and not these. Given the
start state of a run, both sensors then err independently of each other, and their logarithms of p add.
"""

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, RunStates, State
from jaxident.estimation.poses.parameters import Robot
from jaxident.estimation.poses.prior import WHEEL
from jaxident.estimation.poses.runs import Runs, run_axes
from jaxident.numerics import safe_divide
from jaxident.robot.dead_zone import effective_command
from jaxident.robot.drive import force, hold
from jaxident.robot.simulate import run_forces
from jaxident.robot.wheel_sensor import WheelSensor, wheel_rates

FARTHEST = 30.0
"""Factor by which a search begins at most beside the prior's middle of radius and track: wheels of 3 m are none."""


def wheel_residuals(robot: Robot, states: State, run: Runs) -> tuple[Array, Array]:
    """Normalised residuals and log variances (2, rows) of one run (rows,) along states (rows,); 0 where unseen."""
    sensor = robot.wheels
    modelled = wheel_rates(sensor, states.v, states.w)
    seen = jnp.stack(run.turning)
    error = (jnp.stack(run.wheels) - jnp.stack(modelled)) / sensor.noise
    log_variance = 2.0 * jnp.log(sensor.noise) + jnp.zeros_like(error)
    return jnp.where(seen, error, 0.0), jnp.where(seen, log_variance, 0.0)


def first_sensor(robot: Robot, starts: RunStates, runs: Runs) -> WheelSensor:
    """A first estimate of the sensor from a first estimate of the robot, with start states (runs, 5): the regressions
    of the mean wheel speed on v, and of half the difference on w."""

    def speeds(start: Array, run: Runs) -> tuple[Array, Array]:
        step = run.step if jnp.ndim(run.step) == 0 else run.step[:-1]
        pull = force(robot.drive, effective_command(run.command, jnp.stack(robot.dead_zone)))
        states = run_forces(hold(robot.drive, step), pull, State(*start))
        return states.v, states.w

    v, w = jax.vmap(speeds, in_axes=(0, run_axes(runs)))(starts, runs)
    both = runs.turning.right & runs.turning.left
    mean, half = 0.5 * (runs.wheels.right + runs.wheels.left), 0.5 * (runs.wheels.right - runs.wheels.left)
    radius = _within(safe_divide(_sum(both, v * v), _sum(both, v * mean), 0.0), WHEEL[0])
    track = _within(2.0 * radius * safe_divide(_sum(both, w * half), _sum(both, w * w), 0.0), WHEEL[1])
    modelled = wheel_rates(WheelSensor(radius, track), v, w)
    squares = sum(_sum(seen, (a - b) ** 2) for a, b, seen in zip(runs.wheels, modelled, runs.turning, strict=True))
    count = jnp.maximum(jnp.sum(jnp.stack(runs.turning)), 1)
    return WheelSensor(radius, track, jnp.sqrt(jnp.maximum(squares / count, 1e-18)))


def _sum(seen: Array, values: Array) -> Array:
    return jnp.sum(jnp.where(seen, values, 0.0))


def _within(value: Array, usual: float) -> Array:
    """A length [m] near a usual one; the usual one where it is none."""
    known = jnp.isfinite(value) & (value > 0.0)
    return jnp.where(known, jnp.clip(value, usual / FARTHEST, usual * FARTHEST), usual)

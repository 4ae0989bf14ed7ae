"""The free run of a model over a stretch of a log, and the start state that fits the poses seen there."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Pose, State, Wheels
from jaxident.effects.catalogue import to_vector
from jaxident.effects.full import run_undisturbed, substeps_for
from jaxident.numerics import wrap
from jaxident.robot.dead_zone import effective_command
from jaxident.robot.difference import Difference
from jaxident.robot.drive import force, hold
from jaxident.robot.model import Model, require_physical
from jaxident.robot.simulate import run_difference, run_forces

ITERATIONS = 8
WINDOWS_AT_ONCE = 256
SMALLEST_NOISE = 1e-9
"""Camera noise [m, rad] that noise-free logs are weighted by."""

SPEED_PRIOR = 10.0
"""Standard deviation of the start speeds before any pose is seen [m/s, rad/s]: wider than any robot meant here."""


class Window(NamedTuple):
    """A stretch of a log, rows before and after the start: times, commands, poses (rows,), and which poses count;
    session [s]: session time of its first row."""

    t: Any
    command: Wheels
    pose: Pose
    known: Any
    session: Any


def free_run(model: Model, window: Window) -> Callable[[Array], Pose]:
    """The poses of a window as a function of its first row's state (x, y, theta, v, w); effects remember nothing from
    before it, and what is random among them does not act."""
    if isinstance(model.dynamics, Difference):
        difference = model.dynamics
        return lambda start: run_difference(
            difference, model.dead_zone, window.command, State(*start), model.sample_period
        )
    drive = require_physical(model)
    if model.effects:
        parts, vector = frozenset(effect.name for effect in model.effects), to_vector(model.effects)
        return lambda start: run_undisturbed(
            drive, model.dead_zone, vector, window.t, window.command, State(*start), noise=None, key=None,
            session_time=window.session, substeps=substeps_for(parts), parts=parts,
        )  # fmt: skip
    passed = effective_command(window.command, model.dead_zone)
    solution, pull = hold(drive, jnp.diff(window.t)), force(drive, passed)
    return lambda start: run_forces(solution, pull, State(*start)).pose


class Fit(NamedTuple):
    """The state at a window's first row (5,), its covariance (5, 5), and squared residuals [m^2], [rad^2] with their
    degrees of freedom, both (2,)."""

    start: Any
    covariance: Any
    square: Any
    freedom: Any


def _fit_start(model: Model, window: Window, noise: Array) -> Fit:
    """Gauss-Newton fit of the state at the first row of `window` to its known poses.

    A prior of zero speed within SPEED_PRIOR keeps the fit solvable where fewer than two poses are known.
    """
    poses = free_run(model, window)
    known, scale = window.known, (noise[0], noise[0], noise[1])

    def residual(start):
        pose = poses(start)
        error = (pose.x - window.pose.x, pose.y - window.pose.y, wrap(pose.theta - window.pose.theta))
        parts = [jnp.where(known, e / s, 0.0) for e, s in zip(error, scale, strict=True)]
        weighted = jnp.concatenate([*parts, start[3:] / SPEED_PRIOR])
        return weighted, weighted

    def improve(_, now):
        start, _, _ = now
        slope, error = jax.jacfwd(residual, has_aux=True)(start)
        information = slope.T @ slope + 1e-12 * jnp.eye(5)
        return start - jnp.linalg.solve(information, slope.T @ error), information, error

    first = jnp.argmax(known)
    guess = jnp.stack([*(column[first] for column in window.pose), 0.0, 0.0])
    empty = jnp.zeros((5, 5)), jnp.zeros(3 * len(known) + 2)
    start, information, error = jax.lax.fori_loop(0, ITERATIONS, improve, (guess, *empty))
    by_channel = jnp.sum(error[:-2].reshape(3, -1) ** 2, axis=1)
    square = jnp.stack([(by_channel[0] + by_channel[1]) * noise[0] ** 2, by_channel[2] * noise[1] ** 2])
    freedom = jnp.maximum(jnp.array([2.0, 1.0]) * jnp.sum(known) - jnp.array([3.0, 2.0]), 0.0)
    return Fit(start, jnp.linalg.inv(information), square, freedom)


def over_windows(function: Callable, windows):
    """The function mapped over windows in blocks, which bounds the memory; the last block is filled up with copies,
    so that all have one shape."""
    count = len(jax.tree.leaves(windows)[0])
    block = min(count, WINDOWS_AT_ONCE)
    rows = jnp.arange(-(-count // block) * block) % count
    blocks = jax.tree.map(lambda leaf: leaf[rows].reshape(-1, block, *leaf.shape[1:]), windows)
    result = jax.lax.map(jax.vmap(function), blocks)
    return jax.tree.map(lambda leaf: leaf.reshape(-1, *leaf.shape[2:])[:count], result)


@jax.jit
def _fit_all(model: Model, windows: Window, noise: Array) -> Fit:
    return over_windows(lambda window: _fit_start(model, window, noise), windows)


def fit_with_noise(model: Model, windows: Window) -> Fit:
    """Fits weighted by the camera's noise: the model's, else that of the residual of equally weighted fits."""
    law = model.noise
    if law is not None and float(law.position) > 0.0 and float(law.heading) > 0.0:
        return _fit_all(model, windows, jnp.array([law.position, law.heading]))
    noise = jnp.array([1e-2, 1e-2])
    for _ in range(2):
        fit = _fit_all(model, windows, noise)
        square = jnp.sum(fit.square, axis=0) / jnp.maximum(jnp.sum(fit.freedom, axis=0), 1.0)
        noise = jnp.maximum(jnp.sqrt(square), SMALLEST_NOISE)
    return _fit_all(model, windows, noise)

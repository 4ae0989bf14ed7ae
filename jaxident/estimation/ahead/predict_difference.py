"""Free runs of a model of free numerators, which live at their sample period: the start state by a fit to the poses
before it."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array, Pose, State, Wheels
from jaxident.estimation.ahead.camera_noise import camera_noise
from jaxident.estimation.ahead.run_ahead import Ahead
from jaxident.estimation.ahead.stretches import Starts, cut_stretches, until_last_start
from jaxident.log import Log
from jaxident.numerics import wrap
from jaxident.robot.model import Model
from jaxident.robot.simulate import run_difference

ITERATIONS = 8
SPEED_PRIOR = 10.0
"""Standard deviation of the start speeds before any pose is seen [m/s, rad/s]: wider than any robot meant here."""


class _Window(NamedTuple):
    """Commands, poses (rows,) and which of them count."""

    command: Wheels
    pose: Pose
    known: Any


def run_difference_ahead(model: Model, log: Log, starts: Starts, horizon: int, burn_in: int) -> Ahead:
    """Free runs over `horizon` rows; the state at the first row of the burn-in is fitted to its poses by Gauss-Newton,
    each channel weighted by the camera's noise (the model's own, or as the log shows it)."""
    own = model.noise
    given = own is not None and float(own.position) > 0.0 and float(own.heading) > 0.0
    noise = (own.position, own.heading) if own is not None and given else camera_noise(until_last_start(log, starts))
    stretch = cut_stretches(log, starts, 0, burn_in, horizon, 0.0)
    window = _Window(
        Wheels(*np.moveaxis(stretch.command, 2, 0).transpose(0, 2, 1)),
        Pose(*np.moveaxis(stretch.pose, 2, 0).transpose(0, 2, 1)), stretch.seen.T,
    )  # fmt: skip
    pose, covariance = jax.tree.map(np.asarray, _run_all(model, window, jnp.asarray(noise)))
    later = slice(burn_in + 1, None)
    none = np.zeros_like(covariance[:, later])
    empty = np.zeros((0, *pose[:, later].shape))
    return Ahead(pose[:, later], covariance[:, later], none, empty, np.zeros(len(starts.row), bool))


@jax.jit
def _run_all(model: Model, windows: _Window, noise: Array) -> tuple[Array, Array]:
    """Poses (windows, rows, 3) and their covariances (windows, rows, 3, 3)."""

    def one(window):
        start, covariance = _fit_start(model, window, noise)
        slope = jax.jacfwd(lambda state: _poses(model, window, state))(start)
        return _poses(model, window, start), slope @ covariance @ jnp.swapaxes(slope, 1, 2)

    return jax.vmap(one)(windows)


def _poses(model: Model, window: _Window, start: Array) -> Array:
    """Poses (rows, 3) from the state of the first row (x, y, theta, v, w)."""
    state = State(*start)
    found = run_difference(model.difference, model.dead_zone, window.command, state, model.sample_period)
    return jnp.stack(found, axis=-1)


def _fit_start(model: Model, window: _Window, noise: Array) -> tuple[Array, Array]:
    """Gauss-Newton fit (5,) of the state at the first row to the known poses, and its covariance (5, 5).

    A prior of zero speed within SPEED_PRIOR keeps the fit solvable where fewer than two poses are known.
    """
    scale, measured = noise[jnp.array([0, 0, 1])], jnp.stack(window.pose, axis=-1)

    def residual(start):
        error = _poses(model, window, start) - measured
        error = error.at[:, 2].set(wrap(error[:, 2])) / scale
        weighted = jnp.concatenate([jnp.where(window.known[:, None], error, 0.0).ravel(), start[3:] / SPEED_PRIOR])
        return weighted, weighted

    def improve(_, now):
        start, _ = now
        slope, error = jax.jacfwd(residual, has_aux=True)(start)
        information = slope.T @ slope + 1e-12 * jnp.eye(5)
        return start - jnp.linalg.solve(information, slope.T @ error), information

    first = jnp.argmax(window.known)
    guess = jnp.stack([*(column[first] for column in window.pose), 0.0, 0.0])
    start, information = jax.lax.fori_loop(0, ITERATIONS, improve, (guess, jnp.zeros((5, 5))))
    return start, jnp.linalg.inv(information)

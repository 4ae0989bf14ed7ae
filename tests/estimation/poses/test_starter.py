"""The starter: its products against plain least squares, and start states of the windows."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxident.array_types import Pose, Wheels
from jaxident.estimation.poses import starter
from jaxident.estimation.poses.runs import Runs

ROWS, WINDOWS, STEP, RATE = 40, 3, 0.05, 2.0


@pytest.fixture
def windows():
    """Three windows of noise, a quarter of the poses unseen."""
    rng = np.random.default_rng(3)
    command = Wheels(*jnp.asarray(rng.uniform(-1.0, 1.0, (2, WINDOWS, ROWS))))
    pose = Pose(*jnp.asarray(rng.normal(size=(3, WINDOWS, ROWS)).cumsum(axis=2) * 0.1 + 5.0))
    return Runs(jnp.asarray(STEP), command, pose, jnp.asarray(rng.uniform(size=(WINDOWS, ROWS)) > 0.25))


@pytest.mark.parametrize("which", [0, 1], ids=["position", "heading"])
def test_products_are_those_of_what_least_squares_leaves(windows, which):
    """Residuals of every path and of the data after a regression, window by window, on start position and speed."""
    channel = jax.jit(starter.channels)(windows)[which]
    pull = jnp.asarray(np.random.default_rng(4).normal(size=(ROWS, WINDOWS, 2)))
    found = jax.jit(starter._products)(channel, windows.step, pull, jnp.asarray(RATE))
    laid = np.asarray(jax.jit(starter._lay)(jnp.asarray(RATE), windows.step, pull, channel.direction))
    expected = np.zeros((3, 3))
    for window in range(WINDOWS):
        seen = np.asarray(windows.seen[window])
        paths = laid[seen, :, window]  # (rows, coordinates, 1 + columns)
        own = np.broadcast_to(np.eye(paths.shape[1]), (len(paths), *[paths.shape[1]] * 2))
        measured = np.asarray(channel.measured)[seen, :, window, None]
        columns = np.concatenate([own, paths[..., :1], paths[..., 1:], measured], axis=-1).reshape(-1, own.shape[2] + 4)
        nuisance, kept = np.split(columns, [own.shape[2] + 1], axis=1)
        left = kept - nuisance @ np.linalg.lstsq(nuisance, kept, rcond=None)[0]
        expected += left.T @ left
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.max(expected))


def test_start_states_fit_a_coasting_robot(windows):
    """Without forces heading and position follow from the first state alone."""
    time = STEP * np.arange(ROWS)
    turned = 0.4 * (1.0 - np.exp(-RATE * time)) / RATE
    pose = Pose(
        *(jnp.tile(jnp.asarray(c), (WINDOWS, 1)) for c in (np.full(ROWS, 1.5), np.full(ROWS, -2.0), 0.3 + turned))
    )
    still = windows._replace(pose=pose, command=Wheels(*jnp.zeros((2, WINDOWS, ROWS))))
    begin = starter.Start(jnp.full(2, RATE), jnp.ones((2, 2)), jnp.zeros(2), jnp.ones(2))
    found = jax.jit(lambda runs: starter.start_states(begin, starter.channels(runs), runs))(still)
    np.testing.assert_allclose(found, np.tile([1.5, -2.0, 0.3, 0.0, 0.4], (WINDOWS, 1)), atol=1e-9)

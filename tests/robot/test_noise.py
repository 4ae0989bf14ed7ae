"""The noise law against its statistics. Bounds are multiples of the Monte-Carlo standard error; keys are fixed."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxident.array_types import AT_REST, Pose
from jaxident.robot.drive import Force, Physical, hold
from jaxident.robot.noise import Noise, UnitNoise, draw_noise, draw_white, observe, slip
from jaxident.robot.simulate import run_forces

DRAWS = 4000
KEYS = jax.random.split(jax.random.key(7), DRAWS)


def test_channels_are_independent_standard_normal():
    unit = np.stack(draw_noise(jax.random.key(0), 20_000))
    assert np.all(np.abs(unit.mean(axis=1)) < 4 / np.sqrt(20_000))
    np.testing.assert_allclose(np.cov(unit), np.eye(5), atol=4 * np.sqrt(2 / 20_000))


def test_white_error_is_the_scaled_draw():
    unit, pose = draw_noise(jax.random.key(1), 10), Pose(*jnp.arange(30.0).reshape(3, 10))
    seen = observe(pose, Noise(position=0.002, heading=0.01), unit, 0.1)
    np.testing.assert_allclose(seen.x, pose.x + 0.002 * unit.x, rtol=1e-15)
    np.testing.assert_allclose(seen.y, pose.y + 0.002 * unit.y, rtol=1e-15)
    np.testing.assert_allclose(seen.theta, pose.theta + 0.01 * unit.theta, rtol=1e-15)


@jax.jit
@functools.partial(jax.vmap, in_axes=(0, None, None))
def camera_error(key, noise, step):
    rows = len(step) + 1
    return observe(Pose(*jnp.zeros((3, rows))), noise, draw_noise(key, rows), step)


@pytest.mark.parametrize("step", [np.full(5, 0.04), np.array([0.01, 0.2, 0.03, 0.5, 0.08])], ids=["even", "uneven"])
def test_correlated_error_has_the_law_it_is_named_for(step):
    """Covariance exp(-|t_i - t_j| / tau) for every pair of rows; standard error sqrt((1 + rho^2) / draws)."""
    noise = Noise(position=1.0, heading=2.0, correlation_time=0.3)
    error = camera_error(KEYS, noise, step)
    times = np.concatenate([[0.0], np.cumsum(step)])
    expected = np.exp(-np.abs(times[:, None] - times) / 0.3)
    for channel, scale in zip(error, (1.0, 1.0, 2.0), strict=True):
        found = np.asarray(channel).T @ np.asarray(channel) / DRAWS / scale**2
        assert np.all(np.abs(found - expected) < 4.5 * np.sqrt((1 + expected**2) / DRAWS))


@pytest.mark.parametrize(
    "step",
    [np.full(4, 0.25), np.repeat([0.06, 0.03, 0.01], 10)],
    ids=["coarse", "fine and uneven"],
)
def test_slip_does_not_depend_on_how_time_is_cut(step):
    """After one second without damping the speeds have variance density^2 * 1 s; standard error sqrt(2 / draws)."""
    noise, drive = Noise(slip_along=0.3, slip_heading=2.0), Physical(jnp.zeros(2), jnp.eye(2))

    def end(key):
        pull = slip(noise, draw_noise(key, len(step)), step)
        last = run_forces(hold(drive, step), Force(*(jnp.append(p, 0.0) for p in pull)), AT_REST)
        return last.v[-1], last.w[-1]

    v, w = jax.jit(jax.vmap(end))(KEYS)
    bound = 4 * np.sqrt(2 / DRAWS)
    assert np.var(v) == pytest.approx(0.3**2, rel=bound)
    assert np.var(w) == pytest.approx(2.0**2, rel=bound)


def test_slip_of_one_step():
    unit = UnitNoise(*(jnp.full(1, value) for value in (0.0, 0.0, 0.0, 2.0, -3.0)))
    drawn = slip(Noise(slip_along=0.5, slip_heading=0.1), unit, 0.25)
    assert (float(drawn.along[0]), float(drawn.heading[0])) == pytest.approx((2.0, -0.6), rel=1e-15)


@pytest.mark.parametrize("step", [0.05, np.array([0.01, 0.2, 0.03, 0.5, 0.08, 1.0])], ids=["even", "uneven"])
def test_slip_with_a_memory_has_the_law_it_is_named_for(step):
    """Variance density^2 / (2 tau), correlation exp(-|t_i - t_j| / tau); standard error sqrt((1 + rho^2) / draws)."""
    noise, rows = Noise(slip_along=0.3, slip_heading=2.0, slip_time=0.2), 6
    found = jax.vmap(lambda key: slip(noise, draw_noise(key, rows), step))(KEYS)
    between = np.broadcast_to(step, rows) if np.ndim(step) == 0 else step
    times = np.concatenate([[0.0], np.cumsum(between[: rows - 1])])
    expected = np.exp(-np.abs(times[:, None] - times) / 0.2)
    for channel, density in zip(found, (0.3, 2.0), strict=True):
        unit = np.asarray(channel) / density * np.sqrt(2.0 * 0.2)
        assert np.all(np.abs(unit.T @ unit / DRAWS - expected) < 4.5 * np.sqrt((1 + expected**2) / DRAWS))


def test_a_white_part_stands_beside_the_memory():
    """Variance of the whole, covariance of the part with a memory."""
    noise = Noise(position=1.0, heading=2.0, correlation_time=0.3, white_position=0.6, white_heading=1.6)

    def error(key):
        white = draw_white(noise, key, 5)
        return observe(Pose(*jnp.zeros((3, 5))), noise, draw_noise(key, 5), 0.1, white)

    found = jax.vmap(error)(KEYS)
    kept = np.exp(-0.1 * np.abs(np.arange(5)[:, None] - np.arange(5)) / 0.3)
    for channel, whole, white in zip(found, (1.0, 1.0, 2.0), (0.6, 0.6, 1.6), strict=True):
        expected = (whole**2 - white**2) * kept + white**2 * np.eye(5)
        covariance = np.asarray(channel).T @ np.asarray(channel) / DRAWS
        assert np.all(np.abs(covariance - expected) < 6.0 * whole**2 / np.sqrt(DRAWS))
    assert draw_white(Noise(1.0, 2.0, 0.3), KEYS[0], 5) is None

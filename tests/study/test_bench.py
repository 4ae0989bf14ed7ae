"""The bench measures what it says: real trials, and figures of every stage."""

import jax
import numpy as np
import pytest

from jaxident.files.models import load_model
from jaxident.robot.model import difference_vector
from jaxident.study import bench

ROBOT = load_model("published")


@pytest.fixture
def small(monkeypatch):
    for name, value in {
        "TRIALS": 4,
        "SAMPLES": 240,
        "BLOCK": 2,
        "REPEATS": 1,
        "STEPS": 3,
        "TRIAL_SAMPLES": 260,
    }.items():
        monkeypatch.setattr(bench, name, value)
    for name, value in {"TRIAL_BLOCK": 2, "FITS": 2, "FIT_SAMPLES": 240, "FIT_BLOCK": 1, "FIT_REPEATS": 1}.items():
        monkeypatch.setattr(bench, name, value)


@pytest.mark.slow
def test_whole_trials_end_near_the_robot(small):
    estimate, ok = jax.jit(jax.vmap(lambda key: bench.trial(ROBOT, key)))(jax.random.split(jax.random.key(0), 2))
    assert np.all(ok)
    truth = np.broadcast_to(difference_vector(ROBOT.difference, ROBOT.dead_zone), (2, 12))
    np.testing.assert_allclose(estimate[:, :2], truth[:, :2], rtol=0.02)
    np.testing.assert_allclose(estimate[:, 10:], truth[:, 10:], atol=0.05)


def test_every_stage_has_a_figure(small):
    figures = bench.stages(ROBOT, jax.random.key(0))
    assert set(figures) == {"simulate_ns", "path_length_ns", "rls_ns", "noise_ns"}
    assert all(0.0 < value < np.inf for value in figures.values())


@pytest.mark.slow
def test_the_searches_and_a_step_have_figures(small):
    assert 0.0 < bench.start_value_ms(ROBOT, jax.random.key(0), 4) < np.inf
    assert 0.0 < bench.step_us(ROBOT, jax.random.key(0)) < np.inf
    assert 0.0 < bench.maximum_likelihood_ms(ROBOT, jax.random.key(0)) < np.inf

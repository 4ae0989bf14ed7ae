"""The bench measures what it says: real trials, and figures of every stage."""

import jax
import numpy as np
import pytest

from jaxident import parallel
from jaxident.files.models import load_model
from jaxident.robot.model import difference_vector
from jaxident.study import bench

ROBOT = load_model("published")


SMALL = bench.Sizes(trials=4, block=2, trial_block=2, fits=2, fit_block=1)


@pytest.fixture
def small(monkeypatch):
    for name, value in {"SAMPLES": 240, "REPEATS": 1, "STEPS": 3, "TRIAL_SAMPLES": 260, "FIT_SAMPLES": 240,
                        "FIT_REPEATS": 1}.items():  # fmt: skip
        monkeypatch.setattr(bench, name, value)


@pytest.mark.slow
def test_whole_trials_end_near_the_robot(small):
    estimate, ok = jax.jit(jax.vmap(lambda key: bench.trial(ROBOT, key)))(jax.random.split(jax.random.key(0), 2))
    assert np.all(ok)
    truth = np.broadcast_to(difference_vector(ROBOT.difference, ROBOT.dead_zone), (2, 12))
    np.testing.assert_allclose(estimate[:, :2], truth[:, :2], rtol=0.02)
    np.testing.assert_allclose(estimate[:, 10:], truth[:, 10:], atol=0.05)


def test_every_stage_has_a_figure(small):
    figures = bench.stages(ROBOT, jax.random.key(0), SMALL)
    assert set(figures) == {"simulate_ns", "path_length_ns", "rls_ns", "noise_ns"}
    assert all(0.0 < value < np.inf for value in figures.values())


@pytest.mark.slow
def test_the_searches_and_a_step_have_figures(small):
    assert 0.0 < bench.start_value_ms(ROBOT, jax.random.key(0), 4, 2) < np.inf
    assert 0.0 < bench.step_us(ROBOT, jax.random.key(0)) < np.inf
    assert 0.0 < bench.maximum_likelihood_ms(ROBOT, jax.random.key(0), 2, 1) < np.inf


def test_parts_of_a_whole_trial_add_up_to_it():
    figures = bench.Bench(10.0, 5.0, 40.0, 20.0, 2000.0, 0.2, 30.0, 8.0, 5.0, {}, [], {})
    share = bench.parts(figures)
    assert share["rls_ns"] == pytest.approx(40e-9 * 1000 * 2000)
    assert share["initialise_ms"] == pytest.approx(0.4)
    assert sum(share.values()) == pytest.approx(1.0)


def test_a_card_gets_as_many_trials_as_its_memory_holds(monkeypatch):
    assert bench.device_sizes() == bench.ON_CPU
    for module in (bench, parallel):
        monkeypatch.setattr(module, "card_memory", lambda: 8 << 30)
    sizes = bench.device_sizes()
    assert sizes.block * bench.ROW_BYTES * bench.SAMPLES <= 4 << 30
    assert bench.ON_CPU.trial_block < sizes.trial_block < bench.LARGEST
    assert sizes.trials % sizes.block == sizes.fits % sizes.fit_block == 0

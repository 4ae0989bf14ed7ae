"""The paper's experiment in small: the table, ageing, and the noise study against single trials."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxident.files.models import load_model
from jaxident.study import reproduction
from jaxident.study.reproduction import drift_study, noise_study, paper_log

ROBOT = load_model("published")


@pytest.fixture(scope="module")
def log():
    return paper_log(ROBOT, jax.random.key(0))


@pytest.mark.slow
def test_noise_study_repeats_and_grows_with_the_noise(log, monkeypatch):
    monkeypatch.setattr(reproduction, "BLOCK", 4)
    arrays = jax.tree.map(lambda column: jnp.asarray(column[:600]), log)
    study = jax.tree.map(np.asarray, noise_study(arrays, jax.random.key(1), jnp.array([1e-6, 1e-4]), 8))
    assert study.estimates.shape == (2, 8, 2, 12)
    assert np.all(study.ok)
    deviation = np.std(study.estimates, axis=1)
    assert np.all(deviation[1, :, :2] > 10.0 * deviation[0, :, :2])


@pytest.mark.slow
def test_ageing_is_followed(log):
    """With a memory of 100 samples the lag behind a ramp is 100 / 2000 of it: 1 % of the gain, 0.005 of the width."""
    gain, width = drift_study(ROBOT, log)
    late = slice(-500, None)
    assert np.max(np.abs(gain.estimate / gain.truth - 1.0)[late]) < 0.05
    assert np.max(np.abs(width.estimate - width.truth)[late]) < 0.015

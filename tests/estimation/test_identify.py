"""From logs to a model: recovery, several runs, missing poses, settings, and the pure part under vmap."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxident.errors import InputError
from jaxident.estimation.identify import identify
from jaxident.estimation.identify_recursive import identify_recursively
from jaxident.files.models import load_model
from jaxident.log import Log
from jaxident.robot.model import difference_vector
from jaxident.robot.noise import Noise, draw_noise, observe
from jaxident.robot.simulate import simulate
from jaxident.study.synthetic import excite

ROBOT = load_model("published-simplified")
TRUTH = np.asarray(difference_vector(ROBOT.difference, ROBOT.dead_zone))
ROWS, SETUP = 600, 200


def made(seed, name="staircase", noise=None):
    """A log of the simplified robot; noise [m] is the camera's, ten times as many radians."""
    log = simulate(ROBOT, excite(jax.random.key(seed), name, ROWS, ROBOT.sample_period, hold=5))
    if noise:
        unit = draw_noise(jax.random.key(100 + seed), ROWS)
        pose = observe(log.pose, Noise(noise, 10.0 * noise), unit, ROBOT.sample_period)
        log = log._replace(x=pose.x, y=pose.y, theta=pose.theta)
    return Log(*(np.asarray(column) for column in log))


def vector(found):
    return np.asarray(difference_vector(found.model.difference, found.model.dead_zone))


@pytest.fixture(scope="module")
def log():
    return made(0)


def test_noise_free_data_are_recovered(log):
    found = identify(log, "paper")
    assert found.ok
    np.testing.assert_allclose(vector(found), TRUTH, rtol=1e-3)


@pytest.mark.parametrize("reading", ["one_step", pytest.param("free_run", marks=pytest.mark.slow)])
def test_several_logs_are_runs_and_poses_may_be_missing(reading):
    """Two runs as long together as the one before: the same program."""
    first, second = (made(seed)[: ROWS // 2] for seed in (1, 2))
    x = first.x.copy()
    x[50:250:7] = np.nan
    gaps = first._replace(
        x=x, y=np.where(np.isnan(x), np.nan, first.y), theta=np.where(np.isnan(x), np.nan, first.theta)
    )
    found = identify([gaps, second], "paper", reading=reading)
    assert found.ok
    np.testing.assert_allclose(vector(found), TRUTH, rtol=1e-3)


def test_covariance_is_symmetric_and_tells_every_deviation():
    found = identify(made(3, noise=1e-5), "paper")
    assert found.covariance.shape == (12, 12)
    np.testing.assert_allclose(found.covariance, np.asarray(found.covariance).T, rtol=1e-9)
    spread = found.model.standard_deviation
    deviations = np.concatenate(
        [np.ravel(part) for part in (spread.alpha, spread.delta, spread.epsilon, spread.dead_zone)]
    )
    np.testing.assert_allclose(deviations**2, np.diag(found.covariance), rtol=1e-9)
    assert np.all(deviations > 0.0)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"method": "magic"}, "method 'magic'"),
        ({"forgetting": 0.0}, "forgetting 0"),
        ({"forgetting": 1.5}, "forgetting 1.5"),
        ({"d_max": 2.0}, "d-max 2"),
        ({"d_max": 0.0}, "d-max 0"),
        ({"setup_time": 0.1}, "setup time 0.1 s"),
        ({"reading": "both"}, "reading 'both'"),
        ({"coupling": True}, "coupling"),
    ],
)
def test_wrong_settings_are_named(log, settings, words):
    with pytest.raises(InputError, match=words):
        identify(log, **{"method": "paper", **settings})


def test_logs_that_cannot_be_identified_say_why(log):
    still = log._replace(x=0.0 * log.x, y=0.0 * log.y, theta=0.0 * log.theta)
    for bad, words in (
        (log.rows(0, 15), "15 rows"),
        (still, "nothing moves"),
        (log._replace(u_r=0.0 * log.u_r + 1.0, u_l=0.0 * log.u_l + 1.0), "no excitation"),
        (log._replace(t=log.t + 0.01 * (np.arange(ROWS) > 200)), "uneven"),
    ):
        with pytest.raises(InputError, match=words):
            identify(bad, "paper")


@pytest.mark.slow  # in the usual tests a trial alone is compared with the same one in a batch, by both methods (study)
def test_batches_over_seeds_and_excitations_are_the_loop_compiled_once():
    logs = [
        made(seed, name, 1e-5)
        for seed, name in ((0, "staircase"), (1, "staircase"), (2, "multilevel"), (3, "multisine"))
    ]
    batch = Log(*(jnp.stack([jnp.asarray(column) for column in columns]) for columns in zip(*logs, strict=True)))

    def one(log, d_max=0.9, forgetting=1.0):
        estimate, setup, _, _, covariance = identify_recursively(log, SETUP, d_max, forgetting, "one_step")
        return estimate, setup.cost, covariance

    together = jax.jit(jax.vmap(one))(batch)
    before = identify_recursively._cache_size()
    for k, log in enumerate(logs):
        alone = one(Log(*(jnp.asarray(column) for column in log)))
        for a, b in zip(jax.tree.leaves(alone), jax.tree.leaves(together), strict=True):
            np.testing.assert_allclose(a, b[k], rtol=1e-6, atol=1e-9 * np.max(np.abs(b)))
    one(Log(*(jnp.asarray(column) for column in logs[0])), 0.8, 0.99)
    assert identify_recursively._cache_size() == before + 1

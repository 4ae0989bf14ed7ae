"""The yardsticks: exact on exact data, what each makes of camera noise, batches, refusals."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxident.array_types import AT_REST, Increment, State, Wheels
from jaxident.errors import InputError
from jaxident.estimation.identify import identify
from jaxident.estimation.increments.instrumental import fit_instrumental
from jaxident.estimation.increments.key_term_fit import fit_key_terms, solve_instrumental
from jaxident.estimation.increments.observations import complete_observations
from jaxident.log import make_log
from jaxident.robot.difference import Difference
from jaxident.robot.excitation import EXCITATIONS
from jaxident.robot.model import difference_vector
from jaxident.robot.path_length import path_length
from jaxident.robot.simulate import run_difference

PERIOD, D_MAX = 1.0 / 30.0, 0.9
DIFFERENCE = Difference(
    np.array([0.9821, 0.7706]),
    np.array([[7.1181e-5, 7.0344e-5], [0.0341, -0.0333]]),
    np.array([[-7.0697e-5, -6.9978e-5], [-0.0313, 0.0305]]),
)
DEAD_ZONE = np.array([0.25, 0.2])
TRUTH = np.asarray(difference_vector(DIFFERENCE, DEAD_ZONE))
FITS = {"key-term-least-squares": fit_key_terms, "instrumental-variables": fit_instrumental}


def moved(key, noise=0.0, rows=400, start=AT_REST, name="multilevel"):
    """Commands and poses of the paper's robot; noise in m, ten times as much in rad."""
    command = EXCITATIONS[name](key, rows, hold=10)
    pose = run_difference(DIFFERENCE, DEAD_ZONE, command, start, PERIOD)
    unit = jax.random.normal(jax.random.fold_in(key, 1), (3, rows))
    return command, type(pose)(*(p + s * u for p, s, u in zip(pose, (noise, noise, 10.0 * noise), unit, strict=True)))


def logged(seed, **settings):
    command, pose = moved(jax.random.key(seed), **settings)
    return make_log(PERIOD * np.arange(len(pose.x)), *map(np.asarray, (*command, *pose)))


@pytest.mark.parametrize("method", FITS)
@pytest.mark.parametrize("name", ["multilevel", "staircase"])
def test_exact_data_are_recovered(method, name):
    """Numerators of the path length are 7e-5 m a sample against 5e-3 m of motion: seven digits of the twelve lost."""
    found = identify(logged(0, start=State(0.1, -0.2, 3.0, 0.05, 0.4), name=name), method)
    assert found.ok
    np.testing.assert_allclose(difference_vector(found.model.difference, found.model.dead_zone), TRUTH, rtol=1e-7)
    assert np.nanmax(np.abs(found.residuals.turn)) < 1e-10


def test_key_terms_take_several_runs_and_gaps():
    first, second = logged(1, rows=300), logged(2, rows=300)
    blind = np.arange(300) % 17 == 5
    first = first._replace(**{name: np.where(blind, np.nan, getattr(first, name)) for name in ("x", "y", "theta")})
    found = identify([first, second], "key-term-least-squares")
    np.testing.assert_allclose(difference_vector(found.model.difference, found.model.dead_zone), TRUTH, rtol=1e-7)
    for logs in ([first], [second, second]):
        with pytest.raises(InputError, match="instrumental-variables"):
            identify(logs, "instrumental-variables")


def test_settings_of_other_methods_are_refused():
    for settings, words in (({"coupling": True}, "coupling"), ({"forgetting": 0.9}, "forgetting")):
        with pytest.raises(InputError, match=words):
            identify(logged(0), "instrumental-variables", **settings)


@pytest.mark.slow
@pytest.mark.parametrize("method", FITS)
def test_batch_is_the_loop(method):
    keys = jax.random.split(jax.random.key(4), 3)
    command, pose = jax.vmap(lambda key: moved(key, 1e-5))(keys)
    observations = jax.vmap(lambda u, p: complete_observations(u, path_length(p)))(command, pose)
    one = jax.jit(lambda o: FITS[method](o, d_max=D_MAX).estimate)
    together = jax.jit(jax.vmap(one))(observations)
    for k in range(3):
        alone = one(jax.tree.map(lambda leaf, k=k: leaf[k], observations))
        np.testing.assert_allclose(together[k], alone, rtol=1e-6)


@pytest.mark.slow
def test_instruments_stand_the_noise_that_biases_least_squares():
    """0.5 mm and 5 mrad, 24 seeds of 1000 rows: least squares loses the slow pole, instruments keep the heading's
    equation within what they claim. A ratio of squares of 24 trials, correlated parameters, lies below 1.5^2."""
    keys = jax.random.split(jax.random.key(5), 24)
    command, pose = jax.vmap(lambda key: moved(key, 5e-4, 1000))(keys)
    observations = jax.vmap(lambda u, p: complete_observations(u, path_length(p)))(command, pose)
    biased, right = (jax.jit(jax.vmap(lambda o, f=f: f(o, d_max=D_MAX)))(observations) for f in FITS.values())
    assert np.asarray(right.ok).all()
    error = np.asarray(right.estimate) - TRUTH
    claimed = np.sqrt(np.asarray(jax.vmap(jnp.diagonal)(right.covariance)))
    heading = [1, 4, 5, 8, 9, 10, 11]
    assert np.sqrt(np.mean((error / claimed)[:, heading] ** 2)) < 1.5
    assert np.abs(np.mean(error[:, 0])) < 5e-3
    assert np.mean(np.asarray(biased.estimate)[:, 0]) < 0.9


def test_a_robot_that_does_not_move_gives_no_estimate():
    still = Increment(jnp.zeros(99), jnp.zeros(99))
    for fit in FITS.values():
        assert not fit(complete_observations(Wheels(jnp.zeros(100), jnp.zeros(100)), still), d_max=D_MAX).ok


def test_instruments_equal_to_columns_are_least_squares():
    rng = np.random.default_rng(6)
    columns, target = rng.normal(size=(4, 50)), rng.normal(size=50)
    weights, spread = solve_instrumental(jnp.asarray(columns), jnp.asarray(columns), jnp.asarray(target))
    expected, squares, *_ = np.linalg.lstsq(columns.T, target)
    np.testing.assert_allclose(weights, expected, rtol=1e-10)
    np.testing.assert_allclose(spread, squares[0] / 46 * np.linalg.inv(columns @ columns.T), rtol=1e-8)

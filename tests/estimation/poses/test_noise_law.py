"""The choice of a noise law: programs that serve laws with fewer terms give the fits of these laws' own programs."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support.diagonal_robot import logged

from jaxident.estimation.poses.maximum_likelihood import fit_runs
from jaxident.estimation.poses.noise_law import NOISE_LAWS, fit_law
from jaxident.estimation.poses.parameters import names
from jaxident.estimation.poses.runs import stack_runs, with_room
from jaxident.estimation.poses.stepwise import _look
from jaxident.estimation.uncertainty.precision import natural_values
from jaxident.log import join
from jaxident.robot.noise import Noise

D_MAX = jnp.asarray(0.9)


def runs_with(noise, count):
    return jax.tree.map(jnp.asarray, with_room(stack_runs(join([logged(k, noise, rows=190) for k in range(count)]))))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["white", "slip", "slip-ar1"])
def test_a_fit_step_by_step_is_that_of_the_laws_own_program(name):
    """Searches end within 4e-4 standard deviations of the optimum."""
    slip, time = 0.0 if name == "white" else 0.02, 0.2 if name == "slip-ar1" else None
    runs = runs_with(Noise(5e-4, 5e-3, time, slip, 5.0 * slip), 3)
    found, law = fit_law(runs, D_MAX, name, coupling=True)
    own = fit_runs(runs, D_MAX, NOISE_LAWS[name]._replace(coupling=True))
    assert law == NOISE_LAWS[name]._replace(coupling=True)
    assert bool(found.ok)
    assert found.covariance.shape == (len(names(law)),) * 2
    assert (found.robot.noise.correlation_time is None) == (not law.memory)
    deviation = np.sqrt(np.diagonal(own.covariance))
    apart = natural_values(found.robot, law) - natural_values(own.robot, law)
    assert np.all(np.abs(apart) < 1e-3 * deviation)
    assert np.all(np.abs(found.covariance - own.covariance) < 1e-3 * np.outer(deviation, deviation))
    np.testing.assert_allclose(found.prior_share, own.prior_share, rtol=1e-2, atol=1e-6)
    assert float(found.log_likelihood) == pytest.approx(float(own.log_likelihood), abs=1e-6)


@pytest.mark.slow
def test_two_programs_of_the_likelihood_serve_all_laws():
    runs, before = runs_with(Noise(5e-4, 5e-3), 2), _look._cache_size()
    for name in NOISE_LAWS:
        fit_law(runs, D_MAX, name, coupling=True)
    assert _look._cache_size() == before + 2

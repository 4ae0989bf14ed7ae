"""The start values against the truth, against plain recursion, and against SciPy's Nelder-Mead."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support.nelder_mead import COSTS, nelder_mead
from support.records import random_log

from jaxident.errors import InputError
from jaxident.estimation.increments.initialise import initialise
from jaxident.estimation.increments.input_forms import NAMES as READINGS
from jaxident.estimation.increments.observations import observe_log
from jaxident.log import Log, make_log
from jaxident.robot.difference import Difference
from jaxident.robot.excitation import prbs, staircase
from jaxident.robot.model import Model, difference_vector
from jaxident.robot.simulate import simulate

PERIOD = 1 / 30
ROWS = 200
D_MAX = 0.5
ROBOT = Difference(
    jnp.array([0.9821, 0.7706]),
    jnp.array([[7.1181e-5, 7.0344e-5], [0.0341, -0.0333]]),
    jnp.array([[-7.0697e-5, -6.9978e-5], [-0.0313, 0.0305]]),
)


def arrays(log):
    return Log(*(jnp.asarray(column) for column in log))


def fit(reading):
    """Observations and start values of a batch of logs, compiled once per shape."""

    def one(log):
        observations = observe_log(log)
        return observations, initialise(observations, d_max=D_MAX, reading=reading)

    return jax.jit(jax.vmap(one))


@pytest.fixture(
    scope="module", params=[pytest.param(name, marks=[pytest.mark.slow] * (name == "free_run")) for name in READINGS]
)
def reading(request):
    return request.param, fit(request.param)


def batch(logs):
    return arrays(Log(*(np.stack(columns) for columns in zip(*logs, strict=True))))


def vector(setup):
    return np.asarray(difference_vector(setup.difference, setup.dead_zone))


def compare_with_nelder_mead(name, run, seeds, evaluations):
    """Relative excess of our cost over Nelder-Mead's from the linear fit without dead zones, one per record."""
    observations, setups = jax.tree.map(np.asarray, run(batch([random_log(seed, ROWS)[0] for seed in seeds])))
    excess = []
    for k in range(len(seeds)):
        one = jax.tree.map(lambda column, k=k: column[k], observations)
        ours = jax.tree.map(lambda column, k=k: column[k], setups)
        cost = COSTS[name](one, ours.weight, D_MAX)
        np.testing.assert_allclose(cost(vector(ours)), ours.cost, rtol=1e-6, atol=1e-6)
        theirs, _ = nelder_mead(cost, linear_start(one), evaluations)
        excess.append((ours.cost - theirs) / max(theirs, 1e-6))
    assert np.all(setups.ok)
    return np.array(excess)


def linear_start(observations):
    """(19)-(20) by least squares on the samples with a measured past, dead zones 0."""
    use = np.flatnonzero(observations.measured[1:] & observations.measured[:-1] & ~observations.first[1:]) + 1
    inputs = np.stack([*observations.command, *observations.command_before])[:, use]
    rows = []
    for y in observations.increment:
        rows.append(np.linalg.lstsq(np.vstack([y[use - 1], inputs]).T, y[use], rcond=None)[0])
    table = np.array(rows)
    return np.concatenate(
        [np.clip(table[:, 0], -0.99, 0.999), table[:, 1:3].ravel(), -table[:, 3:].ravel(), [0.0, 0.0]]
    )


@pytest.mark.slow
def test_never_above_nelder_mead(reading):
    name, run = reading
    assert compare_with_nelder_mead(name, run, range(8), 1500).max() < 1e-6


@pytest.mark.slow
def test_never_above_nelder_mead_on_a_thousand_records(reading):
    name, run = reading
    excess = np.concatenate([compare_with_nelder_mead(name, run, range(k, k + 40), 4000) for k in range(0, 1000, 40)])
    print(f"{name}: worst {excess.max():.2e}, above 1e-6 in {np.count_nonzero(excess > 1e-6)} of {excess.size}")
    assert excess.max() < 1e-6


def test_noise_free_data_are_recovered(reading):
    _, run = reading
    command = staircase(jax.random.key(1), ROWS, 1.0, 5)
    log = simulate(Model(PERIOD, ROBOT, jnp.array([0.25, 0.2])), make_log(PERIOD * np.arange(ROWS), *command))
    _, setups = run(batch([Log(*(np.asarray(c) for c in log))] * 8))
    found = vector(jax.tree.map(lambda column: column[0], setups))
    np.testing.assert_allclose(found, difference_vector(ROBOT, jnp.array([0.25, 0.2])), rtol=1e-6)


def test_corners_stay_finite_and_are_flagged(reading):
    """Nothing moves; two levels, which show no dead zone; no dead zone at all."""
    _, run = reading
    times = PERIOD * np.arange(ROWS)
    still = make_log(times, *(np.zeros(ROWS) for _ in range(5)))
    command = prbs(jax.random.key(0), ROWS, 1.0, 7)
    two = simulate(Model(PERIOD, ROBOT, jnp.array([0.25, 0.2])), make_log(times, *command))
    none = simulate(Model(PERIOD, ROBOT, jnp.zeros(2)), make_log(times, *staircase(jax.random.key(2), ROWS)))
    logs = [Log(*(np.asarray(c) for c in log)) for log in (still, two, none)]
    _, setups = jax.tree.map(np.asarray, run(batch([*logs, *[logs[2]] * 5])))
    for leaf in jax.tree.leaves(setups):
        assert np.all(np.isfinite(leaf))
    np.testing.assert_allclose(setups.dead_zone[2], 0.0, atol=1e-6)
    np.testing.assert_allclose(setups.difference.delta[2], ROBOT.delta, rtol=1e-5)


def test_unknown_reading_is_refused():
    log = arrays(make_log(np.arange(30.0), *(np.zeros(30) for _ in range(5))))
    with pytest.raises(InputError, match="reading 'both': one of free_run, one_step"):
        jax.eval_shape(lambda log: initialise(observe_log(log), d_max=D_MAX, reading="both"), log)

"""The filter's likelihood against a dense Gaussian in NumPy, and against the fit without slip."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxident.array_types import Pose, State, Wheels
from jaxident.estimation.poses.filter import filter_run
from jaxident.estimation.poses.likelihood import Innovations, innovations, negative_log_likelihood
from jaxident.estimation.poses.parameters import Law, Robot, to_vector
from jaxident.estimation.poses.runs import Runs
from jaxident.robot.drive import Force, Physical, hold
from jaxident.robot.noise import Noise

ROWS, STEP = 12, 0.05
DRIVE = Physical(jnp.array([0.8, 5.0]), jnp.array([[0.3, 0.2], [4.0, -3.0]]))
START = State(0.1, -0.2, 0.0, 0.3, 0.0)


def straight_run(memory):
    """A run along x with poses drawn anyhow; slip along only, so that x and v are exactly linear."""
    rng = np.random.default_rng(0)
    pose = Pose(0.1 + 0.01 * rng.normal(size=ROWS), -0.2 + 0.01 * rng.normal(size=ROWS), 0.02 * rng.normal(size=ROWS))
    seen = np.arange(ROWS) % 5 != 2
    noise = (0.01, 0.02, memory, 0.5, 0.0)
    return Runs(jnp.asarray(STEP), None, Pose(*map(jnp.asarray, pose)), jnp.asarray(seen)), noise


@pytest.mark.parametrize("memory", [None, 0.1])
def test_likelihood_is_that_of_a_dense_gaussian(memory):
    run, numbers = straight_run(memory)
    noise = Noise(*(None if n is None else jnp.asarray(n) for n in numbers))
    pull = Force(jnp.full(ROWS, 0.7), jnp.zeros(ROWS))
    found = Innovations(*filter_run(hold(DRIVE, jnp.asarray(STEP)), pull, State(*map(jnp.asarray, START)), noise, run))

    decay = np.exp(-0.8 * STEP)
    once = (1.0 - decay) / 0.8
    twice = (STEP - once) / 0.8
    step, entry = np.array([[1.0, once], [0.0, decay]]), np.array([twice, once])
    mean, slip = np.zeros((ROWS, 2)), np.zeros((ROWS, 2, ROWS))
    mean[0] = START.x, START.v
    for k in range(1, ROWS):
        mean[k] = step @ mean[k - 1] + entry * 0.7
        slip[k] = step @ slip[k - 1]
        slip[k, :, k - 1] += entry * 0.5 / np.sqrt(STEP)
    time = STEP * np.arange(ROWS)
    apart = np.abs(time[:, None] - time)
    camera = np.eye(ROWS) if memory is None else np.exp(-apart / memory)
    seen = np.asarray(run.seen)
    total = 0.0
    for error, covariance in (
        (run.pose.x - mean[:, 0], slip[:, 0] @ slip[:, 0].T + 0.01**2 * camera),
        (run.pose.y - START.y, 0.01**2 * camera),
        (run.pose.theta, 0.02**2 * camera),
    ):
        part, own = np.asarray(error)[seen], covariance[np.ix_(seen, seen)]
        total += 0.5 * (part @ np.linalg.solve(own, part) + np.linalg.slogdet(own)[1])
    assert float(negative_log_likelihood(found)) == pytest.approx(total, rel=1e-9)


@pytest.mark.parametrize("memory", [False, True])
def test_without_slip_the_filter_is_the_plain_fit(memory):
    run, _ = straight_run(None)
    rng = np.random.default_rng(1)
    run = run._replace(command=Wheels(*(jnp.asarray(u) for u in rng.uniform(-1.0, 1.0, (2, ROWS)))))
    robot = Robot(DRIVE, (0.1, 0.2), Noise(0.01, 0.02, 0.1, 0.0, 0.0))
    values = []
    for slip in (False, True):
        law = Law(memory=memory, slip=slip)
        values.append(float(negative_log_likelihood(innovations(to_vector(robot, law), jnp.array(START), run, law))))
    assert values[0] == pytest.approx(values[1], rel=1e-6)

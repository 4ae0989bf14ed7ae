"""What the estimators see of a log, against hand-made logs and a slow loop."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxident.array_types import Pose
from jaxident.estimation.increments.observations import observe_log
from jaxident.log import Log, make_log
from jaxident.robot.path_length import increment_between

ROWS = 40
observe = jax.jit(observe_log)
between = jax.jit(increment_between)


def straight_log(seen, run=None):
    """Rows 0, 1, 2, ... along x, one metre and 0.1 rad a row; commands k and -k; poses only where `seen`."""
    k = np.arange(float(len(seen)))
    blind = np.where(np.asarray(seen, bool), 0.0, np.nan)
    return make_log(0.1 * k, k, -k, k + blind, blind, 0.0 * k + blind, run)


def test_complete_run():
    log = straight_log([1, 1, 1, 1])
    seen = observe(log)
    np.testing.assert_array_equal(seen.command.right, [0, 1, 2])
    np.testing.assert_array_equal(seen.command.left, [0, -1, -2])
    np.testing.assert_array_equal(seen.command_before.right, [0, 0, 1])
    np.testing.assert_allclose(seen.increment.length, [1, 1, 1])
    np.testing.assert_allclose(seen.increment.turn, 0, atol=1e-15)
    for mask, expected in ((seen.seen, [1, 1, 1]), (seen.measured, [1, 1, 1]), (seen.first, [1, 0, 0])):
        np.testing.assert_array_equal(mask, expected)
    assert np.all(seen.inside)


def test_a_gap_is_spanned():
    seen = observe(straight_log([1, 1, 0, 0, 1, 1]))
    np.testing.assert_array_equal(seen.seen, [1, 0, 0, 1, 1])
    np.testing.assert_array_equal(seen.measured, [1, 0, 0, 1, 1])
    np.testing.assert_allclose(seen.increment.length, [1, 0, 0, 3, 1])


def test_nothing_is_measured_before_the_second_pose():
    seen = observe(straight_log([0, 0, 1, 0, 1]))
    np.testing.assert_array_equal(seen.seen, [0, 1, 0, 1])
    np.testing.assert_array_equal(seen.measured, [0, 0, 0, 1])
    np.testing.assert_allclose(seen.increment.length, [0, 0, 0, 2])


def test_nothing_crosses_the_seam_of_two_runs():
    seen = observe(straight_log([1, 1, 1, 1, 1, 0, 1], [0, 0, 0, 1, 1, 1, 1]))
    np.testing.assert_array_equal(seen.inside, [1, 1, 0, 1, 1, 1])
    np.testing.assert_array_equal(seen.first, [1, 0, 0, 1, 0, 0])
    np.testing.assert_array_equal(seen.measured, [1, 1, 0, 1, 0, 1])
    np.testing.assert_allclose(seen.increment.length, [1, 1, 0, 1, 0, 2])
    np.testing.assert_array_equal(seen.command.right, [0, 1, 0, 3, 4, 5])
    np.testing.assert_array_equal(np.where(seen.first, 0, seen.command_before.right)[3:], [0, 3, 4])


def test_a_pose_of_the_run_before_is_no_pose_of_this_one():
    seen = observe(straight_log([1, 1, 0, 0, 1], [0, 0, 1, 1, 1]))
    np.testing.assert_array_equal(seen.measured, [1, 0, 0, 0])
    np.testing.assert_array_equal(seen.increment.length[1:], 0)


def test_empty_cells_leave_no_trace():
    """The last command of a run may be empty, and a pose with one cell missing is none."""
    log = straight_log([1] * 6, [0, 0, 0, 1, 1, 1])
    log.u_r[[2, 5]] = log.u_l[[2, 5]] = np.nan
    log.theta[4] = np.nan
    seen = observe(log)
    np.testing.assert_array_equal(seen.measured, [1, 1, 0, 0, 1])
    assert all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(seen))


def random_log(seed) -> Log:
    """Runs of one row and more, a third of the poses missing, headings that cross half a turn."""
    rng = np.random.default_rng(seed)
    run = np.cumsum(rng.uniform(size=ROWS) < 0.15)
    pose = np.cumsum(rng.normal(size=(3, ROWS)), axis=1)
    pose[2] = np.angle(np.exp(1j * pose[2]))
    pose[:, rng.uniform(size=ROWS) < 1 / 3] = np.nan
    command = rng.uniform(-1, 1, (2, ROWS))
    command[:, np.append(run[1:] != run[:-1], True)] = np.nan
    return Log(np.arange(ROWS) * 0.1, *command, *pose, run)


def slow_observations(log: Log) -> list[dict]:
    """The same by walking through the rows with a memory of the last pose."""
    samples, last, length = [], None, 0
    for k in range(ROWS):
        begins = k == 0 or log.run[k] != log.run[k - 1]
        last, length = (None, 0) if begins else (last, length + 1)
        pose = Pose(log.x[k], log.y[k], log.theta[k])
        seen = not np.isnan(pose).any()
        measured = seen and last is not None
        increment = between(last, pose) if measured else (0.0, 0.0)
        last = pose if seen else last
        if k > 0:
            samples.append(
                {
                    "command": (0.0, 0.0) if begins else (log.u_r[k - 1], log.u_l[k - 1]),
                    "command_before": (log.u_r[k - 2], log.u_l[k - 2]) if length > 1 else (0.0, 0.0),
                    "increment": increment,
                    "seen": seen,
                    "measured": measured,
                    "first": length == 1,
                    "inside": not begins,
                }
            )
    return samples


@pytest.mark.parametrize("seed", range(6))
def test_walking_through_the_rows_gives_the_same(seed):
    log = random_log(seed)
    fast, slow = observe(log), slow_observations(log)
    for name in slow[0]:
        expected = np.array([sample[name] for sample in slow], float).T
        found = np.array(getattr(fast, name), float)
        if name == "command_before":  # void in a sample across a seam
            found, expected = (np.where(fast.inside, values, 0.0) for values in (found, expected))
        np.testing.assert_allclose(found, expected, atol=1e-14, err_msg=name)


def test_gradients_are_finite_beside_missing_poses():
    log = random_log(0)

    def score(x):
        return jnp.sum(jnp.stack(observe_log(log._replace(x=x)).increment))

    assert np.all(np.isfinite(jax.jit(jax.grad(score))(jnp.asarray(log.x))))

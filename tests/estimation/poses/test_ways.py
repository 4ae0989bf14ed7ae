"""Way and turn of a robot, as its poses tell."""

import numpy as np

from jaxident.estimation.poses.ways import way_and_turn, ways
from jaxident.log import make_log

STEP, ROWS = 0.05, 400
T = STEP * np.arange(ROWS)
V, W = 0.4 * np.sin(0.9 * T), 2.0 * np.cos(0.5 * T)


def driven(noise: float = 0.0):
    """A robot that goes forwards and backwards and turns by more than a whole turn; its way and its turn."""
    fine = 50
    t = np.arange(ROWS * fine) * STEP / fine
    v, w = 0.4 * np.sin(0.9 * t), 2.0 * np.cos(0.5 * t)
    theta = 2.5 + np.cumsum(w) * STEP / fine
    x, y = (np.cumsum(v * f(theta)) * STEP / fine for f in (np.cos, np.sin))
    rng = np.random.default_rng(0)
    pose = [part[::fine] + noise * k * rng.normal(size=ROWS) for part, k in ((x, 1), (y, 1), (theta, 8))]
    pose[2] = (pose[2] + np.pi) % (2.0 * np.pi) - np.pi
    truth = np.stack([np.cumsum(v)[::fine], np.cumsum(w)[::fine]]) * STEP / fine
    return make_log(T, 0.0 * T, 0.0 * T, *pose), truth - truth[:, :1]


def test_way_and_turn_are_those_of_the_robot():
    log, truth = driven()
    found = ways([log])[:, 0]
    np.testing.assert_allclose(found[0], truth[0], atol=1e-3)
    np.testing.assert_allclose(found[1], truth[1], atol=1e-9)


def test_errors_of_poses_do_not_add_up():
    log, truth = driven(noise=4e-4)
    apart = ways([log])[0, 0] - truth[0]
    assert np.abs(apart).max() < 4e-3  # a sum of independent errors of two poses each would be at 11e-3


def test_rows_without_a_pose_stay_where_the_robot_was_seen_and_the_way_goes_on_after_them():
    log, truth = driven()
    gone = np.arange(ROWS) % 7 == 3
    log = log._replace(**{name: np.where(gone, np.nan, np.asarray(getattr(log, name))) for name in ("x", "y", "theta")})
    short = log.rows(0, 100)
    found = ways([log, short])
    np.testing.assert_allclose(found[:, 0][:, ~gone], truth[:, ~gone], atol=3e-3)
    np.testing.assert_array_equal(found[:, 0, 3], found[:, 0, 2])
    np.testing.assert_array_equal(found[:, 1, :100], found[:, 0, :100])


def test_a_run_without_poses_goes_nowhere():
    log, _ = driven()
    blind = log._replace(x=np.full(ROWS, np.nan))
    np.testing.assert_array_equal(ways([blind]), 0.0)


def test_ways_of_several_windows_are_those_of_each():
    log, _ = driven()
    pose = np.stack(log.pose)[:, :396].reshape(3, 4, 99)
    way, turn = way_and_turn(*pose)
    for k in range(4):
        np.testing.assert_allclose((way[k], turn[k]), ways([log.rows(99 * k, 99 * k + 99)])[:, 0])

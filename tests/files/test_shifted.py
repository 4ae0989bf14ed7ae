"""Poses of a finished log moved in time."""

import numpy as np
import pytest

from jaxident.errors import InputError
from jaxident.files.shifted import shift_poses
from jaxident.log import join, make_log

ROWS, PERIOD = 40, 0.1
ROW = np.arange(ROWS)
LOG = make_log(PERIOD * ROW, ROW // 10, -(ROW // 8), *np.random.default_rng(0).normal(size=(3, ROWS)))


def columns(log):
    return np.stack([np.asarray(column, float) for column in log])


def test_an_offset_of_zero_changes_nothing():
    assert shift_poses(LOG) is LOG


def test_every_pose_moves_and_every_command_stays():
    """No pose meets a row: each has one of its own, beside those where the command changes."""
    made = shift_poses(LOG, 0.03)
    seen = np.isfinite(made.x)
    np.testing.assert_allclose(made.t[seen], LOG.t + 0.03, atol=1e-12)
    np.testing.assert_array_equal(made.theta[seen], LOG.theta)
    in_force = np.searchsorted(LOG.t, made.t + 1e-9, side="right") - 1
    np.testing.assert_array_equal(made.u_r, LOG.u_r[in_force])
    np.testing.assert_array_equal(made.u_l, LOG.u_l[in_force])
    assert len(made.t) < 1.3 * ROWS


def test_there_and_back_is_the_same_log():
    made = shift_poses(shift_poses(LOG, 0.25), -0.25)
    back = np.isfinite(made.x)
    np.testing.assert_allclose(columns(made)[:6, back], columns(LOG)[:6], atol=1e-9)


def test_poses_before_the_first_command_are_left_out():
    made = shift_poses(LOG, -0.25)
    assert np.isfinite(made.x).sum() == ROWS - 3
    assert made.t[0] == LOG.t[0]


def test_runs_stay_apart_and_one_without_poses_stays_as_it_is():
    blind = LOG._replace(x=LOG.x * np.nan, y=LOG.y * np.nan, theta=LOG.theta * np.nan)
    made = shift_poses(join([LOG, blind]), 0.03, PERIOD)
    assert [len(run.t) for run in made.runs()] == [ROWS, ROWS]
    assert [int(np.isfinite(run.x).sum()) for run in made.runs()] == [ROWS, 0]
    with pytest.raises(InputError, match="run 1: the streams do not overlap"):
        shift_poses(join([blind, LOG]), 1e3)

"""Runs, their joining, and the one question about a time base: is it even."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxident.errors import InputError
from jaxident.log import Log, even_period, first_rows, join, make_log


def numbered_log(runs, seed=0):
    """A log with the given run numbers; every number in it differs."""
    columns = np.random.default_rng(seed).normal(size=(6, len(runs)))
    columns[0] = np.arange(len(runs))
    return Log(*columns, np.array(runs))


def test_what_is_left_out_is_a_blind_camera_and_one_run():
    log = make_log(np.arange(3.0), np.ones(3), np.zeros(3), y=np.arange(3.0))
    assert np.all(np.isnan(log.x))
    assert np.all(np.isnan(log.theta))
    np.testing.assert_array_equal(log.y, [0, 1, 2])
    np.testing.assert_array_equal(log.run, [0, 0, 0])


def test_runs_are_cut_in_the_order_of_the_file():
    log = numbered_log([4, 4, 4, 1, 9, 9])
    runs = log.runs()
    assert [len(run.t) for run in runs] == [3, 1, 2]
    assert [int(run.run[0]) for run in runs] == [4, 1, 9]
    np.testing.assert_array_equal(np.concatenate([np.stack(run) for run in runs], axis=1), np.stack(log))


def test_first_rows_begin_the_runs():
    np.testing.assert_array_equal(first_rows(numbered_log([4, 4, 4, 1, 9, 9])), [1, 0, 0, 1, 1, 0])
    np.testing.assert_array_equal(first_rows(numbered_log([0])), [1])


def test_rows_leave_out_the_last():
    log = numbered_log([0] * 5)
    np.testing.assert_array_equal(np.stack(log.rows(1, 3)), np.stack(log)[:, 1:3])


def test_join_renumbers_and_keeps_every_row():
    """Equal run numbers of different logs stay different runs."""
    parts = [numbered_log([3, 3, 5], 1), numbered_log([3, 3], 2), numbered_log([5], 3)]
    joined = join(parts)
    np.testing.assert_array_equal(joined.run, [0, 0, 1, 2, 2, 3])
    np.testing.assert_array_equal(np.stack(joined[:6]), np.concatenate([np.stack(p[:6]) for p in parts], axis=1))
    np.testing.assert_array_equal(join(parts[0]).run, [0, 0, 1])


def test_a_log_passes_through_jit():
    log = numbered_log([0, 0, 1])
    moved = jax.jit(lambda log: log._replace(x=log.x + 1.0))(log)
    np.testing.assert_array_equal(moved.x, log.x + 1.0)
    assert isinstance(moved, Log)


def even_log(period, rows, digits=9, start=0.0, run=0):
    t = np.round(start + period * np.arange(rows), digits)
    return make_log(t, *np.zeros((2, rows)), run=np.full(rows, run))


@pytest.mark.parametrize("rate", [10, 25, 30, 50, 60, 100])
@pytest.mark.parametrize("rows", [2, 17, 400])
def test_stamps_rounded_to_a_millisecond_are_even(rate, rows):
    """The mean of n steps is off by at most a millisecond over n."""
    period = even_period(even_log(1 / rate, rows, digits=3, start=0.0123))
    assert period == pytest.approx(1 / rate, abs=1e-3 / (rows - 1) + 1e-12)


def test_runs_share_the_period_and_pauses_between_them_are_none():
    runs = join([even_log(0.02, 10), even_log(0.02, 1, start=5.0), even_log(0.02, 7, start=77.7)])
    assert even_period(runs) == pytest.approx(0.02, rel=1e-12)
    assert even_period(Log(*map(jnp.asarray, runs))) == pytest.approx(0.02, rel=1e-12)


def test_a_gap_is_named_by_its_time():
    log = even_log(1 / 30, 40, digits=3)
    gap = log._replace(t=np.where(np.arange(40) > 12, log.t + 60.0, log.t))
    with pytest.raises(InputError, match=r"t = 0\.4 s takes 60\.03 s, the others 0\.0333"):
        even_period(gap)


def test_a_missing_row_is_a_gap():
    log = even_log(0.02, 30)
    with pytest.raises(InputError, match=r"t = 0\.08 s takes 0\.04 s, the others 0\.02 s"):
        even_period(Log(*(np.delete(column, 5) for column in log)))


def test_jitter_is_refused():
    jitter = np.random.default_rng(0).uniform(-0.1, 0.1, 200)
    log = even_log(0.02, 200)
    with pytest.raises(InputError, match="uneven time steps"):
        even_period(log._replace(t=log.t + 0.02 * jitter))


def test_a_run_of_another_period_is_refused():
    with pytest.raises(InputError, match=r"t = 3 s takes 0\.05 s, the others 0\.02 s"):
        even_period(join([even_log(0.02, 50), even_log(0.05, 10, start=3.0)]))


def test_two_steps_that_differ_are_refused():
    with pytest.raises(InputError, match="uneven time steps"):
        even_period(make_log(np.array([0.0, 0.1, 0.9]), *np.zeros((2, 3))))


def test_single_rows_have_no_period():
    with pytest.raises(InputError, match="single row"):
        even_period(numbered_log([0, 1, 2]))

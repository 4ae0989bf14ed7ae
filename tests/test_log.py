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
    np.testing.assert_array_equal(
        np.stack(tuple(joined)[:6]), np.concatenate([np.stack(tuple(p)[:6]) for p in parts], axis=1)
    )
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


def test_slices_pick_rows_and_unpacking_picks_columns():
    log = numbered_log([0, 0, 1, 1, 1])
    assert isinstance(log[1:3], Log)
    np.testing.assert_array_equal(np.stack(log[1:3]), np.stack(log.rows(1, 3)))
    np.testing.assert_array_equal(log[::-2].t, [4, 2, 0])
    np.testing.assert_array_equal(log[np.asarray(log.t) > 2].run, [1, 1])
    np.testing.assert_array_equal(log[[4, 0]].t, [4, 0])
    t, *_, run = log
    assert t is log.t is log[0]
    assert run is log.run is log[-1]
    assert len(log) == 7
    assert jax.tree.leaves(log)[0] is log.t


def test_rows_between_two_times():
    log = numbered_log([0] * 5)
    np.testing.assert_array_equal(log.between(1.0, 3.0).t, [1, 2, 3])
    np.testing.assert_array_equal(log.between(None, 0.5).t, [0])
    with pytest.raises(InputError, match="no row between"):
        log.between(7.0, 9.0)


def test_arrays_make_a_checked_log():
    log = Log.from_arrays([0, 1, 2], [1, 2, 3], np.array([4.0, 5.0, np.nan]))
    assert all(column.dtype == np.float64 for column in tuple(log)[:6])
    assert (log.u_l.tolist(), log.run.tolist()) == ([4, 5, 5], [0, 0, 0])
    for wrong, reason in (
        (([0, 1, 1], [1] * 3, [1] * 3), "log, row 2, column t: is 1; time must rise"),
        (([0, 1, 2], [1] * 2, [1] * 3), "log: columns differ in length: t 3, u_r 2"),
        (([0, 1, 2], [1] * 3, [1] * 3, [0, np.nan, 0], [0] * 3, [0] * 3), "row 1, column x: is empty; a pose has"),
        ((["0", "1", "now"], [1] * 3, [1] * 3), "row 2, column t: 'now' is not a number"),
        (([0], [1], [1]), "no run has two rows"),
        (([], [], []), "has no rows"),
        ((np.zeros((2, 2)), [1] * 2, [1] * 2), "one row of numbers"),
    ):
        with pytest.raises(InputError, match=reason):
            Log.from_arrays(*wrong)


class Frame(dict):
    """What a data frame has and a log needs: column labels and columns."""


RAW = {
    "time_ms": np.array([0.0, 33.0, 67.0]),
    "right": np.array([1.0, 2.0, 3.0]),
    "left": np.array([3.0, 2.0, 1.0]),
    "X": np.array([0.0, 1.5, np.nan]),
    "Y": np.array([5.0, 6.0, np.nan]),
    "yaw": np.array([0.0, 90.0, np.nan]),
    "note": np.array(["a", "b", "c"]),
}
NAMES = {"u_r": "right", "u_l": "left", "x": "X", "y": "Y", "theta": "yaw", "t": "time_ms"}


def test_a_frame_with_other_names_and_units():
    units = {"t": "ms", "x": "mm", "y": 1e-3, "theta": "deg"}
    log = Log.from_dataframe(Frame(RAW), NAMES, units)
    assert log.t.tolist() == [0.0, 0.033, 0.067]
    assert log.x[:2].tolist() == [0.0, 0.0015]
    np.testing.assert_allclose(log.theta[:2], [0.0, 0.5 * np.pi], rtol=1e-15)
    text = "t=time_ms:ms, u_r=right, u_l=left, x=X:mm, y=Y:1e-3, theta=yaw:deg"
    np.testing.assert_array_equal(np.stack(Log.from_dataframe(RAW, text)), np.stack(log))


def test_signs_swaps_and_shifts_of_columns():
    log = Log.from_dataframe(RAW, "t=time_ms:ms,u_r=left,u_l=right:-1,x=Y,y=X:-2+1,theta=yaw:deg-90")
    assert (log.u_r.tolist(), log.u_l.tolist()) == ([3, 2, 1], [-1, -2, -3])
    assert log.y[:2].tolist() == [1.0, -2.0]
    np.testing.assert_allclose(log.theta[:2], [-0.5 * np.pi, 0.0], atol=1e-15)
    own = {"t": [0, 1], "u_r": [1, 2], "u_l": [3, 4]}
    assert Log.from_dataframe(own, "u_r=u_l,u_l=u_r").u_r.tolist() == [3, 4]


def test_times_as_dates_and_headings_as_quaternions():
    half = np.sqrt(0.5)
    frame = {
        "t": np.array(["2026-01-02T03:04:05.123456789", "2026-01-02T03:04:06"], "datetime64[ns]"),
        "u_r": [1, 1], "u_l": [1, 1], "x": [0, 0], "y": [0, 0],
        "qx": [0, 0], "qy": [0, 0], "qz": [half, 2.0], "qw": [half, -2.0],
    }  # fmt: skip
    log = Log.from_dataframe(frame)
    assert log.t.tolist() == [1767323045.1234567, 1767323046.0]
    np.testing.assert_allclose(log.theta, [0.5 * np.pi, -0.5 * np.pi], rtol=1e-15)
    texts = ["2026-01-02 03:04:05.123456789", "2026-01-02T05:34:06+02:30"]
    assert Log.from_dataframe(frame | {"t": texts}).t.tolist() == log.t.tolist()


@pytest.mark.parametrize(
    ("columns", "reason"),
    [
        ("t=time", "no column 'time' for t; there are time_ms, right, left"),
        ("t=time_ms:hours", "t=time_ms: unknown unit 'hours'; it should be s, ms, us, ns, min"),
        ("u_r=right:m", "unknown unit 'm'; it should be a number to multiply by"),
        ("t:ms", "'t:ms' is not NAME=COLUMN"),
        ("speed=right", "no column 'speed' in a log; those are t, u_r"),
        ("t=time_ms,t=right", "t is given twice"),
        ("u_r=right,u_l=right", "one column stands for two: u_r=right, u_l=right"),
        ("x=X:0", "'0' makes every value the same"),
        ("t=time_ms,u_r=right", "frame: no column u_l; there are"),
        ("t=note,u_r=right,u_l=left", "row 0, column t: 'a' is not a number"),
    ],
)
def test_a_wrong_column_or_unit_is_named(columns, reason):
    with pytest.raises(InputError, match=reason):
        Log.from_dataframe(RAW, columns)


def test_a_log_is_shown_in_a_line_and_as_a_frame():
    log = make_log(np.arange(4.0), np.ones(4), np.ones(4), np.array([0.0, np.nan, 1.0, 2.0]), np.zeros(4), np.zeros(4),
                   np.array([0, 0, 1, 1]))  # fmt: skip
    assert repr(log) == "Log of 4 rows in 2 run(s), 2 s, 75 % with a pose"
    assert repr(log[:0]) == "Log(t=(0,), u_r=(0,), u_l=(0,), x=(0,), y=(0,), theta=(0,), run=(0,))"
    shown = []
    jax.jit(lambda log: shown.append(repr(log)) or log.t)(log)
    assert shown == ["Log(t=(4,), u_r=(4,), u_l=(4,), x=(4,), y=(4,), theta=(4,), run=(4,))"]
    frame = log.to_dataframe()
    assert list(frame.columns) == list(Log._fields)
    np.testing.assert_array_equal(frame.x, log.x)

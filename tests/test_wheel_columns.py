"""Wheel speeds as columns of logs: in memory, in files, and laid on the rows of other streams."""

import copy
import pickle

import jax
import numpy as np
import pytest

import jaxident as ji
from jaxident.array_types import Pose, Wheels
from jaxident.errors import InputError
from jaxident.files.shifted import shift_poses
from jaxident.files.streams import Commands, Poses, WheelSpeeds, merge, read_wheels
from jaxident.log import Log, LogWithWheels, join, wheels_measured

ROWS = 12
RANDOM = np.random.default_rng(0).normal(size=(7, ROWS))
PLAIN = ji.make_log(0.1 * np.arange(ROWS), *RANDOM[:5], np.repeat([0, 1], 6))
SPEEDS = np.where(np.arange(ROWS) % 3 == 1, np.nan, RANDOM[5]), np.where(np.arange(ROWS) % 4 == 1, np.nan, RANDOM[6])
LOG = PLAIN._replace(wheel_r=SPEEDS[0], wheel_l=SPEEDS[1])


def same(first, second):
    assert type(first) is type(second)
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a, b)


def test_a_log_without_wheel_speeds_stays_a_tuple_of_seven():
    t, _u_r, _u_l, _x, _y, _theta, _run = PLAIN
    assert t is PLAIN.t
    assert PLAIN.wheel_r is None
    assert PLAIN.wheel_l is None
    assert wheels_measured(PLAIN) is None
    assert Log._fields == ("t", "u_r", "u_l", "x", "y", "theta", "run")
    assert len(jax.tree.leaves(PLAIN)) == 7


def test_wheel_speeds_go_where_the_rows_go():
    assert isinstance(LOG, LogWithWheels)
    assert "50 % with both wheel speeds" in repr(LOG)
    same(LOG.runs()[1], LOG[6:])
    same(join(LOG.runs()), LOG)
    same(Log(*(np.asarray(column) for column in LOG)), LOG)
    same(copy.deepcopy(pickle.loads(pickle.dumps(LOG))), LOG)
    same(LOG.between(0.25, None), LOG[3:])
    same(LOG[np.isfinite(LOG.wheel_r)].to_dataframe().pipe(Log.from_dataframe), LOG[np.isfinite(LOG.wheel_r)])
    same(LOG._replace(wheel_r=None, wheel_l=None), PLAIN)
    same(jax.jit(lambda log: log[2:])(LOG[:0]._replace(t=np.zeros(0))), LOG[:0])
    assert list(LOG.to_dataframe().columns)[-2:] == ["wheel_r", "wheel_l"]


def test_a_joined_log_without_them_measured_none():
    whole = join([PLAIN, LOG])
    assert np.isnan(whole.wheel_r[:ROWS]).all()
    np.testing.assert_array_equal(whole.wheel_l[ROWS:], LOG.wheel_l)


def test_files_keep_them_and_files_without_them_stay_as_they_were(tmp_path):
    for log in (LOG, PLAIN, LOG[:6]):
        ji.write_log(log, tmp_path / "log.csv")
        same(ji.read_log(tmp_path / "log.csv"), log)
    assert (tmp_path / "log.csv").read_text().startswith("t,u_r,u_l,x,y,theta,wheel_r,wheel_l\n")
    ji.write_log(PLAIN, tmp_path / "b.csv")
    assert ji.read_log(tmp_path / "b.csv").wheel_r is None
    named = "wheel_r=a:rpm,wheel_l=b:deg/s"
    (tmp_path / "c.csv").write_text("t,u_r,u_l,x,y,theta,a,b\n0,0,0,0,0,0,30,\n1,0,0,0,0,0,,90\n")
    read = ji.read_log(tmp_path / "c.csv", named)
    np.testing.assert_allclose(read.wheel_r, [np.pi, np.nan])
    np.testing.assert_allclose(read.wheel_l, [np.nan, 0.5 * np.pi])


def test_one_wheel_alone_is_refused_in_one_line(tmp_path):
    (tmp_path / "log.csv").write_text("t,u_r,u_l,x,y,theta,wheel_l\n0,0,0,0,0,0,30\n1,0,0,0,0,0,1\n")
    line = "has the column wheel_l and no column wheel_r; a log has the speeds of both wheels, or of none"
    with pytest.raises(InputError, match=f"log.csv: {line}"):
        ji.read_log(tmp_path / "log.csv")
    with pytest.raises(InputError, match=line):
        PLAIN._replace(wheel_l=SPEEDS[1])
    with pytest.raises(InputError, match="frame: " + line):
        Log.from_dataframe({"t": [0, 1], "u_r": [0, 1], "u_l": [0, 0], "wheel_l": [1, 2]})
    with pytest.raises(InputError, match="row 1, column wheel_r: is inf"):
        Log.from_arrays([0, 1], [0, 1], [0, 1], wheel_r=[0, np.inf], wheel_l=[0, 0])


def three_streams(seed):
    random = np.random.default_rng(seed)
    given, seen, turned = (np.sort(random.uniform(0.0, 4.0, n)) for n in (20, 50, 70))
    speed = random.normal(size=(2, 70))
    speed[0, ::7] = np.nan
    poses = Poses(seen, Pose(*random.normal(size=(3, 50))))
    return Commands(given, Wheels(*random.normal(size=(2, 20)))), poses, WheelSpeeds(turned, Wheels(*speed))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("period", [None, 0.05])
def test_a_third_stream_lies_on_the_rows_and_is_never_interpolated(seed, period):
    commands, poses, wheels = three_streams(seed)
    log = merge(commands, poses, wheels=wheels, period=period)
    end = max(commands.t[-1], poses.t[-1])
    for k, t in enumerate(log.t):
        near = np.abs(wheels.t - t) if period is None else np.abs(np.floor((wheels.t - log.t[0]) / period + 0.5) - k)
        within = np.flatnonzero((near < 1e-6) & (wheels.t >= log.t[0] - 1e-6) & (wheels.t <= end + 1e-6))
        best = within[np.argmin(np.abs(wheels.t[within] - t))] if len(within) else None
        expected = [np.nan, np.nan] if best is None else [speed[best] for speed in wheels.speed]
        np.testing.assert_array_equal([log.wheel_r[k], log.wheel_l[k]], expected)
    if period is not None:
        same(log._replace(wheel_r=None, wheel_l=None), merge(commands, poses, period=period))


def test_wheel_speeds_stay_when_poses_are_shifted():
    moved = shift_poses(LOG, 0.03)
    measured = np.isfinite(moved.wheel_r) | np.isfinite(moved.wheel_l)
    np.testing.assert_allclose(moved.t[measured], LOG.t[np.isfinite(LOG.wheel_r) | np.isfinite(LOG.wheel_l)])
    np.testing.assert_array_equal(moved.wheel_l[np.isfinite(moved.wheel_l)], LOG.wheel_l[np.isfinite(LOG.wheel_l)])


def test_a_stream_of_wheel_speeds_that_lies_elsewhere_is_refused(tmp_path):
    commands, poses, wheels = three_streams(0)
    with pytest.raises(InputError, match=r"the wheel speeds run from .* do not overlap"):
        merge(commands, poses, wheels=wheels._replace(t=wheels.t + 100.0))
    (tmp_path / "w.csv").write_text("t,wheel_r,wheel_l\n0,,\n1,,\n")
    with pytest.raises(InputError, match=r"w.csv: no row has a wheel speed"):
        read_wheels(tmp_path / "w.csv")

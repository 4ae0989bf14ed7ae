"""Two streams to one log, against a loop that is slow and obvious."""

import gzip
import math

import numpy as np
import pytest

from jaxident.array_types import Pose, Wheels
from jaxident.errors import InputError
from jaxident.files.logs import read_log, write_log
from jaxident.files.merged_rows import ROUNDING
from jaxident.files.streams import Commands, Poses, Speeds, merge, read_commands, read_poses
from jaxident.log import Log

NAN = math.nan


def commands(*rows):
    t, right, left = np.array(rows, float).T
    return Commands(t, Wheels(right, left))


def poses(*times):
    t = np.array(times, float)
    return Poses(t, Pose(t + 0.5, 2.0 * t, -t))


def table(log: Log) -> list[tuple]:
    """Rows (t, u_r, u_l, x), None where no pose is."""
    columns = zip(log.t, log.u_r, log.u_l, log.x, strict=True)
    return [(t, u_r, u_l, None if math.isnan(x) else x) for t, u_r, u_l, x in columns]


def slow_merge(commands, poses, period, offset, timeout) -> list[tuple]:
    """What the docstring of `merge` says, row by row, for times that differ clearly."""
    given = list(zip(commands.t.tolist(), commands.value.right.tolist(), commands.value.left.tolist(), strict=True))
    seen = [(t + offset, x) for t, x in zip(poses.t.tolist(), poses.pose.x.tolist(), strict=True)]
    end = max(given[-1][0], seen[-1][0])
    if timeout is not None:
        following = [t for t, _, _ in given[1:]] + [end]
        zeros = [
            (t + timeout, 0.0, 0.0) for (t, _, _), after in zip(given, following, strict=True) if t + timeout < after
        ]
        given = sorted(given + zeros)
    start = given[0][0]
    if period is None:
        rows = sorted({t for t, _, _ in given} | {t for t, _ in seen if t >= start})
        pose_at = {row: dict(seen).get(row) for row in rows}
    else:
        rows = [start + period * k for k in range(math.floor((end - start) / period) + 1)]
        pose_at = {}
        for row in rows:
            distance, x = min((abs(t - row), x) for t, x in seen)
            pose_at[row] = x if distance <= 0.5 * period else None
    late = 0.0 if period is None else ROUNDING * period
    in_force = [[command for command in given if command[0] <= row + late][-1] for row in rows]
    return [(row, u_r, u_l, pose_at[row]) for row, (_, u_r, u_l) in zip(rows, in_force, strict=True)]


@pytest.mark.parametrize("timeout", [None, 0.05, 0.3])
@pytest.mark.parametrize("period", [None, 0.02, 0.1, 0.7])
@pytest.mark.parametrize("seed", range(4))
def test_merging_follows_the_slow_loop(seed, period, timeout):
    draw = np.random.default_rng(seed)
    command_t, pose_t = (np.cumsum(draw.exponential(mean, size=60)) for mean in (0.1, 0.06))
    given = Commands(command_t, Wheels(*draw.normal(size=(2, 60))))
    seen = Poses(pose_t, Pose(*draw.normal(size=(3, 60))))
    offset = draw.normal()
    log = merge(given, seen, period=period, pose_offset=offset, hold_timeout=timeout)
    assert table(log) == slow_merge(given, seen, period, offset, timeout)


def test_every_event_is_a_row_and_equal_times_share_one():
    log = merge(commands((1.0, 5, 6), (2.0, 7, 8)), poses(0.5, 1.5, 2.0, 3.0))
    assert table(log) == [(1.0, 5, 6, None), (1.5, 5, 6, 2.0), (2.0, 7, 8, 2.5), (3.0, 7, 8, 3.5)]
    assert log.run.tolist() == [0, 0, 0, 0]


def test_an_offset_that_rounds_does_not_part_equal_times():
    given, seen = commands((0.3, 1, 1), (0.6, 2, 2)), poses(0.1, 0.4)
    assert 0.1 + 0.2 != 0.3
    assert merge(given, seen, pose_offset=0.2).t.tolist() == [0.3, 0.6]


def test_an_even_log_takes_the_command_in_force_and_the_nearest_pose_once():
    given = commands((10.0, 1, 1), (10.15, 2, 2), (10.2, 3, 3))
    log = merge(given, poses(9.96, 10.02, 10.16, 10.36), period=0.1)
    expected = [(10.0, 1, 10.52), (10.1, 1, NAN), (10.2, 3, 10.66), (10.3, 3, NAN)]
    assert np.array_equal(log.t, 10.0 + 0.1 * np.arange(4))
    assert np.array_equal(np.transpose([log.u_r, log.x]), [row[1:] for row in expected], equal_nan=True)


def test_commands_on_the_grid_of_an_even_log_are_not_late():
    t = np.array([float(f"{1700000000 + 0.1 * k:.1f}") for k in range(300)])
    log = merge(Commands(t, Wheels(np.arange(300.0), np.zeros(300))), poses(t[0], t[-1]), period=0.1)
    assert log.u_r.tolist() == list(range(300))


def test_a_command_that_grows_old_is_zero_from_its_expiry_on():
    given, seen = commands((0.0, 1, 2), (0.5, 3, 4), (2.0, 5, 6)), poses(0.0, 4.0)
    rows = table(merge(given, seen, hold_timeout=0.5))
    assert rows == [
        (0.0, 1, 2, 0.5), (0.5, 3, 4, None), (1.0, 0, 0, None), (2.0, 5, 6, None), (2.5, 0, 0, None), (4.0, 0, 0, 4.5)
    ]  # fmt: skip
    even = merge(given, seen, hold_timeout=0.5, period=0.4)
    assert even.u_r.tolist() == [1, 1, 3, 0, 0, 5, 5, 0, 0, 0, 0]


def test_a_command_that_is_renewed_in_time_never_expires():
    t = np.round(0.1 * np.arange(50), 1)
    given = Commands(t, Wheels(np.ones(50), np.ones(50)))
    log = merge(given, poses(0.0, 4.9), hold_timeout=0.1)
    assert np.array_equal(log.t, t)
    assert log.u_r.tolist() == [1.0] * 50


def test_speeds_become_wheel_speeds():
    given = Commands(np.array([0.0, 1.0]), Speeds(np.array([0.5, -0.2]), np.array([0.4, 1.0])))
    log = merge(given, poses(0.0), track=0.5)
    assert np.allclose(log.u_r, [0.6, 0.05], rtol=1e-14)
    assert np.allclose(log.u_l, [0.4, -0.45], rtol=1e-14)


def test_of_several_entries_at_one_time_the_last_counts():
    given = commands((0.0, 1, 1), (1.0, 2, 2), (1.0, 3, 3), (2.0, 4, 4))
    with pytest.warns(UserWarning, match="commands: 1 of 4 share their time with the next, which counts"):
        assert merge(given, poses(0.0)).u_r.tolist() == [1, 3, 4]
    twice = Poses(np.array([0.0, 0.0]), Pose(*np.array([[1.0, 2.0]] * 3)))
    with pytest.warns(UserWarning, match="poses: 1 of 2"):
        assert merge(commands((0.0, 1, 1), (1.0, 1, 1)), twice).x.tolist()[0] == 2.0


def test_streams_that_do_not_overlap_are_refused():
    with pytest.raises(InputError, match=r"do not overlap: commands from 0 to 1 s, poses from 5 to 5 s: are"):
        merge(commands((0.0, 1, 1), (1.0, 2, 2)), poses(5.0))
    assert table(merge(commands((0.0, 1, 1)), poses(5.0)))[-1] == (5.0, 1, 1, 5.5)
    with pytest.raises(InputError, match=r"the poses are in Unix time, the others not: .* --pose-offset auto"):
        merge(*BOTH, pose_offset=1.7e9)


def test_times_in_another_unit_are_refused():
    t = 0.03 * np.arange(100)
    given, seen = Commands(t, Wheels(t, t)), Poses(t, Pose(t, t, t))
    with pytest.raises(InputError, match=r"the poses are 30 s apart; .* `--columns t=t:ms` takes them for ms"):
        merge(given, seen._replace(t=1e3 * t))
    with pytest.raises(InputError, match=r"the poses are 3e[+]07 s apart; .* `--columns t=t:ns` takes"):
        merge(given, seen._replace(t=1e9 * t))
    with pytest.raises(InputError, match=r"commands last 2970 s and the poses 2.97 s: .* `--command-columns t=t:ms`"):
        merge(given._replace(t=1e3 * t), seen)


BOTH = commands((0.0, 1, 1), (1.0, 2, 2)), poses(0.0, 1.0)
SPEEDS = Commands(np.array([0.0, 1.0]), Speeds(np.ones(2), np.ones(2))), BOTH[1]


@pytest.mark.parametrize(
    ("streams", "settings", "reason"),
    [
        (SPEEDS, {}, "track: the commands are v,w; give the track width"),
        (BOTH, {"track": 0.3}, "track: the commands are u_r,u_l already; leave it out"),
        (SPEEDS, {"track": 0.0}, "track: is 0; it should be positive"),
        (SPEEDS, {"track": NAN}, "track: is nan; it should be positive"),
        (BOTH, {"period": -0.1}, "period: is -0.1; it should be positive"),
        (BOTH, {"period": math.inf}, "period: is inf"),
        (BOTH, {"hold_timeout": 0.0}, "hold_timeout: is 0; it should be positive"),
        (BOTH, {"pose_offset": NAN}, "pose_offset: is nan; it should be a finite time"),
        (BOTH, {"pose_offset": -1.5}, "do not overlap: commands from 0 to 1 s, poses from -1.5 to -0.5 s: are both"),
        (BOTH, {"period": 2.0}, "a log of a single row, at 0 s"),
        (BOTH, {"period": 1e-9}, "period: 1e-09 s makes 1e[+]09 rows between 0 s and 1 s; are both streams on one"),
        ((BOTH[0], poses(1.0, 0.0)), {}, "poses, entry 1, column t: is 0; time must not go back"),
        ((commands((1.0, 1, 1), (0.0, 1, 1)), BOTH[1]), {}, "commands, entry 1, column t: is 0; time must not go"),
        ((BOTH[0], poses()), {}, "poses: there are none"),
    ],
)
def test_a_wrong_setting_or_stream_is_named(streams, settings, reason):
    with pytest.raises(InputError, match=reason):
        merge(*streams, **settings)


def save(folder, text):
    path = folder / "s.csv"
    path.write_text(text)
    return path


def test_streams_read_from_csv(tmp_path):
    given = read_commands(save(tmp_path, "w,t,v\n0.5,0,1\n-0.5,0,2\n0,1,3\n"))
    assert isinstance(given.value, Speeds)
    assert (given.t.tolist(), given.value.v.tolist(), given.value.w.tolist()) == ([0, 0, 1], [1, 2, 3], [0.5, -0.5, 0])
    given = read_commands(save(tmp_path, "t,u_l,u_r\n0,1,2\n"))
    assert given.value == Wheels(2.0, 1.0)
    packed = tmp_path / "p.csv.gz"
    packed.write_bytes(gzip.compress(b"\xef\xbb\xbft,x,y,theta\r\n0,1,2,3\r\n0.5,,,\r\n1,4,5,6\r\n"))
    seen = read_poses(packed)
    assert seen.t.tolist() == [0.0, 1.0]
    assert np.array_equal(seen.pose, [[1, 4], [2, 5], [3, 6]])


@pytest.mark.parametrize(
    ("read", "text", "reason"),
    [
        (read_commands, "t,v\n", "line 1: no column w in the header 't,v'; it should be t,v,w or t,u_r,u_l"),
        (read_commands, "t,u_r\n", "line 1: no column u_l in the header"),
        (read_commands, "t,v,w,u_r,u_l\n", "line 1: the header holds t,v,w and t,u_r,u_l; keep one of them"),
        (read_commands, "t,v,w\n", "s.csv: has no rows below its header"),
        (read_commands, "", "is empty; it should begin with the header t,v,w or t,u_r,u_l"),
        (read_commands, "t,v,w\n0,1,1\n1,,1\n", "line 3, column v: is empty; a command has both values"),
        (read_commands, "t,u_r,u_l\n0,1,1\n1,1,\n", "line 3, column u_l: is empty; a command has both values"),
        (read_commands, "t,v,w\n0,1,1\n,1,1\n", "line 3, column t: is empty; every row needs a time"),
        (read_commands, "t,v,w\n5,1,1\n\n4,1,1\n", "line 4, column t: is 4; time must not go back"),
        (read_commands, "t,v,w\n0,1,1\n1,nan,1\n", "line 3, column v: 'nan' is not a finite decimal number"),
        (read_poses, "t,x,y\n0,1,1\n", "line 1: no column theta in the header 't,x,y'; it should be t,x,y,theta"),
        (read_poses, "t,x,y,theta\n0,1,1,1\n1,1,,1\n", "line 3, column y: is empty; a pose has three cells, or none"),
        (read_poses, "t,x,y,theta\n1,1,1,1\n0,1,1,1\n", "line 3, column t: is 0; time must not go back"),
        (read_poses, "t,x,y,theta\n0,,,\n", "s.csv: no row has a pose"),
        (read_poses, "t,x,y,theta\n", "s.csv: has no rows below its header"),
    ],
)
def test_a_bad_stream_is_named(tmp_path, read, text, reason):
    with pytest.raises(InputError, match=reason) as caught:
        read(save(tmp_path, text))
    assert "\n" not in str(caught.value)


@pytest.mark.filterwarnings("ignore:commands. .* share their time")
@pytest.mark.parametrize("robot", range(1, 6))
def test_the_mrclam_streams_convert_both_ways(shared, tmp_path, robot):
    given = read_commands(shared / "data" / "mrclam" / f"D6_R{robot}_commands.csv.gz")
    seen = read_poses(shared / "data" / "mrclam" / f"D6_R{robot}_poses.csv.gz")
    log = merge(given, seen, track=0.258)
    kept = seen.t >= given.t[0]
    measured = np.isfinite(log.x)
    assert np.allclose(log.t[measured], seen.t[kept], rtol=0.0, atol=1e-6)
    assert np.array_equal(log.theta[measured], seen.pose.theta[kept])
    assert set(np.unique(given.t)) <= set(log.t)
    assert np.allclose(log.u_r[-1] + log.u_l[-1], 2.0 * given.value.v[-1])

    clock = Poses(seen.t, Pose(seen.t, seen.t, seen.t))
    even = merge(given, clock, track=0.258, period=1 / 30)
    assert np.allclose(np.diff(even.t), 1 / 30)
    used = even.x[np.isfinite(even.x)]
    assert np.all(np.diff(used) > 0.0)
    assert np.nanmax(np.abs(even.x - even.t)) <= 0.5 / 30 + 1e-9
    assert len(used) > 0.8 * len(even.t)
    write_log(even.rows(0, 3000), tmp_path / "log.csv")
    assert np.array_equal(read_log(tmp_path / "log.csv").x, even.x[:3000], equal_nan=True)


@pytest.mark.parametrize("settings", [{"pose_offset": 1e308, "period": 1e-9}, {"period": 1e-308}])
def test_clocks_that_lie_ages_apart_are_refused_without_a_word_of_numpy(settings):
    commands = Commands(np.arange(3.0), Wheels(np.ones(3), np.ones(3)))
    poses = Poses(np.arange(3.0), Pose(*np.zeros((3, 3))))
    with pytest.raises(InputError, match=r"pose_offset: is 1e\+308|period: 1e-308 s makes inf rows"):
        merge(commands, poses, **settings)

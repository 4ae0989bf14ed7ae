"""The offset between two clocks against simulated robots: error against its standard error, ambiguity, and refusals."""

import numpy as np
import pytest

from jaxident.array_types import Pose, Wheels
from jaxident.errors import InputError
from jaxident.estimation.suspicions.clock_offset import follow_commands, respond, streams_of, streams_of_log
from jaxident.files.offset import estimate_offset
from jaxident.files.streams import Commands, Poses
from jaxident.log import Log, join

FINE = 1e-3
"""Step [s] of the simulation, far below every other time here."""


def robot(seed, length=20.0, period=None, noise=(1e-3, 5e-3), slip=0.0):
    """Commands at random times, and poses at 30 Hz with jitter of a robot with two lags and dead zones; true times."""
    draw = np.random.default_rng(seed)
    t = np.arange(0.0, length, FINE)
    at = np.cumsum(draw.exponential(0.2, int(5 * length))) if period is None else np.arange(0.0, length, 0.25 * period)
    at = np.concatenate([[0.0], at[(at > 0.0) & (at < length)]])
    levels = draw.uniform(-1.0, 1.0, (len(at) if period is None else 4, 2))
    u = levels[np.arange(len(at)) % len(levels)]
    passed = np.sign(u) * np.maximum(np.abs(u) - 0.05, 0.0)
    told = passed[np.searchsorted(at, t, side="right") - 1]
    gain, rate = np.array([[0.3, 0.3], [2.0, -2.0]]) * draw.uniform(0.7, 1.3, (2, 2)), draw.uniform(3.0, 12.0, 2)
    keep = np.exp(-rate * FINE)
    speed, state = np.empty((len(t), 2)), np.zeros(2)
    for k, want in enumerate(told @ gain.T):
        speed[k] = state
        state = keep * state + (1.0 - keep) * want
    speed += slip * draw.normal(size=speed.shape) / np.sqrt(FINE)
    theta = np.cumsum(speed[:, 1]) * FINE
    x, y = (np.cumsum(speed[:, 0] * side(theta)) * FINE for side in (np.cos, np.sin))
    rows = np.searchsorted(t, np.cumsum(draw.uniform(0.8, 1.2, int(30 * length) - 20) / 30))
    rows = rows[rows < len(t)]
    seen = np.stack([x, y, theta])[:, rows] + np.array([[noise[0]], [noise[0]], [noise[1]]]) * draw.normal(
        size=(3, len(rows))
    )
    return Commands(at, Wheels(*u.T)), Poses(t[rows], Pose(*seen))


def shifted(poses, offset):
    """The poses by a clock to which the offset must be added."""
    return poses._replace(t=poses.t - offset)


@pytest.mark.parametrize("slip", [0.0, 0.01])
def test_error_against_its_standard_error(slip):
    """20 robots each: chi-square of 20 lies below 40 with probability 0.995, and the bound allows errors that are told
    a tenth too small (800 robots of the simulator: 1.09)."""
    z = []
    for seed in range(20):
        offset = np.random.default_rng(100 + seed).uniform(-0.5, 0.5)
        commands, poses = robot(seed, slip=slip)
        found = estimate_offset(commands, shifted(poses, offset))
        z.append((found.offset - offset) / np.hypot(found.standard_error, 0.5 * FINE))
        assert found.standard_error < 0.004
    assert np.sum(np.square(z)) < 40.0 * 1.1**2
    assert abs(np.mean(z)) < 3.0 / np.sqrt(len(z))


def test_clocks_that_share_no_time():
    commands, poses = robot(1)
    unix = estimate_offset(commands, shifted(poses, -1.7e9))
    assert unix.offset == pytest.approx(-1.7e9, abs=0.005)
    with_unix = estimate_offset(commands._replace(t=commands.t + 1.7e9), poses)
    assert with_unix.offset == pytest.approx(1.7e9, abs=0.005)


def test_an_offset_of_many_seconds():
    commands, poses = robot(2, length=60.0)
    late = poses.t > 20.0
    cut = Poses(poses.t[late], Pose(*(column[late] for column in poses.pose)))
    assert estimate_offset(commands, shifted(cut, 17.0)).offset == pytest.approx(17.0, abs=0.01)


def test_inputs_that_repeat_leave_the_offset_open():
    """Poses from the middle alone: where the robot stood at rest before the first command, that would tell."""
    commands, poses = robot(3, length=40.0, period=3.0)
    inside = (poses.t > 10.0) & (poses.t < 30.0)
    poses = Poses(poses.t[inside], Pose(*(column[inside] for column in poses.pose)))
    with pytest.raises(InputError, match="fit as well as each other; give the right one"):
        estimate_offset(commands, poses)


def test_motion_that_does_not_answer_is_refused():
    (commands, _), (_, poses) = robot(4), robot(5)
    draw = np.random.default_rng(0)
    noise = poses._replace(pose=Pose(*draw.normal(size=(3, len(poses.t)))))
    for still in (noise, poses._replace(t=poses.t[:20], pose=Pose(*(column[:20] for column in poses.pose)))):
        with pytest.raises(InputError, match=r"the motion does not answer the commands|fit as well as each other"):
            estimate_offset(commands, still)


def test_runs_of_a_log_share_one_offset():
    logs = []
    for seed in (6, 7):
        commands, poses = robot(seed)
        t = np.union1d(commands.t, poses.t)
        row = np.searchsorted(commands.t, t, side="right") - 1
        pose = np.full((3, len(t)), np.nan)
        pose[:, np.searchsorted(t, poses.t)] = poses.pose
        logs.append(Log.from_arrays(t, commands.value.right[row], commands.value.left[row], *pose))
    one, both = (respond(streams_of_log(log), 5.0) for log in (logs[0], join(logs)))
    assert abs(both.offset) < 5.0 * both.standard_error + FINE
    assert both.rows > 1.9 * one.rows


def test_the_lag_is_exact():
    """Against steps so fine that a sum is an integral; doubling spans equals the recursion."""
    t, u = np.array([0.0, 0.3, 0.35, 1.0]), np.array([[1.0], [-1.0], [0.5], [0.0]])
    at = np.array([0.1, 0.3, 0.9, 1.7])
    area, speed = follow_commands(t, u, 4.0, at)
    fine = np.arange(0.0, 2.0, 1e-5)
    f = np.zeros(len(fine))
    for k in range(len(fine) - 1):
        f[k + 1] = f[k] + (1.0 - np.exp(-4e-5)) * (u[np.searchsorted(t, fine[k] + 1e-9, side="right") - 1, 0] - f[k])
    place = np.round(at / 1e-5).astype(int)
    np.testing.assert_allclose(speed[:, 0], f[place], atol=1e-4)
    np.testing.assert_allclose(area[:, 0], np.cumsum(f)[place] * 1e-5, atol=1e-4)


def test_too_little_says_nothing():
    commands, poses = robot(8, length=3.0)
    assert respond(streams_of(commands.t, commands.value, poses.t[:50], Pose(*(c[:50] for c in poses.pose)))) is None


@pytest.mark.parametrize("seed", range(3))
def test_degenerate_motion_ends_in_no_error(seed):
    """Straight lines, rest, one wheel, one switch of a command, a pose that is far off: nothing is claimed."""
    k, draw = np.arange(600.0), np.random.default_rng(seed)
    told = np.sin(0.3 * k), np.cos(0.17 * k)
    off = np.where(k == 300, 1e30, 0.0)
    t = 0.033 * k + np.where(k > 400, 1e5 * (seed == 1), 0.0)
    for command, pose in (
        (told, (1e-3 * k, 0.0 * k, 0.0 * k)),
        (told, (0.0 * k, 0.0 * k, 0.0 * k)),
        (told, (off, 0.0 * k, 0.0 * k)),
        ((0.0 * k, told[1]), draw.normal(size=(3, 600))),
        ((1.0 * (k > 300), 0.0 * k), np.cumsum(draw.normal(size=(3, 600)), axis=1)),
    ):
        found = respond(streams_of(t, Wheels(*command), t, Pose(*pose)))
        assert found is None or (np.isfinite(found.offset) and not np.all(found.explained > 0.1))

"""What users trip over is said, and clean logs are left in peace: the simulator under many inputs and noises."""

import dataclasses
import re

import jax
import numpy as np
import pytest

from jaxident.estimation.poses.parameters import Robot
from jaxident.estimation.suspicions.log_suspicions import log_suspicions, odometry_suspicions
from jaxident.estimation.suspicions.motions import motions
from jaxident.files.models import load_model
from jaxident.log import Log, join
from jaxident.robot.drive import Physical
from jaxident.robot.model import Effect
from jaxident.robot.noise import Noise
from jaxident.study.synthetic import excite, simulate_runs

PUBLISHED = load_model("published")
DRIVE = Physical(np.asarray(PUBLISHED.physical.rate), np.asarray(PUBLISHED.physical.gain))
ROBOT = dataclasses.replace(PUBLISHED, dynamics=DRIVE)
CAMERA = (5e-4, 5e-3)


def made(kind="multilevel", noise=CAMERA, effect=None, seed=0):
    robot = ROBOT if effect is None else dataclasses.replace(ROBOT, effects=(effect,))
    inputs = excite(jax.random.key(seed), kind, 600, ROBOT.sample_period)
    return simulate_runs(robot, inputs, noise=noise, key=jax.random.key(seed + 9))


def said(log):
    robot = Robot(DRIVE, np.asarray(ROBOT.dead_zone), Noise(*CAMERA))
    return log_suspicions(log) + odometry_suspicions(log, robot)


@pytest.fixture(scope="module")
def log():
    return made()


@pytest.mark.parametrize("kind", ["multilevel", "staircase", "prbs", "multisine", "chirp"])
@pytest.mark.parametrize("noise", [None, (2e-4, 2e-3), (1e-3, 1e-2), (5e-3, 5e-2)])
def test_clean_logs_are_left_in_peace(kind, noise):
    assert said(made(kind, noise)) == ()


def test_clean_runs_with_gaps_are_left_in_peace(log):
    blind = np.arange(600) % 7 == 3
    gaps = log._replace(**{c: np.where(blind, np.nan, getattr(log, c)) for c in ("x", "y", "theta")})
    turned = made(seed=1)._replace(theta=np.angle(np.exp(1j * made(seed=1).theta)))
    assert said(join([gaps, turned])) == ()
    assert said(log.rows(0, 20)) == ()


@pytest.mark.parametrize("noise", [(2e-4, 2e-3), (1e-3, 1e-2)])
@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (lambda log: log._replace(theta=np.degrees(log.theta)), "degrees"),
        (lambda log: log._replace(theta=np.degrees(np.angle(np.exp(1j * log.theta)))), "degrees"),
        (lambda log: log._replace(theta=log.theta + np.pi * (np.arange(600) // 3 % 40 == 7)), "half a turn 10 times"),
    ],
)
def test_frames_and_units_of_the_heading(changed, words, noise):
    (line,) = said(changed(made(noise=noise)))
    assert words in line


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ("u_r=u_l,u_l=u_r", "swapped (`--columns u_r=u_l,u_l=u_r`)"),
        ("y=y:-1,theta=theta:-1", "y points down (`--columns y=y:-1,theta=theta:-1`)"),
        (
            "u_r=u_r:-1,u_l=u_l:-1",
            "both wheels run backwards under positive commands: `--columns u_r=u_r:-1,u_l=u_l:-1`",
        ),
        ("theta=theta:rad+3.14159", "half a turn (`--columns theta=theta:rad+3.14159`)"),
        ("u_r=u_r:-1", "right wheel runs backwards under positive commands: `--columns u_r=u_r:-1`"),
        ("u_l=u_l:-1", "left wheel runs backwards under positive commands: `--columns u_l=u_l:-1`"),
        ("theta=theta:180", "degrees: `--columns theta=theta:deg`"),
        ("y=y:-1", "mirrored, as in a picture whose y axis points down: `--columns y=y:-1`"),
        ("theta=theta:-1", "it looks counted clockwise: `--columns theta=theta:-1`"),
        ("x=y,y=x", "as if x and y were swapped: `--columns x=y,y=x`"),
        ("theta=theta:-1+1.5708", "from the y axis, as on a compass: `--columns theta=theta:-1+1.5708`"),
        ("theta=theta:rad+1.5708", "a quarter turn off, the marker sits sideways: `--columns theta=theta:rad-1.5708`"),
        ("theta=theta:rad-1.5708", "a quarter turn off, the marker sits sideways: `--columns theta=theta:rad+1.5708`"),
        ("x=x:100,y=y:100", "than metres: `--columns x=x:cm,y=y:cm` (then 0.0"),
        ("x=x:1000,y=y:1000", "than metres: `--columns x=x:mm,y=y:mm` (then 0.0"),
    ],
)
def test_what_is_wrong_is_said_with_the_option_that_mends_it(log, columns, words):
    """Each change is its own opposite, or the words name the opposite: the mended log is left in peace."""
    wrong = Log.from_dataframe(log._asdict(), columns.replace(":180", f":{180 / np.pi}"))
    (line,) = said(wrong)
    assert words in line
    option = re.search(r"--columns ([^`]*)`", words)[1]
    assert said(Log.from_dataframe(wrong._asdict(), option)) == ()


@pytest.mark.parametrize(("delay", "rows"), [(0.02, None), (0.07, "2.1"), (0.1, "3.0"), (0.2, "6.0")])
def test_delays_of_several_rows(delay, rows):
    lines = said(made(effect=Effect("transport_delay", {"delay": delay})))
    if rows is None:
        assert lines == ()
    else:
        assert "late: a delay" in lines[0]
        assert f"`jaxident convert --log LOG --pose-offset -{delay:g}" in lines[0]


@pytest.mark.parametrize("rows", [1, 3, 9])
def test_poses_of_a_clock_that_is_ahead(log, rows):
    """What a robot does before it is told to is no delay."""
    early = log[:-rows]._replace(**{c: getattr(log, c)[rows:] for c in ("x", "y", "theta")})
    (line,) = said(early)
    assert "before it is told to: the poses have another clock" in line
    offset = float(re.search(r"--pose-offset ([-0-9.]+) ", line)[1])
    assert offset == pytest.approx(rows * ROBOT.sample_period, abs=0.004)


def test_a_motor_lag_is_no_delay():
    assert said(made(effect=Effect("motor_lag", {"time_constant": 0.06}))) == ()


@pytest.mark.parametrize("error", [0.0, 0.01])
def test_wheel_odometry(error):
    exact, rng = made(noise=None), np.random.default_rng(0)
    moved = motions(exact)
    along, turn = (part * (1.0 + error * rng.normal(size=599)) for part in (moved.along(), moved.turn))
    theta = np.concatenate([[0.0], np.cumsum(turn)])
    middle = theta[:-1] + 0.5 * turn
    x, y = (np.concatenate([[0.0], np.cumsum(along * side(middle))]) for side in (np.cos, np.sin))
    (line,) = said(Log(exact.t, exact.u_r, exact.u_l, x, y, theta, exact.run))
    assert "odometry" in line

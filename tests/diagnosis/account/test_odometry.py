"""A robot that moves as its wheels turned: against the simulator, with a late camera, and where there is nothing."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

import jaxident as ji
from jaxident.diagnosis.account.odometry import beside_poses, follow_wheels, odometry, sensor_by_stretches
from jaxident.estimation.ahead.stretches import Starts
from jaxident.log import join
from jaxident.robot.wheel_sensor import WheelSensor

SENSOR, STEP, ROWS = WheelSensor(0.03, 0.1), 0.02, 200
AHEAD = 30
STARTS = np.array([40, 100, 160])


def driven(*effects, seed=0):
    """Two runs of a robot without noise that measures its wheels."""
    robot = dataclasses.replace(ji.load_model("published"), sample_period=STEP, wheels=SENSOR, effects=effects)
    rng, logs = np.random.default_rng(seed), []
    for _ in range(2):
        command = np.repeat(rng.uniform(-1.0, 1.0, (ROWS // 20, 2)), 20, axis=0)
        made = ji.simulate(robot, ji.make_log(STEP * np.arange(ROWS), *command.T))
        logs.append(type(made)(*(None if column is None else np.asarray(column) for column in made)))
    return join(logs), robot


def judged(log, robot, **changes):
    """What `odometry` makes of the second run, beside a nominal model that stays 1 cm and 10 mrad behind."""
    starts = Starts(np.ones(len(STARTS), int), STARTS)
    places = ROWS + STARTS[:, None] + np.arange(1, 1 + AHEAD)
    right = np.stack([np.asarray(column)[places] for column in log.pose], axis=-1)
    prepared = SimpleNamespace(log=log, fitted=log.rows(0, ROWS), judging=starts, rows=AHEAD,
                               windows=SimpleNamespace(wheels=log.wheel_r))  # fmt: skip
    paths = np.stack([right + np.array([0.01, 0.0, 0.01]), right])
    return odometry(SimpleNamespace(**(vars(prepared) | changes)), paths, robot)


def test_wheels_alone_make_the_robots_path():
    """Without slip, to what trapezoids of the wheel speeds leave."""
    log, robot = driven()
    found = judged(log, robot)
    assert found.sensor == pytest.approx(SENSOR, rel=1e-2)
    assert found.starts == len(STARTS)
    assert found.rms["nominal"] == pytest.approx((0.01, 0.01))
    assert found.rms["corrected"] == (0.0, 0.0)
    assert found.rms["wheels"][0] < 1e-3
    assert found.rms["wheels"][1] < 0.02
    assert "wheels_late" not in found.rms


def test_a_slide_is_behind_the_wheels_and_a_late_motor_is_not():
    late, robot = driven(ji.Effect("motor_lag", {"time_constant": 0.08}))
    slide, _ = driven(ji.Effect("lateral_slip", {"slip": 0.3}))
    assert judged(late, robot).rms["wheels"][0] < 1e-3
    assert judged(slide, robot).rms["wheels"][0] > 5.0 * judged(late, robot).rms["wheels"][0]


def test_a_camera_that_reports_late_is_allowed_for():
    log, robot = driven(ji.Effect("camera_latency", {"delay": 0.06}))
    found = judged(log, robot)
    assert found.sensor == pytest.approx(SENSOR, rel=1e-2)
    assert found.rms["wheels"][1] > 0.1
    assert found.rms["wheels_late"][1] < 0.02


def test_wheel_speeds_are_moved_within_each_run():
    log, _ = driven()
    moved = beside_poses(log, 2.0 * STEP)
    for then, now in zip(moved.runs(), log.runs(), strict=True):
        np.testing.assert_allclose(then.wheel_r[2:], now.wheel_r[:-2], atol=1e-12)
    assert beside_poses(log, 0.0) is log


def test_a_circle_is_followed_exactly():
    t = np.tile(STEP * np.arange(101), (1, 1))
    speeds = np.stack([np.full_like(t, 12.0), np.full_like(t, 8.0)])
    path = follow_wheels(SENSOR, t, speeds, np.zeros((1, 3)))[0]
    v, w = SENSOR.radius * 10.0, SENSOR.radius * 4.0 / SENSOR.track
    np.testing.assert_allclose(path[:, 2], w * t[0], atol=1e-12)
    np.testing.assert_allclose(path[:, 0], v / w * np.sin(w * t[0]), atol=1e-12)
    np.testing.assert_allclose(path[:, 1], v / w * (1.0 - np.cos(w * t[0])), atol=1e-12)


def test_a_stretch_without_a_wheel_speed_counts_for_nothing():
    log, robot = driven()
    blind = np.array(log.wheel_r)
    blind[ROWS + STARTS[0] + 5] = np.nan
    assert judged(log._replace(wheel_r=blind), robot).starts == len(STARTS) - 1


def test_nothing_is_told_without_wheels_or_without_motion():
    log, robot = driven()
    assert judged(log, robot, windows=SimpleNamespace(wheels=None)) is None
    assert judged(log, robot, judging=Starts(np.zeros(0, int), np.zeros(0, int))) is None
    assert sensor_by_stretches(log._replace(wheel_r=0.0 * log.t, wheel_l=0.0 * log.t), AHEAD) is None
    straight = log._replace(wheel_l=log.wheel_r)
    assert judged(straight, robot, fitted=straight) is None


def test_missing_poses_leave_radius_and_track():
    log, _ = driven()
    rare = np.arange(len(log.t)) % 3 > 0
    blind = log._replace(**{name: np.where(rare, np.nan, getattr(log, name)) for name in ("x", "y", "theta")})
    assert sensor_by_stretches(blind, AHEAD) == pytest.approx(SENSOR, rel=2e-2)

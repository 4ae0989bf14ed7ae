"""A camera that reports late: poses come late, wheel speeds do not, and both together tell it from a late robot."""

import dataclasses

import jax
import numpy as np
import pytest

import jaxident as ji
from jaxident.diagnosis.causes.finding import find_effects
from jaxident.diagnosis.motion.rims import rim_speeds, untold
from jaxident.diagnosis.motion.windows import cut
from jaxident.diagnosis.preparation.prepare import prepare
from jaxident.effects.coordinates import POSES_ONLY, vector_of
from jaxident.estimation.increments.observations import poses_only
from jaxident.log import join
from jaxident.robot.noise import Noise
from jaxident.robot.wheel_sensor import WheelSensor

STEP, ROWS = 0.05, 2
"""Time step [s], and rows by which the camera is late."""


def robot_with(*effects, noise=None, wheel_noise=0.0):
    made = [ji.Effect(name, {"delay": ROWS * STEP}) for name in effects]
    return dataclasses.replace(ji.load_model("published"), sample_period=STEP, effects=tuple(made), noise=noise,
                               wheels=WheelSensor(0.03, 0.1, wheel_noise))  # fmt: skip


def driven(robot, rows=320, key=None):
    """A log whose levels last 8 to 30 rows: were all as long, reading commands now and then would be a delay, too."""
    rng = np.random.default_rng(0)
    levels, lasting = rng.uniform(-1.0, 1.0, (rows // 8, 2)), rng.integers(8, 30, rows // 8)
    command = np.repeat(levels, lasting, axis=0)[:rows]
    made = ji.simulate(robot, ji.make_log(STEP * np.arange(rows), *command.T), key=key)
    return type(made)(*(None if column is None else np.asarray(column) for column in made))


def test_poses_come_late_and_wheel_speeds_do_not():
    plain, late = driven(robot_with()), driven(robot_with("camera_latency"))
    for now, then in zip(late.pose, plain.pose, strict=True):
        np.testing.assert_allclose(now[ROWS:], then[:-ROWS], atol=1e-9)
        assert np.abs(now - then).max() > 1e-3
    np.testing.assert_allclose(late.wheel_r, plain.wheel_r, atol=1e-9)
    np.testing.assert_allclose(late.wheel_l, plain.wheel_l, atol=1e-9)


def test_a_late_command_makes_both_late():
    plain, late = driven(robot_with()), driven(robot_with("transport_delay"))
    np.testing.assert_allclose(late.wheel_r[ROWS:], plain.wheel_r[:-ROWS], atol=1e-9)


def test_rims_of_a_diagnosis_are_without_it():
    windows = cut(join([driven(robot_with("camera_latency"))] * 3), 40)
    starts = np.zeros((2, 5, len(windows.run)))
    plain, late = rim_speeds(np.stack([vector_of(robot_with(*names)) for names in ((), ("camera_latency",))]),
                             starts, windows)  # fmt: skip
    np.testing.assert_array_equal(plain, late)


def test_logs_without_wheel_speeds_are_not_searched_for_it():
    log = driven(robot_with("camera_latency"))
    assert untold(cut(log, 40)) == frozenset()
    assert untold(cut(poses_only(log), 40)) == POSES_ONLY == {"camera_latency"}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["camera_latency", "transport_delay"])
def test_both_sensors_tell_a_late_camera_from_a_late_robot(name):
    log = driven(robot_with(name, noise=Noise(0.001, 0.005), wheel_noise=0.1), 900, jax.random.key(1))
    found = find_effects(prepare(log, None))[1]
    assert found.selected == (name,)
    other = frozenset({"camera_latency", "transport_delay"}) - {name}
    assert found.values[other] < -100.0
    assert find_effects(prepare(poses_only(log), None))[1].selected == ("transport_delay",)

"""The exported robot in MuJoCo on held-out commands, beside the model's own simulator."""

import numpy as np
import pytest

pytest.importorskip("mujoco", "3.5", reason="the extra mujoco is not installed, or without delays of actuators")

import jax
from export_gap import PERIOD, ROBOT, away, commands, drive, identified, truth

import jaxident as ji
from jaxident.effects.apply import with_effects
from jaxident.robot.drive import Physical


@pytest.mark.slow
def test_an_identified_robot_in_mujoco_is_as_near_to_the_truth_as_its_model():
    own, exported = identified()
    assert 0.05 < own < 5.0  # [mm] 1 s ahead
    assert exported < 1.1 * own


@pytest.mark.parametrize(
    "effects",
    [
        [("transport_delay", {"delay": 0.05}), ("motor_lag", {"time_constant": 0.06})],
        [("coulomb_friction", {"right": 0.08, "left": 0.06}), ("marker_offset", {"ahead": 0.02, "left": 0.01})],
        [("input_saturation", {"level": 0.6}), ("slope", {"acceleration": 0.05, "direction": 0.7})],
        [("backlash", {"right": 0.05, "left": 0.04}), ("asymmetric_dead_zone", {"right": 0.06, "left": 0.05})],
    ],
)  # fmt: skip
def test_effects_with_a_field_or_a_wrapper_close_the_gap(effects):
    """1 s ahead, the export of the nominal robot is more than 10 mm off and that with effects less than 1 mm."""
    model, u = with_effects(ROBOT, effects), commands(5)[:150]
    true = truth(model, u)
    assert away(drive(ji.export(ROBOT, "mjcf"), u, PERIOD), true) > 10.0
    assert away(drive(ji.export(model, "mjcf"), u, PERIOD), true) < 1.0


@pytest.mark.parametrize(
    ("rate", "gain"),
    [([14.0, 22.0], [[7.1, 6.9], [90.0, -88.0]]), ([1.6, 0.5], [[1.5, 1.4], [2.2, -2.1]])],
    ids=["strong", "slow"],
)
def test_strong_and_slow_robots_neither_slide_nor_tip(rate, gain):
    """Accelerations of 14 m/s^2 and time constants of 2 s."""
    model, u = ji.Model(PERIOD, Physical(np.array(rate), np.array(gain)), np.array([0.1, 0.1])), commands(4)[:120]
    true = truth(model, u)
    assert away(drive(ji.export(model, "mjcf"), u, PERIOD), true) < 1.0
    assert np.ptp(true[:, :2]) > 0.1


def test_the_published_robot_and_sizes_that_no_path_depends_on():
    model = ji.load_model("published")
    u = np.asarray(commands(3))[:120]
    paths = [drive(ji.export(model, "mjcf", mass=mass, wheel_radius=radius), u, model.sample_period)
             for mass, radius in ((1.0, None), (5.0, 0.02))]  # fmt: skip
    true = truth(model, u, jax.random.key(0))
    for path in paths:
        assert np.abs(path[:, :2] - true[:, :2]).max() < 1e-3

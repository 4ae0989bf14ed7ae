"""Every field that an export writes is one that its target reads.

Names are facts of the targets' own sources, looked up in November 2026: ros2_controllers
diff_drive_controller_parameter.yaml (branches humble, jazzy, and master of August 2026), gz-sim DiffDrive.cc,
OdometryPublisher.cc and WheelSlip.cc (July 2026), robot_localization params/ekf.yaml (March 2024), Isaac Lab
actuator_base_cfg.py and actuator_pd_cfg.py (2026).
"""

import ast
import importlib.util
from xml.etree import ElementTree

import numpy as np
import pytest

import jaxident as ji
from jaxident.effects.apply import with_effects
from jaxident.robot.drive import Physical
from jaxident.robot.model import Model
from jaxident.robot.noise import Noise

EVERY_FIELD = {
    "transport_delay": {"delay": 0.05}, "coulomb_friction": {"right": 0.1, "left": 0.05},
    "traction_limit": {"limit": 0.5}, "input_saturation": {"level": 0.8},
    "marker_offset": {"ahead": 0.02, "left": -0.01}, "heading_offset": {"offset": 0.05}, "lateral_slip": {"slip": 0.03},
}  # fmt: skip
"""Effects that one target or another has a field for."""
TOLD = {"limit": 1.0, "wheel_radius": 0.05, "track": 0.4}

DIFF_DRIVE = {"left_wheel_names", "right_wheel_names", "wheel_separation", "wheel_radius",
              "wheel_separation_multiplier", "left_wheel_radius_multiplier", "right_wheel_radius_multiplier",
              "twist_covariance_diagonal", "linear", "angular"}  # fmt: skip
LIMITS = {
    "humble": {"has_velocity_limits", "has_acceleration_limits", "max_velocity", "min_velocity", "max_acceleration",
               "min_acceleration"},
    "jazzy": {"max_velocity", "min_velocity", "max_acceleration", "max_deceleration", "max_acceleration_reverse",
              "max_deceleration_reverse"},
}  # fmt: skip
PLUGINS = {
    "DiffDrive": {"left_joint", "right_joint", "wheel_separation", "wheel_radius", "odom_publish_frequency",
                  *(f"{end}_{kind}_{what}" for end in ("min", "max") for kind in ("linear", "angular")
                    for what in ("velocity", "acceleration"))},
    "OdometryPublisher": {"odom_publish_frequency", "dimensions", "xyz_offset", "rpy_offset"},
    "WheelSlip": {"wheel"},
}  # fmt: skip
SLIPPING_WHEEL = {"slip_compliance_lateral", "slip_compliance_longitudinal", "wheel_normal_force", "wheel_radius"}
FILTER = {"frequency", "two_d_mode", "use_control", "control_timeout", "control_config", "acceleration_limits",
          "deceleration_limits", "acceleration_gains", "deceleration_gains", "process_noise_covariance"}  # fmt: skip
ACTUATOR = {"joint_names_expr", "stiffness", "damping", "armature", "friction", "dynamic_friction", "effort_limit"}
ACTUATORS = {"ImplicitActuatorCfg": ACTUATOR, "IdealPDActuatorCfg": ACTUATOR,
             "DelayedPDActuatorCfg": ACTUATOR | {"min_delay", "max_delay"}}  # fmt: skip

needs_yaml = pytest.mark.skipif(importlib.util.find_spec("yaml") is None, reason="PyYAML is not installed")


@pytest.fixture(scope="module")
def model() -> Model:
    drive = Physical(np.array([4.0, 6.0]), np.array([[1.2, 1.1], [9.0, -8.5]]), np.zeros(2))
    plain = Model(0.03, drive, np.array([0.1, 0.12]), Noise(5e-4, 2e-3, slip_along=0.02, slip_heading=0.3))
    return with_effects(plain, EVERY_FIELD.items())


def parameters(text: str, node: str) -> dict:
    import yaml

    return yaml.safe_load(text)[node]["ros__parameters"]


@needs_yaml
def test_ros2_control(model):
    told = parameters(ji.export(model, "ros2_control", **TOLD).text, "diff_drive_controller")
    assert set(told) <= DIFF_DRIVE
    for limits in (told["linear"]["x"], told["angular"]["z"]):
        assert set(limits) <= LIMITS["humble"] | LIMITS["jazzy"]
        assert set(limits) >= LIMITS["humble"]
        assert set(limits) >= {"max_velocity", "min_velocity", "max_acceleration", "max_deceleration"}
        assert limits["max_deceleration"] == limits["min_acceleration"] == -limits["max_acceleration"] < 0.0


@needs_yaml
def test_robot_localization(model):
    assert set(parameters(ji.export(model, "robot_localization", limit=1.0).text, "ekf_filter_node")) == FILTER


def test_gazebo(model):
    root = ElementTree.fromstring(ji.export(model, "gazebo", **TOLD).text)
    for plugin in root.iter("plugin"):
        kind = plugin.get("name").removeprefix("gz::sim::systems::")
        assert {entry.tag for entry in plugin} <= PLUGINS[kind]
    assert [{entry.tag for entry in wheel} for wheel in root.iter("wheel")] == [SLIPPING_WHEEL] * 2


def test_isaac(model):
    content = ast.literal_eval(ast.parse(ji.export(model, "isaac").text).body[1].value)
    for actuator in content["actuators"].values():
        assert set(actuator) - {"class"} <= ACTUATORS[actuator["class"]]
        assert actuator["class"] == "DelayedPDActuatorCfg"

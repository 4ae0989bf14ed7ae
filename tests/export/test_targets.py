"""Every target: its file is read by its own kind of parser, holds the model, and says what it does not hold."""

import ast
import csv
import dataclasses
import importlib.util
import io
import json
import math
from xml.etree import ElementTree

import numpy as np
import pytest
from support.exported import program

import jaxident as ji
from jaxident.effects.apply import with_effects
from jaxident.errors import InputError
from jaxident.export.export import TARGETS
from jaxident.robot.drive import Physical
from jaxident.robot.model import Discovered, Effect, Model, Provenance, Spread
from jaxident.robot.noise import Noise

DRIVE = Physical(np.array([4.0, 6.0]), np.array([[1.2, 1.1], [9.0, -8.5]]), np.array([0.02, -1.0]))
NOISE = Noise(position=5e-4, heading=2e-3, slip_along=0.02, slip_heading=0.3)
PLAIN = Model(0.03, DRIVE, np.array([0.1, 0.12]), NOISE)
HOSTILE = '*/ --> </model> """ \\ ??/ | \n- !!python/object: <script> $HEAD ]]>'
WITHIN = ("mjcf", "gazebo", "isaac", "ros2_control", "robot_localization")

needs_yaml = pytest.mark.skipif(importlib.util.find_spec("yaml") is None, reason="PyYAML is not installed")


def parsed_yaml(text: str):
    import yaml

    return yaml.safe_load(text)


def ways(made) -> dict[str, str]:
    return {part.name: part.how for part in made.parts}


def with_one(name, **values) -> Model:
    return with_effects(PLAIN, [(name, values)])


@pytest.mark.parametrize("target", TARGETS)
def test_every_part_is_told_and_names_from_a_model_file_do_no_harm(target):
    """Words of strangers stand in comments alone, and end none."""
    origin = Provenance(version=HOSTILE, method=HOSTILE, logs=(HOSTILE,))
    model = dataclasses.replace(with_one("turn_loss", loss=0.1), provenance=origin)
    made = ji.export(model, target)
    told = {"gain", "rate", "coupling", "dead zone", "camera noise", "random slip", "turn_loss"}
    assert {part.name for part in made.parts} == told
    for text in filter(None, (made.text, made.commands)):
        for sign in ("*/ -->", "script>", "!!", "\\ ", "$HEAD", "]]"):
            assert sign not in text
    readers = {
        "mjcf": ElementTree.fromstring,
        "gazebo": ElementTree.fromstring,
        "isaac": ast.parse,
        "python": ast.parse,
    }
    readers.get(target, str)(made.text)
    if made.commands is not None:
        assert "Robot" in program(made.commands)


def test_isaac_is_one_dictionary_and_nothing_else():
    tree = ast.parse(ji.export(PLAIN, "isaac").text)
    assert [type(node) for node in tree.body] == [ast.Expr, ast.Assign]
    content = ast.literal_eval(tree.body[1].value)
    for side in ("right", "left"):
        motor, own = content["actuators"][f"{side}_wheel"], content["speed_per_push"][side]
        assert motor["stiffness"] == 0.0
        assert motor["damping"] > 0.0
        assert own * content["body"]["wheel_radius"] == pytest.approx(0.575, rel=0.01)
        assert motor["joint_names_expr"] == [f"{side}_wheel_joint"]


def test_isaac_carries_delay_friction_and_a_push_limit():
    effects = {"transport_delay": {"delay": 0.05}, "coulomb_friction": {"right": 0.1, "left": 0.05},
               "traction_limit": {"limit": 0.5}, "motor_lag": {"time_constant": 0.05}}  # fmt: skip
    model = with_effects(PLAIN, effects.items())
    made = ji.export(model, "isaac")
    content = ast.literal_eval(ast.parse(made.text).body[1].value)
    right, left = (content["actuators"][f"{side}_wheel"] for side in ("right", "left"))
    assert right["class"] == "DelayedPDActuatorCfg"
    assert right["min_delay"] == right["max_delay"] == 50
    torque = right["damping"] * content["speed_per_push"]["right"]  # per unit of command, at rest
    assert right["friction"] == right["dynamic_friction"] == pytest.approx(0.1 * torque)
    assert left["friction"] < right["friction"]
    assert right["effort_limit"] == pytest.approx(0.5 * torque)
    assert ways(made)["motor_lag"] == "wrapper"
    assert {ways(made)[name] for name in ("transport_delay", "coulomb_friction", "traction_limit")} == {"field"}


def test_gazebo_has_the_elements_of_its_plugins():
    effects = {"marker_offset": {"ahead": 0.02, "left": -0.01}, "lateral_slip": {"slip": 0.03},
               "heading_offset": {"offset": 0.05}, "motor_lag": {"time_constant": 0.05}}  # fmt: skip
    model = with_effects(PLAIN, effects.items())
    made = ji.export(model, "gazebo", limit=1.0, wheel_radius=0.05, track=0.4)
    plugins = {one.get("name").split("::")[-1]: one for one in ElementTree.fromstring(made.text).iter("plugin")}
    assert set(plugins) == {"DiffDrive", "OdometryPublisher", "WheelSlip"}
    drive = {entry.tag: entry.text for entry in plugins["DiffDrive"]}
    assert float(drive["wheel_separation"]) == 0.4
    assert float(drive["wheel_radius"]) == 0.05
    speed = float(drive["max_linear_velocity"])
    assert float(drive["min_linear_velocity"]) == -speed
    assert float(drive["max_linear_acceleration"]) == pytest.approx(1.2 * 0.9 + 1.1 * 0.88)
    odometry = {entry.tag: entry.text for entry in plugins["OdometryPublisher"]}
    assert odometry["xyz_offset"] == "0.02 -0.01 0"
    assert odometry["rpy_offset"] == "0 0 0.05"
    assert ways(made)["camera noise"] == "not carried"
    wheel = {entry.tag: float(entry.text) for entry in plugins["WheelSlip"].find("wheel")}
    assert wheel["slip_compliance_lateral"] == pytest.approx(0.03 * 9.81 / (0.5 * speed))
    assert ways(made)["motor_lag"] == "wrapper"
    assert ways(made)["lateral_slip"] == "field"


def test_the_wrapper_of_gazebo_hands_on_the_models_own_speeds():
    made = ji.export(with_one("transport_delay", delay=0.06), "gazebo")
    robot = program(made.commands)["Robot"]()
    speeds = []
    for _ in range(100):
        robot.step(0.5, 0.5)
        speeds.append(robot.v)
    assert speeds[:2] == [0.0, 0.0]
    assert speeds[2] > 0.0
    assert robot.v == pytest.approx(robot.goal()[0], rel=1e-4)


@needs_yaml
def test_ros2_control_has_wheels_limits_and_covariance():
    made = ji.export(PLAIN, "ros2_control", wheel_radius=0.05, track=0.38, limit=1.0, command_unit="m/s")
    own = parsed_yaml(made.text)["diff_drive_controller"]["ros__parameters"]
    assert own["wheel_separation"] * own["wheel_separation_multiplier"] == pytest.approx(0.39526, rel=1e-3)
    assert own["wheel_separation"] == 0.38
    assert own["right_wheel_radius_multiplier"] == pytest.approx(0.57265, rel=1e-3)
    assert own["left_wheel_radius_multiplier"] == pytest.approx(0.57759, rel=1e-3)
    assert own["linear"]["x"]["max_acceleration"] == pytest.approx(1.2 * 0.9 + 1.1 * 0.88)
    assert own["angular"]["z"]["max_velocity"] > 2.0
    assert own["twist_covariance_diagonal"][0] == pytest.approx(0.02**2 / 8.0)
    assert own["twist_covariance_diagonal"][5] == pytest.approx(0.3**2 / 12.0)
    assert len(own["twist_covariance_diagonal"]) == 6


@needs_yaml
def test_ros2_control_without_more_knowledge_tells_the_ratio_of_the_wheels_alone():
    own = parsed_yaml(ji.export(PLAIN, "ros2_control").text)["diff_drive_controller"]["ros__parameters"]
    pair = own["left_wheel_radius_multiplier"], own["right_wheel_radius_multiplier"]
    assert sum(pair) == pytest.approx(2.0)
    assert pair[0] / pair[1] == pytest.approx(0.57759 / 0.57265, rel=1e-3)
    assert "linear" not in own


@needs_yaml
def test_robot_localization_predicts_by_the_models_rates():
    made = ji.export(with_one("input_saturation", level=0.8), "robot_localization")
    own = parsed_yaml(made.text)["ekf_filter_node"]["ros__parameters"]
    assert own["acceleration_gains"] == own["deceleration_gains"] == [4.0, 0.0, 0.0, 0.0, 0.0, 6.0]
    assert own["acceleration_limits"][0] == pytest.approx(1.2 * 0.7 + 1.1 * 0.68)
    matrix = np.reshape(own["process_noise_covariance"], (15, 15))
    assert matrix[6, 6] == pytest.approx(0.02**2)
    assert matrix[11, 11] == pytest.approx(0.3**2)
    assert (np.linalg.eigvalsh(matrix) > 0.0).all()
    assert np.count_nonzero(matrix - np.diag(np.diag(matrix))) == 0
    assert ways(made)["coupling"] == "not carried"
    robot = program(made.commands)["Robot"]()
    robot.step(0.6, 0.6)
    both = robot.goal()
    for _ in range(200):
        robot.step(0.6, 0.6)
    assert both == pytest.approx((robot.v, robot.w), abs=1e-9)


def test_the_table_holds_every_number_with_its_deviation():
    spread = Spread(dead_zone=np.array([0.01, np.nan]), physical=Physical(np.array([0.1, 0.2]), np.full((2, 2), 0.3)),
                    noise=Noise(1e-5, 1e-4))  # fmt: skip
    effect = Effect("transport_delay", {"delay": 0.05}, {"delay": 0.001})
    origin = Provenance(from_prior=("rate_1", "transport_delay.delay"))
    model = dataclasses.replace(PLAIN, standard_deviation=spread, effects=(effect,), provenance=origin)
    made = ji.export(model, "table")
    cells = [
        [cell.strip() for cell in line.split("|")[1:-1]] for line in made.text.splitlines() if line.startswith("| ")
    ]
    rows = {(row[0], row[1]): row[2:] for row in cells}
    assert rows["physical", "gain_21"] == ["9.0", "rad/s^2 per unit", "0.3", "yes"]
    assert rows["physical", "rate_1"] == ["4.0", "1/s", "0.1", "from the prior"]
    assert rows["physical", "coupling_1"][2:] == ["", "no"]
    assert rows["physical", "dead_zone_l"] == ["0.12", "unit", "", "no"]
    assert rows["transport_delay", "delay"] == ["0.05", "s", "0.001", "from the prior"]
    assert rows["noise", "slip_heading"][:2] == ["0.3", "rad/s^1.5"]
    assert {len(row) for row in cells} == {6}
    assert set(ways(made).values()) == {"field"}
    assert set(ways(ji.export(with_one("lost_commands", probability=0.1), "table")).values()) == {"field"}
    assert ways(ji.export(with_one("lost_commands", probability=0.1), "python"))["lost_commands"] == "not carried"


def test_the_table_as_csv_and_without_deviations(tmp_path):
    ji.export(PLAIN, "table", tmp_path / "table.csv")
    rows = list(csv.reader(io.StringIO((tmp_path / "table.csv").read_text())))
    assert rows[0] == ["part", "number", "value", "unit", "standard deviation", "determined"]
    assert {row[5] for row in rows[1:]} == {"not told"}
    assert ["physical", "rate_1", "4.0", "1/s", "", "not told"] in rows


def test_free_numerators_have_a_table_and_programs_and_nothing_else():
    free = dataclasses.replace(PLAIN, dynamics=PLAIN.difference)
    for target in ("python", "c-header", "table"):
        assert "0.03" in ji.export(free, target).text
    for target in WITHIN:
        with pytest.raises(InputError, match=r"physical: null.*free numerators"):
            ji.export(free, target)


def test_what_a_diagnosis_says_of_an_effect_is_what_stays(tmp_path):
    model = with_effects(PLAIN, [("turn_loss", {"loss": 0.1}), ("mass_offset", {"along": 0.01})])
    ji.save_model(model, tmp_path / "corrected_model.json")
    rows = [{"part": "turn_loss", "rms_position": 2.5}, {"part": "slip", "rms_position": 0.7}]
    content = {"schema": "jaxident.diagnosis/2", "account": {"rows": rows}}
    (tmp_path / "diagnosis.json").write_text(json.dumps(content))
    parts = {part.name: part for part in ji.export(tmp_path / "corrected_model.json", "mjcf").parts}
    assert (parts["turn_loss"].gap, parts["turn_loss"].source) == (2.5, "diagnosis.json")
    assert (parts["random slip"].gap, parts["random slip"].source) == (0.7, "diagnosis.json")
    assert parts["mass_offset"].source == "computed on a default input"
    assert 0.1 < parts["mass_offset"].gap < 100.0
    assert parts["camera noise"].gap is None
    (tmp_path / "diagnosis.json").write_text('{"schema": "jaxident.diagnosis/1"}')
    with pytest.raises(InputError, match="diagnosis/2"):
        ji.export(tmp_path / "corrected_model.json", "mjcf")


def test_a_limit_before_what_mixes_wheels_stands_in_the_wrapper():
    both = with_effects(PLAIN, [("input_saturation", {"level": 0.6}), ("supply_sag", {"resistance": 0.1})])
    assert ways(ji.export(both, "mjcf"))["input_saturation"] == "wrapper"
    soft = with_one("input_saturation", level=0.6, soft=1.0)
    assert ways(ji.export(soft, "mjcf"))["input_saturation"] == "wrapper", "its field cuts off"
    twice = with_one("motor_lag", time_constant=0.05, second_order=0.5)
    assert ways(ji.export(twice, "mjcf"))["motor_lag"] == "wrapper", "its field has one pole"
    late = with_effects(PLAIN, [("transport_delay", {"delay": 0.05}), ("gain_drift", {"rate": -0.02})])
    assert ways(ji.export(late, "mjcf"))["transport_delay"] == "wrapper"
    alone = with_one("input_saturation", level=0.6)
    made = ji.export(alone, "mjcf")
    motors = {one.get("name"): one for one in ElementTree.fromstring(made.text).iter("general")}
    assert motors["right"].get("ctrlrange") == "-0.5 0.5"
    assert ElementTree.fromstring(made.text).find("option").get("gravity") == "0.0 0.0 -9.81"


@pytest.mark.parametrize("limit", [0.0, -1.0, math.inf, math.nan])
def test_sizes_that_make_no_sense_are_refused(limit):
    with pytest.raises(InputError, match="limit"):
        ji.export(PLAIN, "gazebo", limit=limit)


def test_commands_that_come_minutes_late_are_refused():
    for target in ("c-header", "mjcf"):
        with pytest.raises(InputError, match="100 s at most"):
            ji.export(with_one("transport_delay", delay=1e9), target)


def test_unknown_targets_and_units_are_refused():
    with pytest.raises(InputError, match="mjcf, gazebo"):
        ji.export(PLAIN, "webots")
    with pytest.raises(InputError, match="rad/s"):
        ji.export(PLAIN, "ros2_control", command_unit="rpm")


def test_options_that_a_target_does_not_need_are_told():
    assert any("--track is not used" in line for line in ji.export(PLAIN, "mjcf", track=0.3).assumed)
    assert any("--mass is not used" in line for line in ji.export(PLAIN, "python", mass=2.0).assumed)
    assert not any("not used" in line for line in ji.export(PLAIN, "gazebo", track=0.3, mass=2.0).assumed)


@pytest.mark.parametrize("target", TARGETS)
def test_a_discovered_law_is_told_with_what_it_is_worth(target):
    """No target has a word for it but the table, which has its knots."""
    at = np.linspace(-3.0, 3.0, 7)
    law = Discovered("acceleration along", "v", "w", at, -0.3 * at**2)
    made = ji.export(dataclasses.replace(PLAIN, discovered=(law,)), target)
    (part,) = (part for part in made.parts if part.name == "discovered")
    if target == "table":
        assert part.how == "field"
        assert made.text.count("discovered: acceleration along") == len(at)
    else:
        assert part.how == "not carried"
        assert part.gap > 1.0


def test_the_table_tells_what_a_law_of_a_wheel_goes_by():
    at = np.linspace(-np.pi, np.pi, 5)
    law = Discovered("push of the left wheel", "1", "own angle", at, 0.1 * np.cos(at), period=0.19, half_track=-0.08)
    text = ji.export(dataclasses.replace(PLAIN, discovered=(law,)), "table").text
    rows = [line.split(" | ") for line in text.splitlines() if "discovered: push of the left wheel" in line]
    assert len(rows) == len(at) + 2
    assert [row[1:4] for row in rows[:2]] == [["period", "0.19", "m"], ["half_track", "-0.08", "m"]]

"""Actuator configurations for Isaac Lab: `--to isaac`, a Python file with one plain dictionary.

Names are those of `isaaclab.actuators` (ActuatorBaseCfg: stiffness, damping, armature, friction, dynamic_friction,
effort_limit; DelayedPDActuatorCfg: min_delay, max_delay in steps of the simulation). Isaac Lab 3 calls effort_limit
actuator_effort_limit and takes the old name until version 4. A wheel is driven
to a speed: torque = damping (target - speed), which is the model's motor. Friction is a torque [N m], as in Isaac Sim 5
and later. The file loads without Isaac.
"""

import math
from typing import Any

from jaxident.effects.catalogue import CATALOGUE
from jaxident.export.mjcf import GRAVITY, timestep
from jaxident.export.split import COMMANDS, COUPLING, DEAD_ZONE, FIELD, GAIN, RATE, Part, Target, values_of
from jaxident.export.text import number, origin
from jaxident.export.wheels import Robot, Wheel, body_of
from jaxident.robot.model import Model

TARGET = Target(
    "isaac", "Isaac Lab",
    {GAIN: "speed_per_push", RATE: "damping and body", COUPLING: "body", "delay": "min_delay, max_delay",
     "dry friction": "friction, dynamic_friction", "push limit": "effort_limit (a hard limit for the model's soft one)",
     "tilted floor": "gravity of SimulationCfg", "marker place": "pos of an OffsetCfg",
     "marker turn": "yaw of an OffsetCfg"},
    stages=COMMANDS, wraps=frozenset({DEAD_ZONE}), needs_wheels=True,
    uses=("wheel_radius", "mass"),
)  # fmt: skip


def write(model: Model, parts: list[Part], robot: Robot) -> str:
    """The text of the file."""
    fields = {part.name for part in parts if part.effect and part.how == FIELD}
    values = {CATALOGUE[one.name].quantity: values_of(one) for one in model.effects if one.name in fields}
    lines = "\n".join(origin(model))
    return (
        f'"""Actuators and masses of a differential-drive robot for Isaac Lab.\n\n{lines}\n{NOTES}"""\n\nROBOT = '
        + (_text(_content(model, robot, values), "") + "\n")
    )


NOTES = """
Each entry of "actuators" holds the arguments of the class that "class" names. Velocity target of a wheel [rad/s] =
speed_per_push * push; pushes are commands that have passed their dead zones (the commands' wrapper gives them).
"""


def _content(model: Model, robot: Robot, values: dict) -> dict[str, Any]:
    body, step = body_of(robot), timestep(model)
    slope = values.get("tilted floor", {"acceleration": 0.0, "direction": 0.0})
    g, angle = slope["acceleration"], slope["direction"]
    place, turn = values.get("marker place", {}), values.get("marker turn", {})
    return {
        "actuators": {f"{side}_wheel": _actuator(side, getattr(robot, side), robot, values, step)
                      for side in ("right", "left")},
        "speed_per_push": {side: getattr(robot, side).speed / robot.radius for side in ("right", "left")},
        "body": {
            "wheel_radius": robot.radius, "right_wheel_y": robot.right.place, "left_wheel_y": robot.left.place,
            "chassis_mass": body.mass, "chassis_center_of_mass": [0.0, body.left, 0.0],
            "chassis_inertia_zz": body.inertia, "wheel_mass": body.wheel_mass, "wheel_inertia_spin": body.wheel_spin,
            "wheel_inertia_turn": body.wheel_turn,
        },
        "simulation": {"dt": step, "gravity": [g * math.cos(angle), g * math.sin(angle), -GRAVITY]},
        "marker": {"pos": [place.get("ahead", 0.0), place.get("left", 0.0), 0.0], "yaw": turn.get("offset", 0.0)},
    }  # fmt: skip


def _actuator(side: str, wheel: Wheel, robot: Robot, values: dict, step: float) -> dict[str, Any]:
    torque = wheel.force * robot.radius
    friction = values.get("dry friction", {}).get(side, 0.0) * torque
    found: dict[str, Any] = {
        "class": "ImplicitActuatorCfg", "joint_names_expr": [f"{side}_wheel_joint"], "stiffness": 0.0,
        "damping": wheel.braking * robot.radius**2, "armature": 0.0, "friction": friction, "dynamic_friction": friction,
    }  # fmt: skip
    if "push limit" in values:
        found |= {"class": "IdealPDActuatorCfg", "effort_limit": values["push limit"]["limit"] * torque}
    if "delay" in values:
        late = round(values["delay"]["delay"] / step)
        found |= {"class": "DelayedPDActuatorCfg", "min_delay": late, "max_delay": late}
    return found


def _text(value: Any, indent: str) -> str:
    """A dictionary as Python writes it, one entry a line."""
    if isinstance(value, dict):
        inner = indent + "    "
        rows = "".join(f"{inner}{key!r}: {_text(entry, inner)},\n" for key, entry in value.items())
        return f"{{\n{rows}{indent}}}"
    if isinstance(value, list):
        return "[" + ", ".join(_text(entry, indent) for entry in value) + "]"
    return number(value) if isinstance(value, float) else repr(value)

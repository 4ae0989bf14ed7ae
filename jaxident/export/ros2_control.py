"""Parameters of ros2_control's diff_drive_controller: `--to ros2_control`, a YAML file.

Names as in ros2_controllers (wheel_separation, wheel_radius, wheel_separation_multiplier, left_ and
right_wheel_radius_multiplier, linear.x and angular.z limits, twist_covariance_diagonal). Limits have the names of
ROS 2 Jazzy and later, and beside them those that Humble and Iron read. The controller turns wanted speeds into wheel
speeds; the wrapper stands between it and the motors and makes up for what it does not know, by feed-forward and the
inverse of the dead zones.
"""

import numpy as np

from jaxident.export.ask import Ask, Reach
from jaxident.export.split import COUPLING, DEAD_ZONE, GAIN, RATE, SLIP, Target
from jaxident.export.text import number, origin
from jaxident.export.wheels import Robot
from jaxident.robot.model import Model, require_physical

TARGET = Target(
    "ros2_control", "diff_drive_controller",
    {GAIN: "wheel_separation_multiplier, left_ and right_wheel_radius_multiplier",
     "saturation": "max_velocity, max_acceleration", SLIP: "twist_covariance_diagonal"},
    stages=frozenset({"zone"}), wraps=frozenset({RATE, COUPLING, DEAD_ZONE}), needs_wheels=True,
    uses=("wheel_radius", "track", "limit", "command_unit"),
)  # fmt: skip
UNSEEN = "1.0e-06"
"""Variance of the speeds that a robot on a floor does not have."""


def write(model: Model, robot: Robot, ask: Ask, reach: Reach | None) -> str:
    """The text of the file."""
    lines = [f"# {line}" for line in origin(model)]
    lines += ["diff_drive_controller:", "  ros__parameters:"]
    rows = [
        ("left_wheel_names", '["left_wheel_joint"]'), ("right_wheel_names", '["right_wheel_joint"]'),
        ("wheel_separation", number(ask.track or robot.track)), ("wheel_radius", number(robot.radius)),
        ("wheel_separation_multiplier", number(robot.track / (ask.track or robot.track))),
        *_multipliers(robot, ask),
        *_covariance(model),
    ]  # fmt: skip
    lines += [f"    {name}: {value}" for name, value in rows]
    if reach is not None:
        lines += ["    linear:", *_limits("x", reach.v, reach.a_v), "    angular:", *_limits("z", reach.w, reach.a_w)]
    return "\n".join(lines) + "\n"


def _multipliers(robot: Robot, ask: Ask) -> list[tuple[str, str]]:
    """How much larger each wheel acts than told: of wheel speeds that were commanded; of a unit of the user's choice
    only the ratio of both wheels is known."""
    speeds = {"right": robot.right.speed, "left": robot.left.speed}
    mean = 0.5 * (robot.right.speed + robot.left.speed)
    whole = {"unit": mean, "rad/s": robot.radius, "m/s": 1.0}[ask.command_unit]
    return [(f"{side}_wheel_radius_multiplier", number(speeds[side] / whole)) for side in ("left", "right")]


def _covariance(model: Model) -> list[tuple[str, str]]:
    """Variance of speeds under random slip: its density over twice the rate at which the drive forgets it."""
    noise = model.noise
    if noise is None or not (noise.slip_along or noise.slip_heading):
        return []
    rate = np.asarray(require_physical(model).rate, float)
    along, heading = (0.5 * s**2 / r for s, r in zip((noise.slip_along, noise.slip_heading), rate, strict=True))
    row = ", ".join([number(along), *[UNSEEN] * 4, number(heading)])
    return [("twist_covariance_diagonal", f"[{row}]")]


def _limits(axis: str, speed: float, acceleration: float) -> list[str]:
    """Largest speed and acceleration of an axis both ways. A controller leaves out names that its version has not."""
    rows = [("max_velocity", number(speed)), ("min_velocity", number(-speed)),
            ("max_acceleration", number(acceleration)), ("max_deceleration", number(-acceleration))]  # fmt: skip
    older = [("has_velocity_limits", "true"), ("has_acceleration_limits", "true"),
             ("min_acceleration", number(-acceleration))]  # fmt: skip
    told = [f"        {name}: {value}" for name, value in rows]
    return [f"      {axis}:", *told, *(f"        {name}: {value}  # Humble and Iron" for name, value in older)]

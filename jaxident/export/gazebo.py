"""Plugins for a robot in Gazebo: `--to gazebo`, elements of a <model> of SDF.

Elements as in gz-sim: DiffDrive (left_joint, right_joint, wheel_separation, wheel_radius, limits of speed and
acceleration), OdometryPublisher (xyz_offset, rpy_offset, odom_publish_frequency), WheelSlip (slip_compliance_lateral
and what it needs). DiffDrive turns wheels at the speeds that it is told at once: the drive's own motion stands in the
wrapper, whose v and w go to cmd_vel. The publisher's gaussian_noise is added to speeds, never to poses (gz-sim,
OdometryPublisher.cc, July 2026), so no element carries the camera's noise.
"""

from jaxident.effects.catalogue import CATALOGUE
from jaxident.export.ask import Ask, Reach
from jaxident.export.mjcf import GRAVITY
from jaxident.export.split import (
    COUPLING,
    DEAD_ZONE,
    DRIVE,
    FIELD,
    GAIN,
    RATE,
    Part,
    Target,
    values_of,
)
from jaxident.export.text import number, origin
from jaxident.export.wheels import MASS, Robot
from jaxident.robot.model import Model

TARGET = Target(
    "gazebo", "Gazebo",
    {"marker place": "xyz_offset", "marker turn": "rpy_offset",
     "side slip": "slip_compliance_lateral (right at half the largest speed)"},
    stages=DRIVE - {"side"}, wraps=frozenset({GAIN, RATE, COUPLING, DEAD_ZONE}), needs_wheels=True,
    uses=("wheel_radius", "track", "mass", "limit"),
)  # fmt: skip
ORDINARY = 0.3
"""Speed [m/s] at which the compliance is right where no largest command is told: that of small robots indoors."""


def write(model: Model, parts: list[Part], robot: Robot, ask: Ask, reach: Reach | None) -> str:
    """The text of the elements, under one root."""
    fields = {part.name for part in parts if part.effect and part.how == FIELD}
    values = {CATALOGUE[one.name].quantity: values_of(one) for one in model.effects if one.name in fields}
    head = "\n".join(f"     {line}" for line in origin(model))
    blocks = [_drive(model, robot, ask, reach), _odometry(model, values)]
    if "side slip" in values:
        blocks.append(_slip(robot, ask, reach, values["side slip"]["slip"]))
    return (
        f'<?xml version="1.0"?>\n<!--\n{head}\n     Put these plugins into the <model> of the robot. -->\n'
        f'<sdf version="1.9">\n<model name="jaxident_robot">\n{"".join(blocks)}</model>\n</sdf>\n'
    )


def _plugin(kind: str, file: str, entries: list[tuple[str, str]]) -> str:
    rows = "".join(f"    <{name}>{value}</{name}>\n" for name, value in entries)
    return f'  <plugin filename="gz-sim-{file}-system" name="gz::sim::systems::{kind}">\n{rows}  </plugin>\n'


def _drive(model: Model, robot: Robot, ask: Ask, reach: Reach | None) -> str:
    entries = [
        ("left_joint", "left_wheel_joint"), ("right_joint", "right_wheel_joint"),
        ("wheel_separation", number(ask.track or robot.track)), ("wheel_radius", number(robot.radius)),
        ("odom_publish_frequency", number(1.0 / float(model.sample_period))),
    ]  # fmt: skip
    if reach is not None:
        names = ("linear_velocity", "angular_velocity", "linear_acceleration", "angular_acceleration")
        for name, value in zip(names, reach, strict=True):
            entries += [(f"min_{name}", number(-value)), (f"max_{name}", number(value))]
    return _plugin("DiffDrive", "diff-drive", entries)


def _odometry(model: Model, values: dict) -> str:
    place, turn = values.get("marker place", {}), values.get("marker turn", {})
    return _plugin("OdometryPublisher", "odometry-publisher", [
        ("odom_publish_frequency", number(1.0 / float(model.sample_period))), ("dimensions", "2"),
        ("xyz_offset", f"{number(place.get('ahead', 0.0))} {number(place.get('left', 0.0))} 0"),
        ("rpy_offset", f"0 0 {number(turn.get('offset', 0.0))}"),
    ])  # fmt: skip


def _slip(robot: Robot, ask: Ask, reach: Reach | None, slip: float) -> str:
    """Sideways speed c v w against compliance times v times lateral over normal force, v w / g."""
    speed = ORDINARY if reach is None else 0.5 * reach.v
    rows = [
        ("slip_compliance_lateral", number(slip * GRAVITY / speed)), ("slip_compliance_longitudinal", "0"),
        ("wheel_normal_force", number(0.5 * GRAVITY * (ask.mass or MASS))), ("wheel_radius", number(robot.radius)),
    ]  # fmt: skip
    inside = "".join(f"      <{name}>{value}</{name}>\n" for name, value in rows)
    wheels = "".join(f'    <wheel link_name="{side}_wheel">\n{inside}    </wheel>\n' for side in ("left", "right"))
    return f'  <plugin filename="gz-sim-wheel-slip-system" name="gz::sim::systems::WheelSlip">\n{wheels}  </plugin>\n'

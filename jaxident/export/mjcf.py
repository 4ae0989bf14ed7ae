"""A complete robot for MuJoCo: `--to mjcf`.

Chassis on a free joint, two driven wheels, two smooth castors, a floor. Attributes as in MuJoCo's XML reference:
`general` actuators with gainprm, biasprm (braking in proportion to speed), ctrlrange, forcerange, dyntype filterexact
with dynprm, delay with nsample (recent versions); joints with frictionloss; sites. Controls are pushes of the right and
left wheel: commands that have passed their dead zones. The wheels' contacts are damped without springs (a negative
solreffriction), as wheels otherwise creep sideways in curves.
"""

import math

from jaxident.effects.catalogue import CATALOGUE
from jaxident.export.split import COMMANDS, COUPLING, DEAD_ZONE, FIELD, GAIN, RATE, Part, Target, values_of
from jaxident.export.text import number, origin
from jaxident.export.wheels import Body, Robot, Wheel, body_of
from jaxident.robot.model import Model

TARGET = Target(
    "mjcf", "MJCF",
    {GAIN: "gainprm", RATE: "biasprm and the masses", COUPLING: "the masses", "saturation": "ctrlrange",
     "delay": "delay, nsample", "lag": "dyntype, dynprm", "dry friction": "frictionloss",
     "push limit": "forcerange (a hard limit for the model's soft one)", "tilted floor": "gravity",
     "marker place": "site pos", "marker turn": "site euler"},
    stages=COMMANDS, wraps=frozenset({DEAD_ZONE}), needs_wheels=True,
    uses=("wheel_radius", "mass"),
)  # fmt: skip
LONGEST_STEP = 1e-3
"""[s] of the engine; halving it moved no path of the tests by a tenth of a millimetre."""
GRAVITY = 9.81
GRIP = 10.0
"""Coefficient of friction of the wheels: they do not slide, as in a model without slip. At 3, one of 14 m/s^2 did."""
GRASP = 1.8
"""Damping of slip at the wheels, in 1 / timestep: little creep, still stable."""
DELAY_NOTE = "The delay of the actuators needs MuJoCo 3.5 or later."
STIFF, CLOSE = "0.002 1", "0.95 0.99 0.0005"
"""solref and solimp of the contacts: a time constant of two steps, a tenth of a millimetre deep."""


def timestep(model: Model) -> float:
    """The engine's step [s], so that a row of the model's logs is a whole number of steps."""
    period = float(model.sample_period)
    return period / math.ceil(period / LONGEST_STEP)


def write(model: Model, parts: list[Part], robot: Robot) -> str:
    """The text of the model: the parts with a field of their own in it."""
    fields = {part.name for part in parts if part.effect and part.how == FIELD}
    values = {CATALOGUE[one.name].quantity: values_of(one) for one in model.effects if one.name in fields}
    body, step = body_of(robot), timestep(model)
    notes = ["ctrl: pushes of the right and the left wheel.", *([DELAY_NOTE] if "delay" in values else [])]
    head = "\n".join(f"     {line}" for line in (*origin(model), *notes))
    wheels = "".join(_wheel(robot, body, side, values) for side in ("right", "left"))
    motors = "".join(_motor(model, robot, side, values, step) for side in ("right", "left"))
    tyres = "".join(_tyre(side, step) for side in ("right", "left"))
    ahead, left = (values.get("marker place", {}).get(key, 0.0) for key in ("ahead", "left"))
    turn = math.degrees(values.get("marker turn", {}).get("offset", 0.0))
    return f"""<mujoco model="jaxident_robot">
  <!--
{head}
  -->
  <option timestep="{number(step)}" integrator="implicitfast" cone="elliptic" impratio="100" gravity="{
        _gravity(robot, body, values)
    }"/>
  <default><geom solref="{STIFF}" solimp="{CLOSE}"/></default>
  <worldbody>
    <light pos="0 0 3" dir="0 0 -1"/>
    <geom name="floor" type="plane" size="10 10 0.1" rgba="0.8 0.8 0.8 1"/>
    <body name="chassis" pos="0 0 {number(robot.radius)}">
      <freejoint/>
{_chassis(robot, body)}
      <site name="marker" pos="{number(ahead)} {number(left)} 0" euler="0 0 {number(turn)}"/>
{wheels}    </body>
  </worldbody>
  <contact>
{tyres}  </contact>
  <actuator>
{motors}  </actuator>
</mujoco>
"""


def _gravity(robot: Robot, body: Body, values: dict) -> str:
    """Gravity of a floor that is not level, as large as it moves the robot, whose wheels also have to spin."""
    slope = values.get("tilted floor", {"acceleration": 0.0, "direction": 0.0})
    size = slope["acceleration"] * float(robot.masses[0, 0]) / (body.mass + 2.0 * body.wheel_mass)
    along, across = size * math.cos(slope["direction"]), size * math.sin(slope["direction"])
    return f"{number(along)} {number(across)} {number(-GRAVITY)}"


def _chassis(robot: Robot, body: Body) -> str:
    """Masses and castors. Only the inertia about the vertical axis takes part in the motion; the centre of mass lies at
    the height of the floor, so that no push lifts a wheel or a castor."""
    across = max(body.inertia, 0.25 * body.mass * robot.track**2)
    ball, far = 0.4 * robot.radius, max(0.5 * robot.track, 1.5 * robot.radius)
    middle = 0.5 * (robot.right.place + robot.left.place)
    castors = "\n".join(
        f'      <geom name="castor_{name}" type="sphere" size="{number(ball)}" pos="{number(x)} {number(middle)} '
        f'{number(ball - robot.radius)}" mass="0" condim="1" priority="1"/>'
        for name, x in (("front", far), ("rear", -far))
    )
    return (
        f'      <inertial pos="0 {number(body.left)} {number(-robot.radius)}" mass="{number(body.mass)}" '
        f'diaginertia="{number(across)} {number(across)} {number(body.inertia)}"/>\n{castors}'
    )


def _own(robot: Robot, side: str) -> Wheel:
    return getattr(robot, side)


def _wheel(robot: Robot, body: Body, side: str, values: dict) -> str:
    wheel = _own(robot, side)
    friction = values.get("dry friction", {}).get(side, 0.0) * wheel.force * robot.radius
    return f"""      <body name="wheel_{side}" pos="0 {number(wheel.place)} 0">
        <inertial pos="0 0 0" mass="{number(body.wheel_mass)}" diaginertia="{number(body.wheel_turn)} {
        number(body.wheel_spin)
    } {number(body.wheel_turn)}"/>
        <joint name="wheel_{side}" axis="0 1 0" frictionloss="{number(friction)}"
               solreffriction="{STIFF}" solimpfriction="{CLOSE}"/>
        <geom name="tyre_{side}" type="ellipsoid" size="{number(robot.radius)} {number(0.25 * robot.radius)} {
        number(robot.radius)
    }" mass="0" contype="0" conaffinity="0"/>
      </body>
"""


def _tyre(side: str, step: float) -> str:
    return (
        f'    <pair geom1="floor" geom2="tyre_{side}" condim="3" friction="{GRIP} {GRIP} 0 0 0" solref="{STIFF}" '
        f'solimp="{CLOSE}" solreffriction="-1 {number(-GRASP / step)}"/>\n'
    )


def _motor(model: Model, robot: Robot, side: str, values: dict, step: float) -> str:
    """Torque per push, less braking; both at the axle."""
    wheel, found = _own(robot, side), ""
    torque = wheel.force * robot.radius
    if "saturation" in values:
        width = float(model.dead_zone[0 if side == "right" else 1])
        most = number(max(values["saturation"]["level"] - width, 0.0))
        found += f' ctrllimited="true" ctrlrange="-{most} {most}"'
    if "push limit" in values:
        most = number(values["push limit"]["limit"] * torque)
        found += f' forcelimited="true" forcerange="-{most} {most}"'
    if "lag" in values:
        found += f' dyntype="filterexact" dynprm="{number(values["lag"]["time_constant"])}"'
    if "delay" in values:
        late = values["delay"]["delay"]
        found += f' delay="{number(late)}" nsample="{math.ceil(late / step) + 2}"'
    return (
        f'    <general name="{side}" joint="wheel_{side}" gaintype="fixed" gainprm="{number(torque)}" '
        f'biastype="affine" biasprm="0 0 {number(-wheel.braking * robot.radius**2)}"{found}/>\n'
    )

"""The MJCF of a differential-drive robot: chassis, two driven wheels on springs, two slippery castors, one floor.

The plain robot is near the nominal model: the motors brake in proportion to their speed, contact is stiff, the castors
are free of friction, the masses are balanced about the axle. Every hidden effect is a change of `Body` or of the
engine's world, never of the equations of the package.

The springs keep a sliding wheel's load what it is. The engine solves load and friction of a contact as one convex
problem, which presses a wheel the more the faster it slides: rigidly mounted, the wheels of a robot with little grip
hopped, their load swung by its own size, and halving the engine's step moved the path by millimetres. A wheel that is
light beside what presses it cannot be pressed so: it moves away instead.
"""

from typing import NamedTuple

TIMESTEP, GRAVITY = 1e-3, 9.81
STIFF, CLOSE = "0.002 1", "0.95 0.99 0.0005"
GRASP = 1.8 / TIMESTEP
"""Damping of slip at the wheels [1/s]. The engine holds them without the turning of their axes, which lets them creep
outwards at v w (1 / damping - step / 2): little at this value, which is still stable."""

SPRING, CARRIED = 200.0, 0.6
"""Stiffness under each wheel [N/m], and how much of the chassis both carry."""


class Body(NamedTuple):
    """Sizes [m], masses [kg], inertias [kg m^2], torques [N m] and their changes, at their plain values."""

    radius: float = 0.03
    track: float = 0.16
    mass: float = 0.6
    gyration: float = 0.05
    wheel_mass: float = 0.02
    rotor: float = 2e-5
    torque: tuple[float, float] = (0.012, 0.012)  # per unit of command: right, left
    braking: tuple[float, float] = (9e-4, 9e-4)  # [N m s]
    grip: float = 1.0  # coefficient of friction of the wheels
    tilt: tuple[float, float] = (0.0, 0.0)  # of gravity: sines of the floor's angles along x and y
    ahead: float = 0.0  # of the centre of mass
    dry: tuple[float, float] = (0.0, 0.0)  # friction of the wheels' joints [N m]
    play: tuple[float, float] = (0.0, 0.0)  # of the gears [rad]
    limit: float = 0.0  # of the motors' torque, that is of their current; 0 for none
    lag: float = 0.0  # time constant of the current [s]
    air: float = 0.0  # density of the medium [kg/m^3]
    marker: tuple[float, float] = (0.0, 0.0)  # ahead, left
    turned: float = 0.0  # the marker [rad]


def world(body: Body) -> str:
    """The whole model as text."""
    gravity = f"{GRAVITY * body.tilt[0]:.9g} {GRAVITY * body.tilt[1]:.9g} {-GRAVITY:.9g}"
    ball = 0.4 * body.radius
    wheels, tyres, actuators, tendons = "", "", "", ""
    for k, side in enumerate("rl"):
        wheels += _wheel(body, k, side)
        tyres += (
            f'<pair geom1="floor" geom2="tyre_{side}" condim="3" friction="{body.grip} {body.grip} 0 0 0" '
            f'solref="{STIFF}" solimp="{CLOSE}" solreffriction="-1 {-GRASP}"/>'
        )
        actuators += _motor(body, k, side)
        tendons += _gear(body, k, side)
    castors = "".join(
        f'<geom type="sphere" size="{ball}" pos="{x} 0 {ball - body.radius}" mass="0" condim="1" priority="1"/>'
        for x in (-0.07, 0.07)
    )
    inertia = body.mass * body.gyration**2
    ahead, left = body.marker
    return f"""<mujoco>
 <option timestep="{TIMESTEP}" integrator="implicitfast" cone="elliptic" impratio="100"
  density="{body.air}" gravity="{gravity}"/>
 <default><geom solref="{STIFF}" solimp="{CLOSE}"/></default>
 <worldbody>
  <geom name="floor" type="plane" size="5 5 0.1"/>
  <body name="chassis" pos="0 0 {body.radius}"><freejoint/>
   <inertial pos="{body.ahead} 0 0" mass="{body.mass}" diaginertia="{inertia} {inertia} {inertia}"/>
   <site name="marker" pos="{ahead} {left} 0" euler="0 0 {57.29577951308232 * body.turned}"/>
   {castors}{wheels}
  </body>
 </worldbody>
 <contact>{tyres}</contact>
 <tendon>{tendons}</tendon>
 <actuator>{actuators}</actuator>
</mujoco>"""


def _wheel(body: Body, k: int, side: str) -> str:
    """A wheel, with its rotor on the same shaft or, with play, beside it: the rotor's inertia is its joint's, for so
    light a body with it would be a huge box to the air."""
    place = (-0.5 if side == "r" else 0.5) * body.track
    loose = body.play[k] > 0.0
    on_shaft = 0.0 if loose else body.rotor
    critical, pressed = 2.0 * (SPRING * body.wheel_mass) ** 0.5, 0.5 * CARRIED * body.mass * GRAVITY / SPRING
    wheel = (
        f'<body pos="0 {place} 0"><joint type="slide" axis="0 0 1" stiffness="{SPRING}" damping="{critical}" '
        f'springref="{-pressed}"/><joint name="hinge_{side}" axis="0 1 0" armature="{on_shaft}" '
        f'frictionloss="{body.dry[k]}"/><geom name="tyre_{side}" type="ellipsoid" mass="{body.wheel_mass}" '
        f'size="{body.radius} 0.008 {body.radius}"/></body>'
    )
    rotor = (
        f'<body pos="0 {0.5 * place} 0"><joint name="rotor_{side}" axis="0 1 0" armature="{body.rotor}"/>'
        '<inertial pos="0 0 0" mass="1e-4" diaginertia="1e-9 1e-9 1e-9"/></body>'
    )
    return wheel + rotor * loose


def _motor(body: Body, k: int, side: str) -> str:
    """Torque per unit of command less that per speed of its shaft (back-EMF), limited or late where asked."""
    joint = f"{'rotor' if body.play[k] > 0.0 else 'hinge'}_{side}"
    late = f'dyntype="filterexact" dynprm="{body.lag}"' if body.lag > 0.0 else ""
    limit = f'forcelimited="true" forcerange="{-body.limit} {body.limit}"' if body.limit > 0.0 else ""
    return (
        f'<general joint="{joint}" gainprm="{body.torque[k]}" biastype="affine" biasprm="0 0 {-body.braking[k]}" '
        f"{late} {limit}/>"
    )


def _gear(body: Body, k: int, side: str) -> str:
    """Teeth: the rotor's angle stays within the play of the wheel's."""
    half = 0.5 * body.play[k]
    return (
        f'<fixed limited="true" range="{-half} {half}" solreflimit="{STIFF}">'
        f'<joint joint="rotor_{side}" coef="1"/><joint joint="hinge_{side}" coef="-1"/></fixed>'
    ) * (half > 0.0)

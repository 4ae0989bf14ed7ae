"""What an export may be told beside the model, and what it then assumes."""

from typing import NamedTuple

import numpy as np

from jaxident.effects.catalogue import CATALOGUE
from jaxident.errors import InputError
from jaxident.export.split import Target, values_of
from jaxident.export.wheels import MASS, RADIUS_PER_TRACK, Robot
from jaxident.robot.model import Model, require_physical

UNITS = ("unit", "rad/s", "m/s")
"""What the commands of the model's logs may be: of the user's choice, or wheel speeds at the axle or at the rim."""


class Ask(NamedTuple):
    """wheel_radius, track [m], mass [kg]: the robot's own, None where not told. limit: the largest command, in the unit
    of the model's logs, None where not told. command_unit: one of UNITS."""

    wheel_radius: float | None = None
    track: float | None = None
    mass: float | None = None
    limit: float | None = None
    command_unit: str = UNITS[0]


class Reach(NamedTuple):
    """Largest speeds [m/s], [rad/s] and accelerations [m/s^2], [rad/s^2], along and in heading."""

    v: float
    w: float
    a_v: float
    a_w: float


def check(ask: Ask) -> None:
    """InputError for a size that is not positive and for an unknown unit."""
    for name in ("wheel_radius", "track", "mass", "limit"):
        value = getattr(ask, name)
        if value is not None and not 0.0 < value < np.inf:
            raise InputError(f"{name.replace('_', '-')} {value:g}: should be a finite number above 0")
    if ask.command_unit not in UNITS:
        raise InputError(f"command unit {ask.command_unit!r}: should be one of {', '.join(UNITS)}")


def largest_command(model: Model, ask: Ask) -> float | None:
    """The largest command: as told, or where the model saturates; None where neither says."""
    if ask.limit is not None:
        return ask.limit
    levels = [values_of(one)["level"] for one in model.effects if CATALOGUE[one.name].quantity == "saturation"]
    return levels[0] if levels and np.isfinite(levels[0]) else None


def reach(model: Model, ask: Ask) -> Reach | None:
    """What the largest commands lead to: both wheels forward, and against each other."""
    most = largest_command(model, ask)
    if most is None:
        return None
    drive = require_physical(model)
    push = np.maximum(most - np.asarray(model.dead_zone, float), 0.0)
    gain, rate = np.asarray(drive.gain, float), np.asarray(drive.rate, float)
    coupling = np.zeros(2) if drive.coupling is None else np.asarray(drive.coupling, float)
    steady = np.linalg.solve(np.diag(rate) - np.diag(coupling)[:, ::-1], gain)
    forward, spin = push, push * np.array([1.0, -1.0])
    return Reach(*map(float, (steady[0] @ forward, steady[1] @ spin, gain[0] @ forward, gain[1] @ spin)))


def unused(ask: Ask, target: Target) -> list[str]:
    """Sentences on options that were given and that the target does not need."""
    given = [name for name in Ask._fields if getattr(ask, name) != getattr(Ask(), name)]
    names = [name for name in given if name not in (*target.uses, "limit")]
    return [f"--{name.replace('_', '-')} is not used: {target.title} does not need it" for name in names]


def assumed(ask: Ask, robot: Robot, target: Target) -> list[str]:
    """Sentences on what was taken where the model and the options say nothing."""
    lines = [f"the model's own track is {1e3 * robot.track:.4g} mm: wheels at this distance that roll without slip "
             "move like this"]  # fmt: skip
    middle = 0.5 * (robot.left.place + robot.right.place)
    if abs(middle) > 1e-3 * robot.track:
        side = "right" if middle > 0.0 else "left"
        lines.append(
            f"the tracked point lies {1e3 * abs(middle):.3g} mm to the {side} of the middle between the wheels"
        )
    if ask.wheel_radius is None:
        lines.append(f"wheel radius {1e3 * robot.radius:.4g} mm is assumed ({RADIUS_PER_TRACK:g} of the track): a "
                     "model of speeds does not tell it; --wheel-radius")  # fmt: skip
    if ask.mass is None and "mass" in target.uses:
        lines.append(f"mass {MASS:g} kg is assumed: no path depends on it; --mass")
    if not robot.coupled:
        lines.append("no masses give the coupling of speed and turn rate: it is left out")
    return lines

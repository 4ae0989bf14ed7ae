"""Parameters of robot_localization's filters: `--to robot_localization`, a YAML file.

Names as in the package's ekf.yaml: use_control, control_config, acceleration_limits and _gains, deceleration_limits and
_gains, process_noise_covariance. The filter predicts v' = gain (control - v), which is the model's rate; its noise is a
density per second, as the model's slip is. What it takes for control are the speeds that commands lead to: `goal()` of
the wrapper.
"""

import numpy as np

from jaxident.export.ask import Reach
from jaxident.export.split import CAMERA, COMMANDS, DEAD_ZONE, GAIN, RATE, SLIP, Target
from jaxident.export.text import number, origin
from jaxident.robot.model import Model, require_physical

TARGET = Target(
    "robot_localization", "robot_localization",
    {RATE: "acceleration_gains, deceleration_gains", SLIP: "process_noise_covariance",
     CAMERA: "not in this file: covariance of the pose messages, see its comment"},
    stages=COMMANDS, wraps=frozenset({GAIN, DEAD_ZONE}), uses=("limit",),
)  # fmt: skip
STATES = 15
"""x, y, z, roll, pitch, yaw, their rates, and three accelerations, in the filter's order."""
SPEED, TURN = 6, 11
UNSEEN = 1e-9
"""Density of the states that have no noise of their own: small, so that the covariance stays positive."""
UNLIMITED = 1e6
"""Acceleration above every robot's, where no largest command is told."""


def write(model: Model, reach: Reach | None) -> str:
    """The text of the file."""
    rate = np.asarray(require_physical(model).rate, float)
    limits = (UNLIMITED, UNLIMITED) if reach is None else (reach.a_v, reach.a_w)
    lines = [f"# {line}" for line in origin(model)]
    if model.noise is not None:
        p, h = float(model.noise.position) ** 2, float(model.noise.heading) ** 2
        lines.append(f"# Covariance of pose messages: {number(p)} for x and y [m^2], {number(h)} for yaw [rad^2].")
    rows = [
        ("frequency", number(1.0 / float(model.sample_period))), ("two_d_mode", "true"), ("use_control", "true"),
        ("control_timeout", number(2.0 * float(model.sample_period))),
        ("control_config", "[true, false, false, false, false, true]"),
        *((f"{kind}_limits", _pair(*limits)) for kind in ("acceleration", "deceleration")),
        *((f"{kind}_gains", _pair(*rate)) for kind in ("acceleration", "deceleration")),
        ("process_noise_covariance", _covariance(model)),
    ]  # fmt: skip
    lines += ["ekf_filter_node:", "  ros__parameters:", *(f"    {name}: {value}" for name, value in rows)]
    return "\n".join(lines) + "\n"


def _pair(along: float, heading: float) -> str:
    """Values of vx and vyaw among the six controls."""
    return f"[{', '.join([number(along), *['0.0'] * 4, number(heading)])}]"


def _covariance(model: Model) -> str:
    """The matrix, row by row."""
    diagonal = np.full(STATES, UNSEEN)
    if model.noise is not None:
        diagonal[SPEED] = max(float(model.noise.slip_along) ** 2, UNSEEN)
        diagonal[TURN] = max(float(model.noise.slip_heading) ** 2, UNSEEN)
    rows = [", ".join(number(value) for value in row) for row in np.diag(diagonal)]
    gap = "\n" + " " * 6
    return f"[{gap}{f',{gap}'.join(rows)}]"

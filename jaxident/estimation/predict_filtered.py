"""Free runs from a filtered state, with a band from everything that is known to be uncertain.

The start state is that of the extended Kalman filter over the rows before it. Its covariance, the slip to come and,
where the model has it, the covariance of the parameters are carried along the free run to first order.
"""

from typing import Any

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Pose, State
from jaxident.estimation.joint_start import at_the_end, parameter_covariance
from jaxident.estimation.joint_step import PARAMETERS, advance_belief
from jaxident.estimation.parameters import Law, Robot, to_vector
from jaxident.estimation.runs import Runs
from jaxident.robot.model import Model, require_physical
from jaxident.robot.noise import Noise

FORGOTTEN = 200
"""Rows after which a filter with slip has forgotten where it began."""


def filter_rows(model: Model, burn_in: int) -> int | None:
    """How many rows before a start its filter takes in; None for a model whose noise law is not known.

    With slip the filter forgets by itself. Without, it trusts the model for ever: the burn-in alone then bounds how
    far small errors of the model pile up.
    """
    noise = model.noise
    if model.physical is None or noise is None or not (float(noise.position) > 0.0 and float(noise.heading) > 0.0):
        return None
    slips = float(noise.slip_along) > 0.0 or float(noise.slip_heading) > 0.0
    return max(burn_in, FORGOTTEN) if slips else burn_in


def run_ahead_filtered(model: Model, window: Any, before: int) -> tuple[Pose, Pose]:
    """Poses (rows - before - 1,) after the start of a window, and their standard deviations; pure.

    window: t, command, pose and known (rows,), the start at row `before`.
    """
    drive, noise = require_physical(model), model.noise or Noise()
    vector = to_vector(Robot(drive, model.dead_zone, noise), Law())[:PARAMETERS]
    covariance = jnp.zeros((PARAMETERS, PARAMETERS))
    if model.covariance is not None:
        logarithmic = jnp.concatenate([jnp.exp(-vector[:2]), jnp.ones(PARAMETERS - 2)])
        covariance = parameter_covariance(model) * logarithmic * logarithmic[:, None]
    step = jnp.diff(window.t)
    early = jax.tree.map(lambda column: column[: before + 1], (window.command, window.pose, window.known))
    first = jnp.argmax(window.known)
    x, y, theta = (column[first] for column in window.pose)
    run = Runs(step[: before + 1], *early)
    belief = at_the_end(vector, covariance, run, State(x, y, theta, 0.0, 0.0), noise, drive.coupling)

    def body(belief, row):
        step, command = row
        belief = advance_belief(belief, command, step, noise, drive.coupling, None)
        return belief, (belief.mean[:3], jnp.diagonal(belief.covariance)[:3])

    command: Array = jnp.stack(window.command, axis=1)[before:-1]
    _, (pose, variance) = jax.lax.scan(body, belief, (step[before:], command))
    return Pose(*pose.T), Pose(*jnp.sqrt(jnp.maximum(variance, 0.0)).T)

"""Where the joint filter begins: maximum likelihood on the first seconds, or a model with its covariance."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array, RobotMatrix, RobotVector, Wheels
from jaxident.array_types import State as Motion
from jaxident.errors import InputError
from jaxident.estimation.online.joint_step import PARAMETERS
from jaxident.estimation.poses.filter import Belief, first_belief, scan_filter
from jaxident.estimation.poses.maximum_likelihood import fit_runs
from jaxident.estimation.poses.parameters import NAMES, Law, Robot, to_vector
from jaxident.estimation.poses.prior import no_prior
from jaxident.estimation.poses.runs import Runs
from jaxident.robot.dead_zone import effective_command
from jaxident.robot.drive import Physical, force, hold
from jaxident.robot.model import Model, require_physical
from jaxident.robot.noise import Noise

WIDE = (1.0, 1.0, 1.0, 10.0, 10.0)
"""Standard deviations of a state before any pose is seen [m, m, rad, m/s, rad/s]: wider than any robot meant here."""


def begin_from_run(run: Runs, d_max: Array, law: Law) -> tuple[Belief, Noise, RobotVector, Array]:
    """Belief, noise law, and widest variances (PARAMETERS,) after a setup run (rows,), and whether the fit arrived and
    told every parameter better than its widest variance does: from a ridge the filter does not find back.

    Given the parameters, the state at the end is that of the filter over the run; its slopes by the parameters carry
    their covariance over. Nothing is linearised about a poor estimate, which is what biases a joint filter that
    starts from nothing (Ljung 1979).
    """
    runs = jax.tree.map(lambda leaf: jnp.asarray(leaf)[None] if jnp.ndim(leaf) else jnp.asarray(leaf), run)
    fit = fit_runs(runs, d_max, law, no_prior())
    vector, noise = to_vector(fit.robot, law)[:PARAMETERS], fit.robot.noise
    widest = widest_variance(vector, d_max)
    wide = fit.covariance[:PARAMETERS, :PARAMETERS]
    told = jnp.all(jnp.diagonal(wide) < widest * natural_scale(vector) ** 2)
    covariance = narrowed(wide, vector, widest)

    belief = at_the_end(vector, covariance, run, Motion(*fit.starts[0]), noise, None)
    return belief, noise, widest, fit.ok & told


@jax.jit
def at_the_end(
    vector: RobotVector, covariance: RobotMatrix, run: Runs, start: Motion, noise: Noise, coupling
) -> Belief:
    """State and parameters after the last pose of a run (rows,): parameters (PARAMETERS,) and their covariance from
    elsewhere, the state from the poses; `start` is where its filter is linearised before the first pose."""

    def state(vector):
        drive = Physical(jnp.exp(vector[:2]), vector[2:6].reshape(2, 2), coupling)
        pull = force(drive, effective_command(Wheels(*run.command), vector[6:8]))
        solution = hold(drive, run.step if jnp.ndim(run.step) == 0 else run.step[:-1])
        belief, _ = scan_filter(solution, pull, unsure(start, noise), noise, run)
        return belief.mean, (belief.mean, belief.covariance)

    slope, (mean, own) = jax.jacfwd(state, has_aux=True)(vector)
    across = slope @ covariance
    whole = jnp.block([[own + across @ slope.T, across], [across.T, covariance]])
    return Belief(jnp.concatenate([mean, vector]), whole)


def begin_from_model(model: Model, d_max: Array) -> tuple[Belief, Noise, RobotVector]:
    """Belief, noise law and widest variances (PARAMETERS,) of a model with covariance; its state is still unknown."""
    drive, noise = require_physical(model), model.noise
    if model.covariance is None:
        raise InputError("covariance: null; a recursion needs to know how sure the model is")
    if noise is None or not (noise.position > 0.0 and noise.heading > 0.0):
        raise InputError("noise: a recursion needs the camera's position and heading deviations, above 0")
    vector = to_vector(Robot(drive, model.dead_zone, noise), Law())[:PARAMETERS]
    widest = widest_variance(vector, d_max)
    covariance = narrowed(parameter_covariance(model), vector, widest)
    state = unsure(Motion(0.0, 0.0, 0.0, 0.0, 0.0), noise)
    between = jnp.zeros((len(state.mean), PARAMETERS))
    whole = jnp.block([[state.covariance, between], [between.T, covariance]])
    return Belief(jnp.concatenate([state.mean, vector]), whole), noise, widest


def parameter_covariance(model: Model) -> RobotMatrix:
    """Covariance (PARAMETERS, PARAMETERS) of the rates, gains and dead zones of a physical model, natural units."""
    rows = np.array([model.parameter_order.index(name) for name in NAMES[:PARAMETERS]])
    return jnp.asarray(model.covariance)[np.ix_(rows, rows)]


def unsure(state: Motion, noise: Noise) -> Belief:
    """A belief about a state of which next to nothing is known."""
    belief = first_belief(Motion(*(jnp.asarray(part, float) for part in state)), noise)
    return belief._replace(covariance=belief.covariance.at[:5, :5].set(jnp.diag(jnp.array(WIDE) ** 2)))


def widest_variance(vector: RobotVector, d_max: Array) -> RobotVector:
    """The variance (PARAMETERS,) that no parameter exceeds: a factor e in a rate, the larger gain of its row, half the
    bound of a dead zone."""
    gain = jnp.max(jnp.abs(vector[2:6].reshape(2, 2)), axis=1)
    return jnp.concatenate([jnp.ones(2), jnp.repeat(gain, 2), jnp.full(2, 0.5 * d_max)]) ** 2


def narrowed(covariance: RobotMatrix, vector: RobotVector, widest: RobotVector) -> RobotMatrix:
    """A covariance (PARAMETERS, PARAMETERS) in natural units as that of a vector, no wider than the widest: a
    parameter that the setup did not show gets a variance that the filter can compute with."""
    natural = natural_scale(vector)
    scale = natural * jnp.sqrt(jnp.maximum(widest, 1e-300))
    values, vectors = jnp.linalg.eigh(covariance / scale / scale[:, None])
    values = jnp.maximum(values, 0.0)
    back = scale / natural
    return (vectors * (values / (1.0 + values))) @ vectors.T * back * back[:, None]


def natural_scale(vector: RobotVector) -> RobotVector:
    """Natural units (PARAMETERS,) per unit of a vector, whose rates are logarithms."""
    return jnp.concatenate([jnp.exp(vector[:2]), jnp.ones(PARAMETERS - 2)])

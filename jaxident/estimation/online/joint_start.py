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
from jaxident.estimation.poses.parameters import NAMES, Law, Robot, names, to_vector
from jaxident.estimation.poses.prior import no_prior
from jaxident.estimation.poses.runs import Runs
from jaxident.robot.dead_zone import effective_command
from jaxident.robot.drive import Physical, force, hold
from jaxident.robot.model import Model, require_physical
from jaxident.robot.noise import Noise

SENSOR = ("wheel_radius", "wheel_track")
"""What is known of the sensor of wheel speeds, as logarithms before the parameters."""
WIDE = (1.0, 1.0, 1.0, 10.0, 10.0)
"""Standard deviations of a state before any pose is seen [m, m, rad, m/s, rad/s]: wider than any robot meant here."""


def begin_from_run(run: Runs, d_max: Array, law: Law) -> tuple[Belief, Noise, RobotVector, Array, Array | None]:
    """Belief, noise law, and widest variances (PARAMETERS,) after a setup run (rows,), whether the fit arrived and
    told every parameter better than its widest variance does (from a ridge the filter does not find back), and the
    noise of the wheel speeds, None where the law has none.

    Given the parameters, the state at the end is that of the filter over the run; its slopes by the parameters carry
    their covariance over. Nothing is linearised about a poor estimate, which is what biases a joint filter that
    starts from nothing (Ljung 1979).
    """
    runs = jax.tree.map(lambda leaf: jnp.asarray(leaf)[None] if jnp.ndim(leaf) else jnp.asarray(leaf), run)
    fit = fit_runs(runs, d_max, law, no_prior())
    whole, noise = to_vector(fit.robot, law), fit.robot.noise
    places = jnp.array([names(law).index(name) for name in (*(SENSOR if law.wheels else ()), *NAMES[:PARAMETERS])])
    vector, widest = whole[places], widest_variance(whole[:PARAMETERS], d_max)
    own = fit.covariance[places][:, places] / jnp.outer(natural := natural_scale(vector), natural)
    told = jnp.all(jnp.diagonal(own)[-PARAMETERS:] < widest)
    covariance = narrowed(own, widest)

    belief = at_the_end(vector, covariance, run, Motion(*fit.starts[0]), noise, None)
    wheel_noise = fit.robot.wheels.noise if law.wheels else None
    return belief, noise, widest, fit.ok & told, wheel_noise


@jax.jit
def at_the_end(
    vector: RobotVector, covariance: RobotMatrix, run: Runs, start: Motion, noise: Noise, coupling
) -> Belief:
    """State, sensor of the wheels if any, and parameters after the last pose of a run (rows,): sensor and parameters,
    (2 + PARAMETERS,) or (PARAMETERS,), and their covariance from elsewhere, the state from the poses; `start` is where
    its filter is linearised before the first pose."""

    def state(vector):
        vector = vector[-PARAMETERS:]
        drive = Physical(jnp.exp(vector[:2]), vector[2:6].reshape(2, 2), coupling)
        pull = force(drive, effective_command(Wheels(*run.command), vector[6:8]))
        solution = hold(drive, run.step if jnp.ndim(run.step) == 0 else run.step[:-1])
        belief, _ = scan_filter(solution, pull, unsure(start, noise), noise, run)
        return belief.mean, (belief.mean, belief.covariance)

    slope, (mean, own) = jax.jacfwd(state, has_aux=True)(vector)
    across = slope @ covariance
    whole = jnp.block([[own + across @ slope.T, across], [across.T, covariance]])
    return Belief(jnp.concatenate([mean, vector]), whole)


def begin_from_model(model: Model, d_max: Array) -> tuple[Belief, Noise, RobotVector, Array | None]:
    """Belief, noise law and widest variances (PARAMETERS,) of a model with covariance, whose state is still unknown;
    and the noise of its wheel speeds, None for a model without."""
    drive, noise = require_physical(model), model.noise
    if model.covariance is None:
        raise InputError("covariance: null; a recursion needs to know how sure the model is")
    if noise is None or not (noise.position > 0.0 and noise.heading > 0.0):
        raise InputError("noise: a recursion needs the camera's position and heading deviations, above 0")
    sensor = model.wheels if model.wheels is not None and float(model.wheels.noise) > 0.0 else None
    law = Law(wheels=sensor is not None)
    whole = to_vector(Robot(drive, model.dead_zone, noise, sensor), law)
    order = (*(SENSOR if law.wheels else ()), *NAMES[:PARAMETERS])
    vector, widest = whole[jnp.array([names(law).index(name) for name in order])], widest_variance(whole, d_max)
    natural = natural_scale(vector)
    covariance = narrowed(parameter_covariance(model, order) / jnp.outer(natural, natural), widest)
    state = unsure(Motion(0.0, 0.0, 0.0, 0.0, 0.0), noise)
    between = jnp.zeros((len(state.mean), len(vector)))
    both = jnp.block([[state.covariance, between], [between.T, covariance]])
    return Belief(jnp.concatenate([state.mean, vector]), both), noise, widest, sensor and jnp.asarray(sensor.noise)


def parameter_covariance(model: Model, order: tuple[str, ...]) -> RobotMatrix:
    """Covariance (n, n) of some parameters of a physical model in natural units; 0 for a sensor that is taken for
    known."""
    known = [k for k, name in enumerate(order) if name in model.parameter_order]
    rows = np.array([model.parameter_order.index(order[k]) for k in known])
    found = np.zeros((len(order), len(order)))
    found[np.ix_(known, known)] = np.asarray(model.covariance)[np.ix_(rows, rows)]
    return jnp.asarray(found)


def unsure(state: Motion, noise: Noise) -> Belief:
    """A belief about a state of which next to nothing is known."""
    belief = first_belief(Motion(*(jnp.asarray(part, float) for part in state)), noise)
    return belief._replace(covariance=belief.covariance.at[:5, :5].set(jnp.diag(jnp.array(WIDE) ** 2)))


def widest_variance(vector: RobotVector, d_max: Array) -> RobotVector:
    """The variance (PARAMETERS,) that no parameter exceeds: a factor e in a rate, the larger gain of its row, half the
    bound of a dead zone."""
    gain = jnp.max(jnp.abs(vector[2:6].reshape(2, 2)), axis=1)
    return jnp.concatenate([jnp.ones(2), jnp.repeat(gain, 2), jnp.full(2, 0.5 * d_max)]) ** 2


def narrowed(covariance: RobotMatrix, widest: RobotVector) -> RobotMatrix:
    """A covariance (n, n) of a vector, its last PARAMETERS no wider than the widest, a sensor's logarithms than 1: a
    parameter that the setup did not show gets a variance that the filter can compute with."""
    scale = jnp.sqrt(jnp.maximum(jnp.concatenate([jnp.ones(len(covariance) - PARAMETERS), widest]), 1e-300))
    values, vectors = jnp.linalg.eigh(covariance / scale / scale[:, None])
    values = jnp.maximum(values, 0.0)
    return (vectors * (values / (1.0 + values))) @ vectors.T * scale * scale[:, None]


def natural_scale(vector: RobotVector) -> RobotVector:
    """Natural units (n,) per unit of a vector, whose rates and lengths of a sensor are logarithms."""
    logs = len(vector) - PARAMETERS + 2
    return jnp.concatenate([jnp.exp(vector[:logs]), jnp.ones(PARAMETERS - 2)])

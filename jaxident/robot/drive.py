"""How commands become speeds: the linear drive in physical parameters, solved exactly over a held command.

    [v, w]' = -rate * [v, w] + coupling * [w, v] + gain [m_r, m_l]        l' = v        theta' = w
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax.scipy.linalg import expm

from jaxident.array_types import Array, State, Wheels
from jaxident.numerics import GAUSS_NODES, GAUSS_WEIGHTS, hold_integrals, sin_cos


class Physical(NamedTuple):
    """Continuous-time parameters of the drive; the robot itself, whatever the camera's period.

    rate (2,) [1/s]; gain (2, 2) [m/s^2 and rad/s^2 per unit of command], rows v, w, columns right, left;
    coupling (2,) [m/s^2 per rad/s, rad/s^2 per m/s], or None for a robot without: the cheaper program.
    """

    rate: Any
    gain: Any
    coupling: Any = None


class Force(NamedTuple):
    """Acceleration that the motors ask for along [m/s^2] and in heading [rad/s^2]; scalars or (samples,)."""

    along: Any
    heading: Any


class Response(NamedTuple):
    """One quantity as a weighted sum of what a step starts with; None where a weight is zero by construction."""

    v: Any
    w: Any
    along: Any
    heading: Any


class Hold(NamedTuple):
    """Exact solution over one step of held force: speeds and turn at its end, speed and turn at each Gauss node."""

    step: Any
    v: Response
    w: Response
    turn: Response
    node_v: tuple[Response, ...]
    node_turn: tuple[Response, ...]


def force(physical: Physical, passed: Wheels) -> Force:
    """gain [m_r, m_l]: the acceleration from what passed the dead zones; same shape as the commands."""
    (along_r, along_l), (heading_r, heading_l) = physical.gain
    return Force(
        along_r * passed.right + along_l * passed.left,
        heading_r * passed.right + heading_l * passed.left,
    )


def hold(physical: Physical, step: Array) -> Hold:
    """The exact solution over a step [s]; a step of shape (samples,) gives weights (samples,), one set per row."""
    responses = _diagonal_responses if physical.coupling is None else _coupled_responses
    v, w, turn = responses(physical, step)
    nodes = [responses(physical, node * step) for node in GAUSS_NODES]
    return Hold(step, v, w, turn, tuple(n[0] for n in nodes), tuple(n[2] for n in nodes))


def advance(state: State, pull: Force, solution: Hold) -> State:
    """The state one step later.

    Speeds and heading are exact. The position integral of v(s) [cos, sin] theta(s) takes four Gauss nodes: error
    below 1e-9 m for a turn of up to one radian within the step.
    """
    start = (state.v, state.w, pull.along, pull.heading)
    along_x, along_y = 0.0, 0.0
    for weight, node_v, node_turn in zip(GAUSS_WEIGHTS, solution.node_v, solution.node_turn, strict=True):
        sine, cosine = sin_cos(state.theta + _weigh(node_turn, start))
        v = _weigh(node_v, start)
        along_x, along_y = along_x + weight * v * cosine, along_y + weight * v * sine
    return State(
        state.x + solution.step * along_x,
        state.y + solution.step * along_y,
        state.theta + _weigh(solution.turn, start),
        _weigh(solution.v, start),
        _weigh(solution.w, start),
    )


def _weigh(response: Response, start: tuple) -> Array:
    return sum(weight * value for weight, value in zip(response, start, strict=True) if weight is not None)


def _diagonal_responses(physical: Physical, time: Array) -> tuple[Response, Response, Response]:
    """v, w and turn after `time` without coupling: two first-order lags, in closed form."""
    decay_v, once_v, _ = hold_integrals(physical.rate[0], time)
    decay_w, once_w, twice_w = hold_integrals(physical.rate[1], time)
    return (
        Response(decay_v, None, once_v, None),
        Response(None, decay_w, None, once_w),
        Response(None, once_w, None, twice_w),
    )


def _coupled_responses(physical: Physical, time: Array) -> tuple[Response, Response, Response]:
    """v, w and turn after `time` with coupling: blocks of one matrix exponential (Van Loan 1978)."""
    rate, coupling = physical.rate, physical.coupling
    system = jnp.array([[-rate[0], coupling[0]], [coupling[1], -rate[1]]])
    unit, zero = jnp.eye(2), jnp.zeros((2, 2))
    augmented = jnp.block([[system, unit, zero], [zero, zero, unit], [zero, zero, zero]])
    blocks = jnp.vectorize(lambda t: expm(augmented * t), signature="()->(n,n)")(time)
    decay, once, twice = (jnp.moveaxis(blocks[..., :2, 2 * k : 2 * k + 2], (-2, -1), (0, 1)) for k in range(3))
    return (
        Response(decay[0, 0], decay[0, 1], once[0, 0], once[0, 1]),
        Response(decay[1, 0], decay[1, 1], once[1, 0], once[1, 1]),
        Response(once[1, 0], once[1, 1], twice[1, 0], twice[1, 1]),
    )


def steady_speed(physical: Physical, pull: Force) -> jax.Array:
    """Speeds [v, w] at which the drive settles under a constant force."""
    coupling = jnp.zeros(2) if physical.coupling is None else physical.coupling
    system = jnp.array([[physical.rate[0], -coupling[0]], [-coupling[1], physical.rate[1]]])
    return jnp.linalg.solve(system, jnp.array([pull.along, pull.heading]))

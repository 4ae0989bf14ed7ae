"""How commands become speeds: the linear drive in physical parameters, solved exactly over a held command.

[v, w]' = -rate * [v, w] + coupling * [w, v] + gain [m_r, m_l]        l' = v        theta' = w
"""

import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, State, Wheels
from jaxident.numerics import GAUSS_NODES, GAUSS_WEIGHTS, add_pairs, hold_integrals, safe_divide, sin_cos

DOUBLINGS = 8
TERMS = 12
TYPICAL_RATE = 3.0
"""A rate [1/s] at which speeds of robots from 5 cm to 5 m settle: the middle of 0.3 to 30."""

Matrix = tuple[tuple[Any, Any], tuple[Any, Any]]
"""A 2 x 2 matrix by its entries, each of any shape."""

Pair = tuple[Any, Any]
"""x + y B, a function of the matrix m + B, by its two numbers."""


class Physical(NamedTuple):
    """Continuous-time parameters of the drive; the robot itself, whatever the camera's period.

    Attributes:
        rate: of the speed along and of the turn rate (2,) [1/s].
        gain: (2, 2) [m/s^2 and rad/s^2 per unit of command]; rows v and w, columns right and left.
        coupling: how each speed acts on the other (2,) [m/s^2 per rad/s, rad/s^2 per m/s]; None for a robot without,
            which is the cheaper program.
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


def to_wheels(drive: Physical, along: Array, heading: Array) -> Wheels:
    """gain^-1 [along, heading]: what at the wheels [unit] gives these accelerations; 0 for a singular gain."""
    (a, b), (c, d) = drive.gain
    determinant = a * d - b * c
    return Wheels(
        safe_divide(d * along - b * heading, determinant, 0.0), safe_divide(a * heading - c * along, determinant, 0.0)
    )


def wheel_speeds(drive: Physical, v: Array, w: Array) -> Wheels:
    """Speed of each wheel as the command that holds it."""
    return to_wheels(drive, drive.rate[0] * v, drive.rate[1] * w)


def rim_motion(drive: Physical, v: Array, w: Array, excess: Wheels) -> tuple[Array, Array]:
    """Speed [m/s] and turn rate [rad/s] of the rims of both wheels, where the robot has v and w: v + (gain e) / rate.

    e, `excess`: by how much each wheel turns faster than the ground, as the command that holds that speed. Coupling is
    left out, as in `wheel_speeds`. All of one shape."""
    faster = force(drive, excess)
    return v + faster.along / drive.rate[0], w + faster.heading / drive.rate[1]


def hold(physical: Physical, step: Array) -> Hold:
    """The exact solution over a step [s]; a step of shape (samples,) gives weights (samples,), one set per row."""
    *nodes, (v, w, turn) = responses(physical, step, (*GAUSS_NODES, 1.0))
    return Hold(step, v, w, turn, tuple(n[0] for n in nodes), tuple(n[2] for n in nodes))


def responses(physical: Physical, step: Array, parts: tuple[float, ...]) -> list[tuple[Response, Response, Response]]:
    """The exact responses of v, w and turn after each of the `parts` of a step [s]: a list of triples, one per part,
    each weight of the step's shape."""
    solve = _diagonal_responses if physical.coupling is None else _coupled_responses
    times = jnp.asarray(parts).reshape(-1, *[1] * jnp.ndim(step)) * step
    return _split(solve(physical, times), len(parts))


def _split(stacked, count: int) -> list:
    """A tree of arrays with a leading axis of `count`, as that many trees."""
    return [jax.tree.map(lambda leaf, k=k: leaf[k], stacked) for k in range(count)]


def advance(state: State, pull: Force, solution: Hold) -> State:
    """The state one step later.

    Speeds and heading are exact. The position integral of v(s) [cos, sin] theta(s) takes four Gauss nodes: error
    below 1e-9 m for a turn of up to one radian within the step.
    """
    start = (state.v, state.w, pull.along, pull.heading)
    along_x, along_y = [], []
    for weight, node_v, node_turn in zip(GAUSS_WEIGHTS, solution.node_v, solution.node_turn, strict=True):
        sine, cosine = sin_cos(state.theta + weigh(node_turn, start))
        v = weight * weigh(node_v, start)
        along_x.append(v * cosine)
        along_y.append(v * sine)
    mean_x, mean_y = add_pairs(along_x, along_y)
    return State(
        state.x + solution.step * mean_x,
        state.y + solution.step * mean_y,
        state.theta + weigh(solution.turn, start),
        weigh(solution.v, start),
        weigh(solution.w, start),
    )


def weigh(response: Response, start: tuple) -> Array:
    """The response to what a step starts with, `start` (v, w, force along, force in heading)."""
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
    """v, w and turn after `time` with coupling: exp(A t), its integral P and its double integral Q over [0, t].

    Taylor series at t / 2^8, then doubling: P(2s) = P + E P, Q(2s) = Q + s P + E Q (scaling and squaring, Higham
    2008, chapter 10). E is kept as D = E - 1, doubled by D(2s) = 2 D + D D: next to 1 its digits would be lost, and
    every doubling doubles that loss. All are functions of one matrix A = m + B with m half its trace, and so, B B
    being a number times the identity, each is x + y B: two numbers in place of four, and a product of five terms. Plain
    arithmetic maps over any shape; batched calls of the library's matrix exponential do not, and stall on the CPU.
    """
    rate, coupling = physical.rate, physical.coupling
    middle, lean = -0.5 * (rate[0] + rate[1]), 0.5 * (rate[1] - rate[0])
    square = lean * lean + coupling[0] * coupling[1]
    s = time / 2.0**DOUBLINGS
    once, twice = _exponential_series((middle, 1.0 + jnp.zeros_like(middle)), square, s)
    change = _multiply((middle * s, s), once, square)
    once, twice = _scale(s, once), _scale(s * s, twice)

    def double(_, now):
        change, once, twice, s = now
        twice = _add(_add(_scale(2.0, twice), _scale(s, once)), _multiply(change, twice, square))
        once = _add(_scale(2.0, once), _multiply(change, once, square))
        return _add(_scale(2.0, change), _multiply(change, change, square)), once, twice, 2.0 * s

    change, once, twice, _ = jax.lax.fori_loop(0, DOUBLINGS, double, (change, once, twice, s))

    def entries(pair: Pair) -> Matrix:
        x, y = pair
        return (x + y * lean, y * coupling[0]), (y * coupling[1], x - y * lean)

    decay, force, turn = entries((1.0 + change[0], change[1])), entries(once), entries(twice)
    return Response(*decay[0], *force[0]), Response(*decay[1], *force[1]), Response(*force[1], *turn[1])


def _exponential_series(system: Pair, square: Array, s: Array) -> tuple[Pair, Pair]:
    """sum over k of (A s)^k / (k + j)! for j = 1, 2, by Horner's rule."""
    weights = jnp.array([[1.0 / math.factorial(k + j) for j in (1, 2)] for k in range(TERMS)])
    matrix = _scale(s, system)
    zero = jnp.zeros_like(s)

    def add_term(k, sums):
        weight = weights[TERMS - 1 - k]
        pairs = (_multiply(matrix, one, square) for one in sums)
        return tuple((x + weight[j], y) for j, (x, y) in enumerate(pairs))

    return jax.lax.fori_loop(0, TERMS, add_term, ((zero, zero), (zero, zero)))


def _multiply(a: Pair, b: Pair, square: Array) -> Pair:
    """(a0 + a1 B) (b0 + b1 B) where B B is `square`."""
    return a[0] * b[0] + square * a[1] * b[1], a[0] * b[1] + a[1] * b[0]


def _add(a: Pair, b: Pair) -> Pair:
    return a[0] + b[0], a[1] + b[1]


def _scale(factor: Array, pair: Pair) -> Pair:
    return factor * pair[0], factor * pair[1]

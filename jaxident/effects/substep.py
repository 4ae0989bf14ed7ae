"""One substep of the full simulator: the exact solution of the linear drive plus the departure from it.

With y the nominal solution under held force, known exactly, the state is y + d with d' = A d + N(y + d), d = 0 at the
start, N what the effects add. d takes one step of Lawson's exponential Runge-Kutta method of order four (Lawson 1967,
SIAM J. Numer. Anal. 4): where no effect is in force N is exactly zero, and so is d.
"""

from typing import Any, NamedTuple

import jax.numpy as jnp

from jaxident.array_types import Array, State, Wheels
from jaxident.effects.contact import lateral_slip, slope, traction_limit
from jaxident.effects.drive import dry_friction, friction_level, mass_offset, quadratic_drag, turn_loss
from jaxident.effects.input_chain import Push
from jaxident.effects.time import payload_change
from jaxident.numerics import GAUSS_NODES, GAUSS_WEIGHTS, safe_divide, sin_cos
from jaxident.robot.drive import Force, Physical, Response, force, responses, weigh


class Motion(NamedTuple):
    """Speeds and heading, or a departure from them, or its rate of change."""

    v: Any
    w: Any
    theta: Any


class Part(NamedTuple):
    """Exact responses of speed, turn rate and turn after a part of a substep."""

    v: Response
    w: Response
    turn: Response


class Solution(NamedTuple):
    """The linear drive over a substep [s]: at its Gauss nodes, its middle and its end."""

    step: Any
    nodes: tuple[Part, ...]
    middle: Part
    end: Part


def solve(drive: Physical, step: Array) -> Solution:
    """The exact solution over a substep of any shape."""
    *nodes, middle, end = (Part(*part) for part in responses(drive, step, (*GAUSS_NODES, 0.5, 1.0)))
    return Solution(step, tuple(nodes), middle, end)


def move(settings, drive: Physical, state: State, push: Push, slip: Force, changed: Array, solved: Solution) -> State:
    """The state one substep later, under a push, a random slip (acceleration) and before or after a payload change."""
    pull, ramp = force(drive, push.mean), force(drive, push.slope)
    pull = Force(pull.along + slip.along, pull.heading + slip.heading)
    lightness = payload_change(changed, settings["payload_change"]["ratio"])

    def departure(part: float, now: Motion) -> Motion:
        return _departure(settings, drive, now, pull, Force(*((part - 0.5) * f for f in ramp)), lightness)

    rubbed = pull
    for _ in range(2):  # friction moves what the departure depends on, and the other way round
        first, last, d = _runge_kutta(drive, departure, state, rubbed, solved)
        friction = _friction(settings, drive, state, pull, d, lightness, solved)
        rubbed = Force(pull.along + friction.along, pull.heading + friction.heading)
    end = _nominal(solved.end, state, rubbed)
    x, y = _travel(settings, state, rubbed, (first, last, d), solved)
    return State(state.x + solved.step * x, state.y + solved.step * y, end.theta + d.theta, end.v + d.v, end.w + d.w)


def _departure(settings, drive: Physical, now: Motion, pull: Force, ramp: Force, lightness: Array) -> Motion:
    """N: acceleration with all effects less that of the linear drive under the held pull."""
    v, w, theta = now
    along, heading = (linear + held + more for linear, held, more in zip(_linear(drive, v, w), pull, ramp, strict=True))
    asked = to_wheels(drive, along, heading)
    taken = Wheels(*(traction_limit(c, settings["traction_limit"]["limit"]) for c in asked))
    lost = force(drive, Wheels(taken.right - asked.right, taken.left - asked.left))
    smooth = (
        quadratic_drag(v, w, **settings["quadratic_drag"]),
        mass_offset(v, w, **settings["mass_offset"]),
        turn_loss(v, w, **settings["turn_loss"]),
        slope(theta, **settings["slope"]),
    )
    more = Force(*(sum(parts[1:], parts[0]) for parts in zip(*smooth, strict=True)))
    return Motion(
        ramp.along + lightness * lost.along + (lightness - 1.0) * along + more.along,
        ramp.heading + lightness * lost.heading + (lightness - 1.0) * heading + more.heading,
        jnp.zeros_like(theta),
    )


def _runge_kutta(
    drive: Physical, departure, state: State, pull: Force, solved: Solution
) -> tuple[Motion, Motion, Motion]:
    """Rates of change of the departure at the start and the end of the substep, and the departure at its end."""
    h = solved.step
    middle, end = _nominal(solved.middle, state, pull), _nominal(solved.end, state, pull)
    start = Motion(state.v, state.w, state.theta)
    k1 = departure(0.0, start)
    k1_middle = _carry(solved.middle, k1)
    k2 = departure(0.5, _sum(middle, (0.5 * h, k1_middle)))
    k3 = departure(0.5, _sum(middle, (0.5 * h, k2)))
    k3_end, k2_end = _carry(solved.middle, k3), _carry(solved.middle, k2)
    k4 = departure(1.0, _sum(end, (h, k3_end)))
    k1_end = _carry(solved.end, k1)
    zero = Motion(*[jnp.zeros_like(state.v)] * 3)
    d = _sum(zero, (h / 6.0, k1_end), (h / 3.0, k2_end), (h / 3.0, k3_end), (h / 6.0, k4))
    decay_v, decay_w = _linear(drive, d.v, d.w)
    return k1, Motion(k4.v + decay_v, k4.w + decay_w, d.w), d


def _travel(settings, state: State, pull: Force, path, solved: Solution) -> tuple[Array, Array]:
    """Mean velocity in x and y over the substep, by Gauss nodes; the departure at them by Hermite's cubic."""
    first, last, d = path
    slip, h = settings["lateral_slip"]["slip"], solved.step
    mean_x: Any = 0.0
    mean_y: Any = 0.0
    for weight, s, part in zip(GAUSS_WEIGHTS, GAUSS_NODES, solved.nodes, strict=True):
        start, finish = h * s * (1.0 - s) ** 2, -h * s * s * (1.0 - s)
        v, w, theta = _sum(_nominal(part, state, pull), (start, first), (s * s * (3.0 - 2.0 * s), d), (finish, last))
        sine, cosine = sin_cos(theta)
        side = lateral_slip(v, w, slip)
        mean_x = mean_x + weight * (v * cosine - side * sine)
        mean_y = mean_y + weight * (v * sine + side * cosine)
    return mean_x, mean_y


def _friction(settings, drive: Physical, state: State, pull: Force, d: Motion, lightness, solved: Solution) -> Force:
    """The acceleration by dry friction, held over the substep."""
    end = _nominal(solved.end, state, pull)
    before = wheel_speeds(drive, state.v, state.w)
    free = wheel_speeds(drive, end.v + d.v, end.w + d.w)
    columns = []
    for unit in (Wheels(1.0, 0.0), Wheels(0.0, 1.0)):
        pushed = Force(*(lightness * f for f in force(drive, unit)))
        start = (0.0, 0.0, pushed.along, pushed.heading)
        columns.append(wheel_speeds(drive, weigh(solved.end.v, start), weigh(solved.end.w, start)))
    mobility = (columns[0].right, columns[1].right), (columns[0].left, columns[1].left)
    coulomb, stiction = settings["coulomb_friction"], settings["stiction"]

    def level(n: Wheels) -> Wheels:
        sides = zip(n, Wheels._fields, strict=True)
        return Wheels(*(friction_level(m, coulomb[side], stiction[side], stiction["fade"]) for m, side in sides))

    rubbed = force(drive, dry_friction(before, free, mobility, level))
    return Force(-lightness * rubbed.along, -lightness * rubbed.heading)


def _linear(drive: Physical, v: Array, w: Array) -> tuple[Array, Array]:
    """-rate * [v, w] + coupling * [w, v]."""
    across = (0.0, 0.0) if drive.coupling is None else drive.coupling
    return -drive.rate[0] * v + across[0] * w, -drive.rate[1] * w + across[1] * v


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


def _nominal(part: Part, state: State, pull: Force) -> Motion:
    start = (state.v, state.w, pull.along, pull.heading)
    return Motion(weigh(part.v, start), weigh(part.w, start), state.theta + weigh(part.turn, start))


def _carry(part: Part, d: Motion) -> Motion:
    """A departure after a part of the substep in which nothing is added to it."""
    start = (d.v, d.w, 0.0, 0.0)
    return Motion(weigh(part.v, start), weigh(part.w, start), d.theta + weigh(part.turn, start))


def _sum(base: Motion, *terms: tuple[Any, Motion]) -> Motion:
    values: list[Any] = list(base)
    for factor, term in terms:
        values = [value + factor * change for value, change in zip(values, term, strict=True)]
    return Motion(*values)

"""One substep of the full simulator: the exact solution of the linear drive plus the departure from it.

With y the nominal solution under held force, known exactly, the state is y + d with d' = A d + N(y + d), d = 0 at the
start, N what the effects add. d takes one step of Lawson's exponential Runge-Kutta method of order four (Lawson 1967,
SIAM J. Numer. Anal. 4): where no effect is in force N is exactly zero, and so is d. The nominal solution is that of
half a substep, taken twice. Effects that are not in the settings are not computed.
"""

import functools
import operator
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, State, Wheels
from jaxident.effects.discovered import Here, pushed, rolled, sideways
from jaxident.effects.friction import dry_friction
from jaxident.effects.law_kinds import DISCOVERED
from jaxident.effects.signals import Motion, Push
from jaxident.effects.stages import acting, friction_level, holds
from jaxident.numerics import sin_cos
from jaxident.robot.drive import Force, Physical, Response, force, responses, to_wheels, weigh, wheel_speeds


class Half(NamedTuple):
    """Exact responses of speed, turn rate and turn after half a substep."""

    v: Response
    w: Response
    turn: Response


def solve_half(drive: Physical, step: Array) -> Half:
    """The exact solution over half a substep of any shape."""
    ((v, w, turn),) = responses(drive, 0.5 * step, (1.0,))
    return Half(v, w, turn)


def move(
    settings, drive: Physical, state: State, excess: tuple, push: Push, slip: Force | None, changed, half: Half, h, here
) -> tuple[State, tuple]:
    """The state one substep of h [s] later, under a push, a random slip (acceleration) and before or after what loads
    have `changed`, and by how much each wheel then turns faster than the ground; `excess`: by how much it did; here:
    what discovered laws depend on beside the motion. Friction, held over the substep, moves what the departure depends
    on, and the other way round: it is settled with a first guess of the departure, and again with the departure that
    follows.
    """
    pull = force(drive, push.mean)
    if slip is not None:
        pull = Force(pull.along + slip.along, pull.heading + slip.heading)
    ramp = None if push.slope is None else force(drive, push.slope)
    lightness = _lightness(settings, changed)
    rubs = holds(settings, "friction")
    departs = holds(settings, "load", "grip", "body") or DISCOVERED in settings
    start = Motion(state.v, state.w, state.theta)
    sliding: tuple = ()

    def departure(part: float, now: Motion) -> Motion:
        later = None if ramp is None else Force(*((part - 0.5) * f for f in ramp))
        return _departure(settings, drive, now, pull, later, lightness, sliding, here)

    if holds(settings, "grip"):
        first = _asked(drive, start, pull, ramp, -0.5)
        sliding = _sliding(settings, excess, first, first, h)
        end = _sum(after_half(half, after_half(half, start, pull), pull), (1.0, _guess(departure, start, half, h)))
        sliding = _sliding(settings, excess, first, _asked(drive, end, pull, ramp, 0.5), h)
        excess = tuple(Wheels(*(own.excess for own in wheels)) for wheels in sliding)
    held, path = pull, None
    if rubs:
        guess = _guess(departure, start, half, h) if departs else None
        held = _rubbed(settings, drive, start, pull, guess, lightness, half)
    if departs or ramp is not None:
        path = _runge_kutta(drive, departure, start, held, half, h)
        if rubs:
            held = _rubbed(settings, drive, start, pull, path[2], lightness, half)
    return _arrive(settings, drive, state, held, path, half, h, here), excess


def _lightness(settings, changed: tuple) -> Array | None:
    """What accelerations are multiplied with by all loads; None without any."""
    pairs = zip(acting("load", settings), changed, strict=True)
    factors = [effect.act.factor(now, **values) for (effect, values), now in pairs]
    return functools.reduce(operator.mul, factors) if factors else None


def _sliding(settings, excess: tuple, first: Wheels, last: Wheels, h: Array) -> tuple:
    """How both wheels slide over the substep by each grip, given their net pushes at its start and its end."""
    return tuple(
        [effect.act.slide(e, c, 0.5 * (c + later), h, **values) for e, c, later in zip(own, first, last, strict=True)]
        for (effect, values), own in zip(acting("grip", settings), excess, strict=True)
    )


def _asked(drive: Physical, now: Motion, pull: Force, ramp: Force | None, place: float) -> Wheels:
    """The net push of each wheel at some place of the substep: what accelerates a robot that rolls, in commands."""
    later = (0.0, 0.0) if ramp is None else (place * f for f in ramp)
    linear = _linear(drive, now.v, now.w)
    return to_wheels(drive, *(a + b + c for a, b, c in zip(linear, pull, later, strict=True)))


def _guess(departure, start: Motion, half: Half, h: Array) -> Motion:
    """The departure at the end of the substep if its rate stays what it is: what friction is first settled with."""
    moved = after_half(half, after_half(half, departure(0.5, start)))
    return Motion(*(h * part for part in moved))


def _departure(
    settings,
    drive: Physical,
    now: Motion,
    pull: Force,
    ramp: Force | None,
    lightness: Array | None,
    sliding: tuple,
    here: Here,
) -> Motion:
    """N: acceleration with all effects less that of the linear drive under the held pull; `sliding` by each grip."""
    v, w, theta = now
    along, heading = jnp.zeros_like(v), jnp.zeros_like(w)
    if ramp is not None:
        along, heading = ramp
    if sliding or lightness is not None:
        asked = Force(*(a + b + c for a, b, c in zip(_linear(drive, v, w), pull, (along, heading), strict=True)))
        factor = 1.0 if lightness is None else lightness
        for (effect, values), skids in zip(acting("grip", settings), sliding, strict=True):
            pairs = zip(to_wheels(drive, *asked), skids, strict=True)
            lost = force(drive, Wheels(*(effect.act.lost(c, own, **values) for c, own in pairs)))
            along, heading = along + factor * lost.along, heading + factor * lost.heading
        if lightness is not None:
            along, heading = along + (lightness - 1.0) * asked.along, heading + (lightness - 1.0) * asked.heading
    bodies = [effect.act(now, **values) for effect, values in acting("body", settings)]
    added = pushed(settings, drive, now, here)
    for more in bodies if added is None else [*bodies, added]:
        along, heading = along + more.along, heading + more.heading
    return Motion(along, heading, jnp.zeros_like(theta))


def _runge_kutta(drive: Physical, departure, start: Motion, held: Force, half: Half, h: Array):
    """Rates of change of the departure at the start and the end of the substep, and the departure at its end."""
    middle = after_half(half, start, held)
    end = after_half(half, middle, held)
    k1 = departure(0.0, start)
    carried = after_half(half, k1)
    k2 = departure(0.5, _sum(middle, (0.5 * h, carried)))
    k3 = departure(0.5, _sum(middle, (0.5 * h, k2)))
    k4 = departure(1.0, _sum(end, (h, after_half(half, k3))))
    inner = after_half(half, _sum(carried, (2.0, k2), (2.0, k3)))
    d = Motion(*((h / 6.0) * (a + b) for a, b in zip(inner, k4, strict=True)))
    decay_v, decay_w = _linear(drive, d.v, d.w)
    return k1, Motion(k4.v + decay_v, k4.w + decay_w, d.w), d


def _arrive(settings, drive: Physical, state: State, held: Force, path, half: Half, h: Array, here: Here) -> State:
    """The state at the end of the substep.

    The velocity's integral is that of the quintic through its values at start, middle and end and its rates at both
    ends; the departure in the middle is that of Hermite's cubic.
    """
    start = Motion(state.v, state.w, state.theta)
    middle = after_half(half, start, held)
    end = after_half(half, middle, held)
    rates = [Force(*(a + b for a, b in zip(_linear(drive, now.v, now.w), held, strict=True))) for now in (start, end)]
    if path is not None:
        first, last, d = path
        middle = _sum(middle, (0.5, d), (0.125 * h, first), (-0.125 * h, last))
        end = _sum(end, (1.0, d))
        rates = [Force(rates[0].along + first.v, rates[0].heading + first.w),
                 Force(rates[1].along + last.v, rates[1].heading + last.w)]  # fmt: skip
    v, w = end.v, end.w
    faster = rolled(settings, drive, middle, here)
    if faster is not None:
        start, middle, end = (_sum(now, (1.0, Motion(faster.along, faster.heading, part * h * faster.heading)))
                              for now, part in ((start, 0.0), (middle, 0.5), (end, 1.0)))  # fmt: skip
    (x0, y0), (x1, y1), (x2, y2) = (_velocity(settings, now, here) for now in (start, middle, end))
    (a0, b0), (a2, b2) = (_velocity_rate(settings, *pair, here) for pair in zip((start, end), rates, strict=True))
    x = state.x + h * ((7.0 * (x0 + x2) + 16.0 * x1) / 30.0 + h / 60.0 * (a0 - a2))
    y = state.y + h * ((7.0 * (y0 + y2) + 16.0 * y1) / 30.0 + h / 60.0 * (b0 - b2))
    return State(x, y, end.theta, v, w)


def _velocity(settings, now: Motion, here: Here) -> tuple[Array, Array]:
    sine, cosine = sin_cos(now.theta)
    left = sideways(settings, now, here)
    x, y = now.v * cosine - left * sine, now.v * sine + left * cosine
    for effect, values in acting("side", settings):
        left = effect.act(now.v, now.w, **values)
        x, y = x - left * sine, y + left * cosine
    return x, y


def _velocity_rate(settings, now: Motion, rate: Force, here: Here) -> tuple[Array, Array]:
    """Acceleration in x and y."""
    sine, cosine = sin_cos(now.theta)
    ahead, left = rate.along, now.w * now.v
    for effect, values in acting("side", settings):
        law = functools.partial(effect.act, **values)
        speed, gained = jax.jvp(law, (now.v, now.w), (rate.along, rate.heading))
        ahead, left = ahead - now.w * speed, left + gained
    if DISCOVERED in settings:
        law = functools.partial(sideways, settings, here=here)
        speed, gained = jax.jvp(law, (now,), (Motion(rate.along, rate.heading, now.w),))
        ahead, left = ahead - now.w * speed, left + gained
    return ahead * cosine - left * sine, ahead * sine + left * cosine


def _rubbed(settings, drive: Physical, start: Motion, pull: Force, d: Motion | None, lightness, half: Half) -> Force:
    """The force with dry friction, held over the substep at whose end the departure is d."""
    still = Motion(*[jnp.zeros_like(start.v)] * 3)

    def at_end(begin: Motion, pushed: Force) -> Motion:
        return after_half(half, after_half(half, begin, pushed), pushed)

    end = at_end(start, pull)
    if d is not None:
        end = _sum(end, (1.0, d))
    before, free = wheel_speeds(drive, start.v, start.w), wheel_speeds(drive, end.v, end.w)
    scale = 1.0 if lightness is None else lightness
    columns = []
    for unit in (Wheels(1.0, 0.0), Wheels(0.0, 1.0)):
        reached = at_end(still, Force(*(scale * f for f in force(drive, unit))))
        columns.append(wheel_speeds(drive, reached.v, reached.w))
    mobility = (columns[0].right, columns[1].right), (columns[0].left, columns[1].left)

    rubbed = force(drive, dry_friction(before, free, mobility, functools.partial(friction_level, settings)))
    return Force(pull.along - scale * rubbed.along, pull.heading - scale * rubbed.heading)


def _linear(drive: Physical, v: Array, w: Array) -> tuple[Array, Array]:
    """-rate * [v, w] + coupling * [w, v]."""
    if drive.coupling is None:
        return -drive.rate[0] * v, -drive.rate[1] * w
    return -drive.rate[0] * v + drive.coupling[0] * w, -drive.rate[1] * w + drive.coupling[1] * v


def after_half(half: Half, now: Motion, held: Force | None = None) -> Motion:
    """A motion after half a substep under a held force; a departure, to which nothing is added meanwhile, without."""
    if held is None:
        half = Half(*(Response(r.v, r.w, None, None) for r in half))
    start = (now.v, now.w, *(Force(0.0, 0.0) if held is None else held))
    return Motion(weigh(half.v, start), weigh(half.w, start), now.theta + weigh(half.turn, start))


def _sum(base: Motion, *terms: tuple[Any, Motion]) -> Motion:
    values: list[Any] = list(base)
    for factor, term in terms:
        values = [value + factor * change for value, change in zip(values, term, strict=True)]
    return Motion(*values)

"""Laws that remember the push: play in the gears, and the lag of the motors.

Each stands here three times: for one wheel and a held push, as the stage `gear` has it for one substep, and for whole
runs at once, which the fast integrator runs. The tests hold the last against a scan of the second.
"""

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Wheels
from jaxident.effects.signals import Push, Substep
from jaxident.numerics import hold_integrals, safe_divide
from jaxident.robot.drive import Physical, force, wheel_speeds

TOGETHER = 1e-12
"""Square of the least distance of two poles, as a part of their sum: where they meet, the root has no derivative."""


def backlash(position: Array, turning: Array, step: Array, width: Array) -> tuple[Array, Array]:
    """New position in the play and the part of the step [0, 1] that passed before the gear drives again.

    position in [-width / 2, width / 2] moves with p' = turning = m - c n while the wheel is free; the motor drives
    where p touches the side towards which it turns. c = 0: the wheel brakes meanwhile, as if on the motor's side, and
    only a reversal of m opens the play. c = 1: the play lies between motor and wheel, n is the wheel's speed, and the
    free wheel coasts, pushed by c n. width in unit s: play in distance over the speed per unit of command.
    """
    half = 0.5 * width
    remaining = jnp.maximum(half - jnp.sign(turning) * position, 0.0)
    free = jnp.clip(safe_divide(remaining, jnp.abs(turning) * step, 0.0), 0.0, 1.0)
    loose = width > 0.0  # without play the bounds meet, and the derivative of a clip between them is arbitrary
    return jnp.where(loose, jnp.clip(position + turning * step, -half, half), 0.0), jnp.where(loose, free, 0.0)


def play(push: Push, memory: Wheels, now: Substep, right: Array, left: Array, coasting: Array) -> tuple[Push, Wheels]:
    """What passes the play of both wheels; memory: the positions in it. The wheels' speeds are asked for twice: under
    the push without play, then under what passes."""
    speeds = now.speeds(push.mean)
    passed, _ = _play(push, memory, now.step, Wheels(right, left), coasting, speeds)
    return _play(push, memory, now.step, Wheels(right, left), coasting, now.speeds(passed.mean))


def _play(push: Push, memory: Wheels, step: Array, width: Wheels, coasting: Array, n: Wheels) -> tuple[Push, Wheels]:
    """With the wheels at speeds n: for a first part of the substep no more passes than what lets a wheel coast."""
    means, slopes, positions = [], [], []
    for wheel in range(2):
        coasts = coasting * n[wheel]
        turning = push.mean[wheel] - coasts
        position, free = backlash(memory[wheel], turning, step, width[wheel])
        driving = 1.0 - free
        slope = 6.0 * free * driving * turning
        means.append(coasts + driving * turning)
        slopes.append(slope if push.slope is None else slope + driving * push.slope[wheel])
        positions.append(position)
    return Push(Wheels(*means), Wheels(*slopes)), Wheels(*positions)


def play_of_runs(push: Push, drive: Physical, step: Array, right: Array, left: Array, coasting: Array) -> Push:
    """`play` over whole runs (points, runs, 2), steps (points, runs, 1) [s]; the speeds of wheels that coast are those
    of the nominal drive at the start of each substep."""
    width, decay = jnp.stack([jnp.asarray(right), jnp.asarray(left)]), jnp.exp(-drive.rate * step)

    def body(carry, now):
        position, speeds = carry
        mean, own, decay = now
        across = speeds[:, ::-1] * drive.coupling
        coasts = coasting * jnp.stack(wheel_speeds(drive, *speeds.T), axis=-1)
        position, free = backlash(position, mean - coasts, own, width)
        pull = force(drive, Wheels(*(free * coasts + (1.0 - free) * mean).T))
        steady = (jnp.stack(pull, axis=-1) + across) / drive.rate
        return (position, steady + (speeds - steady) * decay), (free, coasts)

    still = jnp.zeros_like(push.mean[0])
    free, coasts = jax.lax.scan(body, (still, still), (push.mean, step, decay))[1]
    driving, turning = 1.0 - free, push.mean - coasts
    return Push(coasts + driving * turning, driving * push.slope + 6.0 * free * driving * turning)


def motor_lag(last: Array, mean: Array, slope: Array, step: Array, time_constant: Array) -> tuple[Array, Array, Array]:
    """q' = (m - q) / tau over a step of m = mean + slope (s - 1/2), s in [0, 1]: q at its end, the mean of q, and its
    slope (12 times the first moment about the middle, so that mean + slope (s - 1/2) has both moments of q).

    A steady rise is followed late by slope tau / step; what is left of the gap at the start fades.
    """
    lagging = time_constant > 0.0
    decay, once, twice = hold_integrals(1.0 / jnp.where(lagging, time_constant, 1.0), step)
    kept = safe_divide(once, step, 1.0)
    moment = safe_divide(step * once - twice, step * step, 0.5) - 0.5 * kept
    first = safe_divide(time_constant, step, 0.0)  # the limit of `kept`, which gives the derivative at no lag
    still = jnp.where(step > 0.0, 0.0, 1.0)  # no time, no change: else a step of length zero would hide a switch
    limits = (decay, still), (kept, first), (moment, -0.5 * first)
    decay, kept, moment = (jnp.where(lagging, value, limit) for value, limit in limits)
    behind = slope * first
    gap = last - (mean - 0.5 * slope - behind)
    return mean + 0.5 * slope - behind + gap * decay, mean - behind + gap * kept, slope + 12.0 * moment * gap


def lag(
    push: Push, memory: tuple[Wheels, Wheels], now: Substep, time_constant: Array, second_order: Array
) -> tuple[Push, tuple[Wheels, Wheels]]:
    """What passes the lag of both motors, one pole after the other; memory: what passed each at last."""
    slower, faster = poles(time_constant, second_order)
    push, first = one_pole(push, memory[0], now.step, slower)
    push, second = one_pole(push, memory[1], now.step, faster)
    return push, (first, second)


def poles(time_constant: Array, second_order: Array) -> tuple[Array, Array]:
    """Time constants of the poles of m = q + tau q' + e tau^2 q'' / 4: tau and 0 at e = 0, both tau / 2 at e = 1."""
    apart = jnp.sqrt(jnp.maximum(1.0 - second_order, TOGETHER))
    return 0.5 * time_constant * (1.0 + apart), 0.5 * time_constant * (1.0 - apart)


def one_pole(push: Push, memory: Wheels, step: Array, time_constant: Array) -> tuple[Push, Wheels]:
    """What passes one lag of both wheels."""
    slope = Wheels(0.0, 0.0) if push.slope is None else push.slope
    wheels = zip(memory, push.mean, slope, strict=True)
    passed = [motor_lag(last, mean, rise, step, time_constant) for last, mean, rise in wheels]
    ends, means, slopes = (Wheels(*(jnp.asarray(part) for part in pair)) for pair in zip(*passed, strict=True))
    return Push(means, slopes), ends


def lag_of_runs(push: Push, _: Physical, step: Array, time_constant: Array, second_order: Array) -> Push:
    """`lag` over whole runs (points, runs, 2), steps (points, runs, 1) [s]."""
    slower, faster = poles(time_constant, second_order)
    return _pole_of_runs(_pole_of_runs(push, step, slower), step, faster)


def _pole_of_runs(push: Push, step: Array, time_constant: Array) -> Push:
    """`one_pole` over whole runs; it is linear, so that the response to a unit gap serves every substep."""
    none = jnp.zeros_like(step)
    decay, average, rising = motor_lag(jnp.ones_like(step), none, none, step, time_constant)
    goal, half = push.mean - push.slope * safe_divide(time_constant, step, 0.0), 0.5 * push.slope

    def body(last, now):
        begin, end, own = now
        return end + (last - begin) * own, last - begin

    gap = jax.lax.scan(body, jnp.zeros_like(push.mean[0]), (goal - half, goal + half, decay))[1]
    return Push(goal + gap * average, push.slope + gap * rising)

"""Laws of the command before it reaches the motors: which value leaves, when it takes effect, how fast it changes."""

from collections.abc import Callable

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Wheels
from jaxident.numerics import safe_divide

JUST = 1e-6
"""Part of a polling period by which a command that comes to a poll may be late: rounding must not cost a period."""
FAR = 1e9
"""A saturation level beyond all commands, where there is none."""


def lost_commands(u: Wheels, keys, probability: Array) -> Wheels:
    """Every command that is lost, `held` by a uniform draw below the probability."""
    lost = jax.random.uniform(keys[0], jnp.shape(u.right)) < probability
    return Wheels(*(held(own, lost) for own in u))


def held(command: Array, lost: Array) -> Array:
    """The command (samples,) with every lost entry (boolean, samples) replaced by the last one that arrived; nothing
    arrived before the first row, which is never lost."""
    rows = jnp.arange(len(command))
    return command[jax.lax.cummax(jnp.where(lost, 0, rows))]


def input_saturation(u: Wheels, level: Array, soft: Array) -> Wheels:
    """clip(u, -s, s), or with `soft` 1 s tanh(u / s): what a driver gives that weakens before its limit."""
    bound = jnp.where(jnp.isfinite(level), level, FAR)
    return Wheels(*(jnp.where(soft > 0.5, bound * jnp.tanh(own / bound), jnp.clip(own, -level, level)) for own in u))


def twist_quantisation(u: Wheels, mean: Array, difference: Array) -> Wheels:
    """Mean and difference of both commands each rounded to steps of their own: what becomes of wheel speeds on a base
    that is told a speed and a turn rate in whole numbers."""
    middle = _rounded(0.5 * (u.right + u.left), mean)
    half = 0.5 * _rounded(u.right - u.left, difference)
    rounded = Wheels(middle + half, middle - half)
    exact = (mean <= 0.0) & (difference <= 0.0)  # sums of what was taken apart are off by a last digit
    return Wheels(*(jnp.where(exact, a, b) for a, b in zip(u, rounded, strict=True)))


def input_quantisation(u: Wheels, step: Array, towards_zero: Array) -> Wheels:
    """round(u / q) q, or with `towards_zero` 1 the whole part of u / q times q, as a cast to an integer in C makes it;
    a step of 0 passes u."""
    return Wheels(*(jnp.where(towards_zero > 0.5, _rounded(own, step, jnp.trunc), _rounded(own, step)) for own in u))


def _rounded(value: Array, step: Array, whole: Callable[[Array], Array] = jnp.round) -> Array:
    return jnp.where(step > 0.0, whole(safe_divide(value, step, 0.0)) * step, value)


def transport_delay(time: Array, _: Array, delay: Array) -> Array:
    """t + T."""
    return time + delay


def command_polling(time: Array, offset: Array, period: Array, phase: Array) -> Array:
    """The first moment (k + phase) P of session time that is not before t: the base reads its commands every P.

    The delay of a command is a sawtooth of its time, between 0 and P. A bus or a radio with frames of its own does just
    this. Of the delays that change, this form was chosen for three reasons. It is a pure function of two numbers. It
    covers delays that drift: where P is nearly the period of the log, the sawtooth beats, and the delay grows slowly
    and jumps back. And its two numbers show in a log, since each change of a command tells one value of the sawtooth.
    A jitter that is drawn anew for each command has no such law; its mean is a delay like any other.
    """
    polls = jnp.where(period > 0.0, period, 1.0)
    number = jnp.ceil((time + offset) / polls - phase - JUST)
    return jnp.where(period > 0.0, (number + phase) * polls - offset, time)


def input_rate_limit(now: Wheels, target: Wheels, elapsed: Array, rate: Array, falling_ratio: Array) -> Wheels:
    """The command `elapsed` [s] after `target` was asked for: it moves away from 0 by at most `rate` [unit/s], and
    towards 0 by falling_ratio times as much. Drivers have a ramp for each."""
    limited = jnp.isfinite(rate)
    inverse = jnp.where(limited, 1.0 / jnp.where(limited, rate, 1.0), 0.0)
    return _ramped(now, target, elapsed, inverse, inverse / falling_ratio)


def rate_limit_by_inverse(
    now: Wheels, target: Wheels, elapsed: Array, inverse_rate: Array, falling_time: Array
) -> Wheels:
    """`input_rate_limit`, smooth at no limit and where commands fall at once (falling_time 0)."""
    return _ramped(now, target, elapsed, inverse_rate, inverse_rate * falling_time)


def _ramped(now: Wheels, target: Wheels, time: Array, rising: Array, falling: Array) -> Wheels:
    """Commands on their way; rising, falling [s/unit]: the time that a unit takes."""
    return Wheels(*(_towards(u, goal, time, rising, falling) for u, goal in zip(now, target, strict=True)))


def _towards(now: Array, goal: Array, time: Array, rising: Array, falling: Array) -> Array:
    lowest = jnp.clip(goal, jnp.minimum(now, 0.0), jnp.maximum(now, 0.0))  # falls as far as here, and rises from here
    down, up = lowest - now, goal - lowest
    needed = jnp.abs(down) * falling
    return now + down * _done(time, needed) + up * _done(time - needed, jnp.abs(up) * rising)


def _done(time: Array, needed: Array) -> Array:
    return jnp.where(needed > time, safe_divide(jnp.maximum(time, 0.0), needed, 1.0), 1.0)

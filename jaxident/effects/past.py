"""What the commands of a run leave behind, for laws that depend on more than the present: which way the robot goes and
since when, how warm each motor is, and how far and which way each command has just changed.

    s' = (u_r + u_l - s) / tau, a direction, the sign of s, for each tau of REVERSAL_TIMES
    heat' = (u^2 - heat) / tau, one heat for each wheel and each tau of HEAT_TIMES
    change = u - mean, mean' = (u - mean) / tau, one mean for each wheel and each tau of CHANGE_TIMES
    sense = sign of the last change of u, one for each wheel

What follows a command with play of half width b is at u - b sense, where each change of u is wider than the play.

All of it follows from the times and the commands alone, so that it is the same for every robot and needs no state.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array

REVERSAL_TIMES = (0.0, 0.15, 0.3, 0.6)
"""Time constants tau [s]. A robot goes on for a while when it is told to go the other way: the speed of a nominal one
with equal wheels is such a mean, with tau one over its rate. Of 0, 0.1, 0.2, 0.3 and 0.5 s on a simulated castor 0.3 s
brought most, 280 in log evidence, and 0 s 236; on one of an independent simulator 187, and 36."""
HEAT_TIMES = (1.0, 3.0, 10.0)
"""Time constants tau [s]. No others were tried."""
CHANGE_TIMES = (0.03, 0.1, 0.3)
"""Time constants tau [s]. Of 0.03, 0.06, 0.12 and 0.25 s the shortest brought most on three simulated robots whose
delay grows with the speed: on one of them 5620, 5320, 4300 and 2900 in log evidence. Half a log of a Create asked for
0.1 s, by 32. No longer ones than 0.3 s were tried."""
LONGEST = 2.0
"""Time since a reversal [s] beyond which it does not matter how long ago that was, and from which a run starts. No
other value was tried."""
ROWS = 512
"""Runs are filled up to a power of two times these rows, so that one program serves many lengths. No other number was
tried."""


class Past(NamedTuple):
    """reversal (times, 2, ...): by each of REVERSAL_TIMES the direction, -1, 1, or 0 before a first command, and the
    time since it last changed [s], at most LONGEST; heat (times, 2, ...) [unit^2]: of the right and the left motor by
    each of HEAT_TIMES. Times and heats are those of the middle of a row. change (times, 2, ...) [unit]: of both
    commands by each of CHANGE_TIMES, the mean over a row. sense (1, 2, ...): -1, 1, or 0 before a first command."""

    reversal: Any
    heat: Any
    change: Any
    sense: Any


def past_of(t: Array, command: Array) -> Past:
    """The past at each row of runs from rest: t (rows, ...) [s], command (rows, ..., 2); leaves (rows, ...)."""
    step = jnp.diff(t, axis=0, append=2.0 * t[-1:] - t[-2:-1])
    sent = jnp.moveaxis(command, -1, 1)
    taus, own_taus = (jnp.reshape(jnp.array(times), (-1, *[1] * sent[0].ndim)) for times in (HEAT_TIMES, CHANGE_TIMES))
    mean_taus = jnp.reshape(jnp.array(REVERSAL_TIMES), (-1, *[1] * step[0].ndim))

    def body(carry, row):
        smooth, direction, since, heat, mean, last, sense = carry
        u, h = row
        sense = jnp.where(u == last, sense, jnp.sign(u - last))
        kept = jnp.where(mean_taus > 0.0, jnp.exp(-h / jnp.where(mean_taus > 0.0, mean_taus, 1.0)), 0.0)
        smooth = kept * smooth + (1.0 - kept) * (u[0] + u[1])
        since = jnp.where(smooth * direction < 0.0, 0.0, since)
        direction = jnp.where(smooth == 0.0, direction, jnp.sign(smooth))
        midway, after = (heat + (u**2 - heat) * -jnp.expm1(-part * h / taus) for part in (0.5, 1.0))
        nearer = -jnp.expm1(-h / own_taus)
        reversal = jnp.stack([direction, jnp.minimum(since + 0.5 * h, LONGEST)], axis=1)
        past = Past(reversal, midway, (u - mean) * nearer * own_taus / h, sense[None])
        return (smooth, direction, jnp.minimum(since + h, LONGEST), after, mean + (u - mean) * nearer, u, sense), past

    still = jnp.zeros((len(REVERSAL_TIMES), *t[0].shape))
    warm = (jnp.zeros((len(times), *sent.shape[1:])) for times in (HEAT_TIMES, CHANGE_TIMES))
    rest = jnp.zeros(sent.shape[1:])
    return jax.lax.scan(body, (still, still, still + LONGEST, *warm, rest, rest), (sent, step))[1]


NO_PAST = Past(*(np.zeros((1, len(times), 2)) for times in (REVERSAL_TIMES, HEAT_TIMES, CHANGE_TIMES, (0.0,))))
"""Of a run of one row whose past nobody asks for."""
_past_of = jax.jit(past_of)


def past_of_run(t: Array, command: Array) -> Past:
    """`past_of` a run of t (rows,) and command (rows, 2), as NumPy arrays."""
    rows = len(t)
    more = ROWS * 2 ** max(0, -(-rows // ROWS) - 1).bit_length() - rows
    later = np.concatenate([t, t[-1] + 1.0 + np.arange(more)]), np.pad(command, [(0, more), (0, 0)])
    return Past(*(np.asarray(leaf)[:rows] for leaf in _past_of(*later)))

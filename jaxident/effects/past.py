"""What the commands of a run leave behind, for laws that depend on more than the present: how long ago the robot was
told to go the other way, how warm each motor is, and how far each command has just changed.

    heat' = (u^2 - heat) / tau, one heat for each wheel and each tau of HEAT_TIMES
    change = u - mean, mean' = (u - mean) / tau, one mean for each wheel and each tau of CHANGE_TIMES

All of it follows from the times and the commands alone, so that it is the same for every robot and needs no state.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array

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
    """since [s]: time since the last reversal, at most LONGEST (...); heat [unit^2]: of the right and the left motor by
    each of HEAT_TIMES (times, 2, ...). Both are those of the middle of a row. change [unit]: of their commands by each
    of CHANGE_TIMES (times, 2, ...), the mean over a row."""

    since: Any
    heat: Any
    change: Any


def past_of(t: Array, command: Array) -> Past:
    """The past at each row of runs from rest: t (rows, ...) [s], command (rows, ..., 2); leaves (rows, ...)."""
    step = jnp.diff(t, axis=0, append=2.0 * t[-1:] - t[-2:-1])
    sent = jnp.moveaxis(command, -1, 1)
    along = jnp.sign(sent[:, 0] + sent[:, 1])
    taus, own_taus = (jnp.reshape(jnp.array(times), (-1, *[1] * sent[0].ndim)) for times in (HEAT_TIMES, CHANGE_TIMES))

    def body(carry, row):
        direction, since, heat, mean = carry
        now, u, h = row
        since = jnp.where(now * direction < 0.0, 0.0, since)
        direction = jnp.where(now == 0.0, direction, now)
        midway, after = (heat + (u**2 - heat) * -jnp.expm1(-part * h / taus) for part in (0.5, 1.0))
        nearer = -jnp.expm1(-h / own_taus)
        past = Past(jnp.minimum(since + 0.5 * h, LONGEST), midway, (u - mean) * nearer * own_taus / h)
        return (direction, jnp.minimum(since + h, LONGEST), after, mean + (u - mean) * nearer), past

    still = jnp.zeros_like(t[0])
    begin = (
        still,
        still + LONGEST,
        *(jnp.zeros((len(times), *sent.shape[1:])) for times in (HEAT_TIMES, CHANGE_TIMES)),
    )
    return jax.lax.scan(body, begin, (along, sent, step))[1]


NO_PAST = Past(np.zeros(1), *(np.zeros((1, len(times), 2)) for times in (HEAT_TIMES, CHANGE_TIMES)))
"""Of a run of one row whose past nobody asks for."""
_past_of = jax.jit(past_of)


def past_of_run(t: Array, command: Array) -> Past:
    """`past_of` a run of t (rows,) and command (rows, 2), as NumPy arrays."""
    rows = len(t)
    more = ROWS * 2 ** max(0, -(-rows // ROWS) - 1).bit_length() - rows
    later = np.concatenate([t, t[-1] + 1.0 + np.arange(more)]), np.pad(command, [(0, more), (0, 0)])
    return Past(*(np.asarray(leaf)[:rows] for leaf in _past_of(*later)))

"""The same drive as difference equations between camera samples, PAPER (13)-(14), and the way to and fro.

dl_k     = a1 dl_{k-1}     + d11 m_r,k-1 - e11 m_r,k-2 + d12 m_l,k-1 - e12 m_l,k-2        (13)
dtheta_k = a2 dtheta_{k-1} + d21 m_r,k-1 - e21 m_r,k-2 + d22 m_l,k-1 - e22 m_l,k-2        (14)
"""

from typing import Any, NamedTuple

import jax.numpy as jnp

from jaxident.array_types import Array, Increment, Wheels
from jaxident.numerics import hold_integrals
from jaxident.robot.drive import Physical


class Difference(NamedTuple):
    """Parameters of (13)-(14) at one sample period.

    Attributes:
        alpha: (2,), of the length and of the turn.
        delta: (2, 2) [m and rad per unit of command]; rows length and turn, columns right and left.
        epsilon: (2, 2), the same for the command before.
    """

    alpha: Any
    delta: Any
    epsilon: Any


def to_difference(physical: Physical, period: Array) -> Difference:
    """Convert physical parameters to the difference equations (13)-(14): the zero-order-hold image, without coupling.

    With a = exp(-r h), its integral p and double integral q over the period h: alpha = a, delta = q b and
    -epsilon = (p^2 - a q) b, from the z-transform of b / (s (s + r)).

    Args:
        physical: the drive; its coupling is neglected.
        period: sample period h [s].

    Returns:
        Difference: parameters at that period.

    Examples:
        >>> import jaxident as ji
        >>> ji.start_jax()
        >>> drive = ji.load_model("published").physical
        >>> ji.to_difference(drive, 0.1).alpha.round(4).tolist()
        [0.9473, 0.4576]
    """
    decay, once, twice = hold_integrals(jnp.asarray(physical.rate), period)
    gain = jnp.asarray(physical.gain)
    return Difference(decay, twice[:, None] * gain, (decay * twice - once**2)[:, None] * gain)


def to_physical(difference: Difference, period: Array) -> Physical:
    """Convert difference equations to physical parameters: the drive without coupling whose image is closest.

    rate = -log(alpha) / h from the pole, gain = (delta - epsilon) / (h p) from the gain at rest. Both numerator
    coefficients of a real hold image follow from one gain. Free ones do not; data determine their sum best.

    Args:
        difference: parameters at one sample period, 0 < alpha < 1.
        period: that sample period h [s].

    Returns:
        Physical: rates [1/s] and gains, no coupling.

    Examples:
        >>> import jaxident as ji
        >>> ji.start_jax()
        >>> drive = ji.load_model("published").physical
        >>> ji.to_physical(ji.to_difference(drive, 0.1), 0.1).rate.round(2).tolist()
        [0.54, 7.82]
    """
    alpha = jnp.asarray(difference.alpha)
    rate = -jnp.log(alpha) / period
    _, once, _ = hold_integrals(rate, period)
    return Physical(rate, (jnp.asarray(difference.delta) - jnp.asarray(difference.epsilon)) / (period * once)[:, None])


def predict_increment(difference: Difference, past: Increment, passed: Wheels, passed_before: Wheels) -> Increment:
    """Right-hand sides of (13) and (14): `past` the last increment, `passed` m_{k-1}, `passed_before` m_{k-2}."""
    inputs = (passed.right, passed.left, passed_before.right, passed_before.left)

    def equation(row: int, last: Array) -> Array:
        (new_r, new_l), (old_r, old_l) = difference.delta[row], difference.epsilon[row]
        numerator = zip((new_r, new_l, -old_r, -old_l), inputs, strict=True)
        return difference.alpha[row] * last + sum(weight * m for weight, m in numerator)

    return Increment(equation(0, past.length), equation(1, past.turn))

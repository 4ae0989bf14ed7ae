"""Arithmetic that is finite, differentiable and fast where the textbook form is not."""

import contextlib
import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array, Column, Square

# Gauss-Legendre rule on [0, 1] with four nodes: exact for polynomials of degree seven.
GAUSS_NODES = (0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970263)
GAUSS_WEIGHTS = (0.17392742256872693, 0.32607257743127307, 0.32607257743127307, 0.17392742256872693)

# (sin r - r) / r^3 and (cos r - 1 + r^2 / 2) / r^4 for |r| <= pi/2, interpolated in r^2 at eight Chebyshev points.
_SINE = [
    -0.16666666666666666, 0.008333333333333316, -0.00019841269841254955, 2.755731921915843e-06,
    -2.5052107616384595e-08, 1.6058977272815506e-10, -7.643969031052769e-13, 2.731428986122616e-15,
]  # fmt: skip
_COSINE = [
    0.041666666666666664, -0.001388888888888888, 2.4801587301579844e-05, -2.7557319221567154e-07,
    2.0876756602568905e-09, -1.1470712252875163e-11, 4.777877290768691e-14, -1.521855926409455e-16,
]  # fmt: skip
_PI = (3.1415926534682512, 1.2154201012607932e-10, 4.044532497591901e-21)
"""pi as a sum whose first two parts have 33 bits: their products with whole numbers below 2^20 are exact."""

_SERIES_BELOW = 0.5
_SERIES_TERMS = 15
_FEW_TRIALS = 16


def float64_switch(on: bool) -> contextlib.AbstractContextManager[None]:
    """Double precision on or off for a block of code; older versions of JAX keep the switch among the experiments."""
    place: Any = jax if hasattr(jax, "enable_x64") else jax.experimental
    return place.enable_x64(on)


def require_float64(caller: str) -> None:
    """Raise RuntimeError with the line to type unless JAX computes in double precision."""
    if not jax.config.jax_enable_x64:  # type: ignore[attr-defined]
        raise RuntimeError(f"{caller} needs double precision: call jaxident.start_jax() before your first array")


def wrap(angle: Array) -> Array:
    """The angle [rad] moved by whole turns into [-pi, pi]; gradient 1 everywhere. Of a NumPy array NumPy computes it:
    nothing is compiled."""
    rounded = np.round if isinstance(angle, np.ndarray) else jnp.round
    return angle - 2.0 * np.pi * rounded(angle / (2.0 * np.pi))


def safe_divide(numerator: Array, denominator: Array, otherwise: Array) -> Array:
    """numerator / denominator, or `otherwise` where the denominator is 0; the gradient is finite there too."""
    clear = denominator != 0.0
    return jnp.where(clear, numerator / jnp.where(clear, denominator, 1.0), otherwise)


def safe_norm(x: Array, y: Array) -> Array:
    """sqrt(x^2 + y^2) with gradient 0 instead of NaN at the origin."""
    square = x * x + y * y
    clear = square > 0.0
    return jnp.where(clear, jnp.sqrt(jnp.where(clear, square, 1.0)), 0.0)


def sin_cos(angle: Array) -> tuple[Array, Array]:
    """Sine and cosine together, error below 3e-16 up to |angle| = 1e5 rad.

    Reduction to [-pi/2, pi/2] by whole half turns, of which odd ones change both signs (Cody and Waite 1980), then one
    polynomial each. XLA's own double-precision sine does not vectorise and costs ten times more on a CPU; reduction by
    quarter turns needs two terms less but whole numbers and choices, which XLA spreads over twice as many kernels.
    """
    half_turns = jnp.round(angle * (1.0 / math.pi))
    high, middle, low = _PI
    rest = (angle - half_turns * high) - (half_turns * middle + half_turns * low)
    sign = 1.0 - 2.0 * jnp.abs(half_turns - 2.0 * jnp.round(0.5 * half_turns))
    square = rest * rest
    sine = rest + rest * square * _polynomial(square, _SINE)
    cosine = 1.0 - 0.5 * square + square * square * _polynomial(square, _COSINE)
    return sign * sine, sign * cosine


@jax.custom_jvp
def add_pairs(x: list[Array], y: list[Array]) -> tuple[Array, Array]:
    """The sums of x and of y, two lists of arrays of one shape; arrays of many trials are added as complex numbers.

    Of one complex sum XLA makes one kernel on a CPU; of two that share their sines and cosines it makes a dozen, which
    pass arrays on. A loop over few trials gets so short by it that XLA makes one kernel of the whole loop, which copies
    all results at every turn: they keep two sums. So do derivatives: a kernel for each tangent would compute the sines
    anew.
    """
    if jnp.size(x[0]) < _FEW_TRIALS:
        return sum(x), sum(y)
    total = sum(jax.lax.complex(a, b) for a, b in zip(x, y, strict=True))
    return jnp.real(total), jnp.imag(total)


@add_pairs.defjvp
def _add_tangents(primals, tangents):
    return tuple(sum(part) for part in primals), tuple(sum(part) for part in tangents)


def hold_integrals(rate: Array, time: Array) -> tuple[Array, Array, Array]:
    """Response of y' = -rate y + f under a held f: exp(-rate t), its integral and its double integral over [0, t].

    Closed forms (1 - e) / rate and (t - (1 - e) / rate) / rate, with their power series where |rate t| < 1/2, so
    that a rate of zero and tiny steps keep full precision and finite gradients.
    """
    z = -rate * time
    small = jnp.abs(z) < _SERIES_BELOW
    z_series, z_closed = jnp.where(small, z, 0.0), jnp.where(small, 1.0, z)
    closed = jnp.expm1(z_closed) / z_closed
    series = _polynomial(z_series, [1.0 / math.factorial(k + 2) for k in range(_SERIES_TERMS)])
    first = jnp.where(small, 1.0 + z_series * series, closed)
    second = jnp.where(small, series, (closed - 1.0) / z_closed)
    return jnp.exp(z), time * first, time * time * second


def solve_positive(matrix: Square, target: Column) -> Column:
    """The solution (n,) of a positive definite system (n, n), n a handful, by Gauss-Jordan elimination.

    Plain arithmetic runs over thousands of systems at once under vmap, where LAPACK would be called for each.
    """
    size = matrix.shape[0]
    table = jnp.concatenate([matrix, target[:, None]], axis=1)
    for i in range(size):
        pivot_row = table[i] / table[i, i]
        table = jnp.where((jnp.arange(size) == i)[:, None], pivot_row, table - table[:, i, None] * pivot_row)
    return table[:, size]


def _polynomial(x: Array, coefficients: list[float]) -> Array:
    """Horner's rule; coefficients from the constant term upwards."""
    value = coefficients[-1] * jnp.ones_like(x)
    for coefficient in reversed(coefficients[:-1]):
        value = value * x + coefficient
    return value


def in_blocks(function: Callable[..., Any], size: int) -> Callable[..., Any]:
    """`function` of arrays; mapped over many trials on a CPU it takes them `size` at a time at most, one block after
    the other, so that its intermediate arrays stay in the cache. The results are those of a plain vmap.

    Elsewhere all trials run at once. A block takes every so-manieth trial, which keeps a trial axis that is cut over
    devices where it is.
    """
    function = jax.jit(function)  # traced once, for one trial and for blocks of them
    mapped = jax.custom_batching.custom_vmap(function)

    @mapped.def_vmap
    def many(trials, batched, *arguments):
        leaves, tree = jax.tree.flatten(arguments)
        axes = [0 if flag else None for flag in jax.tree.leaves(batched)]
        over = [leaf for leaf, axis in zip(leaves, axes, strict=True) if axis == 0]

        def block(over):
            rest = iter(over)
            own = [leaf if axis is None else next(rest) for leaf, axis in zip(leaves, axes, strict=True)]
            return jax.vmap(lambda *own: function(*jax.tree.unflatten(tree, own)), in_axes=axes)(*own)

        blocks = -(-trials // size) if jax.default_backend() == "cpu" else 1
        rows = -(-trials // blocks)
        if blocks > 1:
            filled = jnp.minimum(jnp.arange(rows * blocks), trials - 1)
            cut = [jnp.swapaxes(leaf[filled].reshape(rows, blocks, *leaf.shape[1:]), 0, 1) for leaf in over]
            found = jax.lax.map(block, cut)
            found = jax.tree.map(lambda leaf: jnp.swapaxes(leaf, 0, 1).reshape(-1, *leaf.shape[2:])[:trials], found)
        else:
            found = block(over)
        return found, jax.tree.map(lambda _: True, found)

    return mapped

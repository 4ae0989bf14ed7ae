"""Linear least squares from normal equations, unrolled for a handful of unknowns.

Many trials, each with five unknowns: a factorisation written out in plain arithmetic runs over all trials and all
grid points at once, where a LAPACK call would be made for each of them.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array

RIDGE = 1e-13
"""Added to the diagonal, relative to it: far below any noise, above rounding, so that every pivot is positive."""


class Solution(NamedTuple):
    """Coefficients of the columns, the sum of squares that they leave, and the smallest pivot relative to its
    column: the share of the most dependent column that the ones before it do not explain."""

    coefficients: tuple[Array, ...]
    remainder: Array
    independence: Array


def solve_normal(gram: Sequence[Sequence[Array]], moments: Sequence[Array], square: Array) -> Solution:
    """Least squares from inner products: L D L' of the Gram matrix, forward and back, all entries of any one shape.

    gram[i][j], j <= i, is the product of columns i and j, moments[i] that of column i with the target, square that
    of the target with itself. A column of zeros gets the coefficient 0; dependent ones share theirs by the ridge.
    """
    size = len(moments)
    lower = [[gram[i][0]] * size for i in range(size)]
    pivots, forward = [], []
    remainder, independence = square, jnp.ones_like(square)
    for i in range(size):
        for j in range(i):
            known = sum(lower[i][k] * lower[j][k] * pivots[k] for k in range(j))
            lower[i][j] = _ratio(gram[i][j] - known, pivots[j])
        explained = sum(lower[i][k] ** 2 * pivots[k] for k in range(i))
        pivot = jnp.maximum(gram[i][i] * (1.0 + RIDGE) - explained, RIDGE * gram[i][i])
        value = moments[i] - sum(lower[i][k] * forward[k] * pivots[k] for k in range(i))
        pivots.append(pivot)
        forward.append(_ratio(value, pivot))
        remainder = remainder - forward[i] ** 2 * pivot
        independence = jnp.minimum(independence, _ratio(pivot, gram[i][i]))
    for i in reversed(range(size)):
        forward[i] = forward[i] - sum(lower[k][i] * forward[k] for k in range(i + 1, size))
    return Solution(tuple(forward), jnp.maximum(remainder, 0.0), independence)


def solve_columns(columns: Array, target: Array) -> tuple[Solution, Array]:
    """Least squares of a target (samples,) on columns (unknowns, samples), and the residual (samples,).

    Refined once against rounding. The refinement sees the columns as constants: the residual's derivative is then
    that of variable projection in Kaufman's form (1975), which leaves out how the coefficients themselves move.
    """
    fixed = jax.lax.stop_gradient(columns)
    gram = fixed @ fixed.T
    first = solve_normal(gram, fixed @ target, jnp.sum(target**2))
    left = target - jax.lax.stop_gradient(jnp.stack(first.coefficients)) @ columns
    second = solve_normal(gram, fixed @ left, jnp.sum(left**2))
    coefficients = tuple(a + b for a, b in zip(first.coefficients, second.coefficients, strict=True))
    residual = left - jnp.stack(second.coefficients) @ fixed
    return Solution(coefficients, jnp.sum(residual**2), first.independence), residual


def _ratio(numerator: Array, denominator: Array) -> Array:
    positive = denominator > 0.0
    return jnp.where(positive, numerator / jnp.where(positive, denominator, 1.0), 0.0)

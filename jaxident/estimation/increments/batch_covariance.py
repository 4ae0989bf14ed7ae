"""Both equations' estimates brought to agree, whose dead zones are shared: by the information of each."""

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, DifferenceMatrix, DifferenceVector, EquationUnknowns, Increment, Square
from jaxident.estimation.increments import recursive
from jaxident.estimation.increments.least_squares import full_covariance
from jaxident.numerics import safe_divide, solve_positive
from jaxident.robot.model import DIFFERENCE_ORDER

PLACES = (0, 2, 3, 6, 7, 10, 11), (1, 4, 5, 8, 9, 10, 11)
"""Each equation's pole, numerators and dead zones in DIFFERENCE_ORDER."""


def batch_covariance(estimate: recursive.Estimate, variance: Increment) -> DifferenceMatrix:
    """Covariance (12, 12) in DIFFERENCE_ORDER, to first order; variance: of each equation's residuals."""
    equations = (estimate.length, estimate.turn)
    unknowns = jnp.stack([jnp.stack(equation.unknowns) for equation in equations])
    covariance = [v * full_covariance(equation) for v, equation in zip(variance, equations, strict=True)]
    return pool(unknowns, jnp.stack(covariance))[1]


def pool(unknowns: EquationUnknowns, covariance: Array) -> tuple[DifferenceVector, DifferenceMatrix]:
    """One estimate (12,) in DIFFERENCE_ORDER and its covariance (12, 12), to first order, from unknowns (2, 7) of both
    equations, in the order of `regressors`, and their covariances (2, 7, 7).

    The information of both equations adds up in the dead zones. In the average of two ratios, as the recursion forms
    it, the worse equation would rule.
    """
    size = len(DIFFERENCE_ORDER)
    total, places = jnp.zeros((size, size)), [jnp.array(rows) for rows in PLACES]
    own = []
    for rows, values, spread in zip(places, unknowns, covariance, strict=True):
        slope = jax.jacfwd(_own_parameters)(values)
        own.append(_inverse(slope @ spread @ slope.T))
        total = total.at[rows[:, None], rows].add(own[-1])
    pooled = _inverse(total)
    first, second = (_own_parameters(values) for values in unknowns)
    apart = jnp.zeros(size).at[places[0]].set(own[0][:, 5:] @ (first[5:] - second[5:]))
    return jnp.zeros(size).at[places[0]].set(first).at[places[1]].set(second) + pooled @ apart, pooled


def _own_parameters(unknowns: Array) -> Array:
    """An equation's parameters (7,), in the order of PLACES, from its unknowns (7,)."""
    pole, new_r, edge_r, old_r, new_l, edge_l, old_l = unknowns
    ratios = (safe_divide(edge, new, 0.0) for edge, new in ((edge_r, new_r), (edge_l, new_l)))
    return jnp.stack([pole, new_r, new_l, -old_r, -old_l, *ratios])


def _inverse(matrix: Square) -> Square:
    """Of a covariance or an information (n, n) whose entries differ by many orders of magnitude."""
    scale = 1.0 / jnp.sqrt(jnp.maximum(jnp.diagonal(matrix), jnp.finfo(float).tiny))
    scaled = scale[:, None] * matrix * scale
    return scale[:, None] * jax.vmap(solve_positive, (None, 1), 1)(scaled, jnp.eye(len(matrix))) * scale

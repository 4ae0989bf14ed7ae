"""How certain the batch estimate is, whose dead zones are shared by both equations from the start."""

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Increment
from jaxident.estimation import recursive
from jaxident.estimation.least_squares import full_covariance
from jaxident.numerics import safe_divide, solve_positive
from jaxident.robot.model import DIFFERENCE_ORDER

PLACES = (0, 2, 3, 6, 7, 10, 11), (1, 4, 5, 8, 9, 10, 11)
"""Each equation's pole, numerators and dead zones in DIFFERENCE_ORDER."""


def batch_covariance(estimate: recursive.Estimate, variance: Increment) -> Array:
    """Covariance (12, 12) in DIFFERENCE_ORDER, to first order; variance: of each equation's residuals.

    The information of both equations, each weighted by its noise, adds up in the dead zones. In the average of two
    ratios, as the recursion forms it, the worse equation would rule.
    """
    size = len(DIFFERENCE_ORDER)
    total = jnp.zeros((size, size))
    for places, equation, v in zip(PLACES, (estimate.length, estimate.turn), variance, strict=True):
        slope = jnp.stack(jax.jacfwd(_own_parameters)(equation.unknowns), axis=-1)
        own = _inverse(v * slope @ full_covariance(equation) @ slope.T)
        rows = jnp.array(places)
        total = total.at[rows[:, None], rows].add(own)
    return _inverse(total)


def _own_parameters(unknowns: recursive.Vector) -> Array:
    """An equation's parameters (7,), in the order of PLACES, from its unknowns."""
    pole, new_r, edge_r, old_r, new_l, edge_l, old_l = unknowns
    ratios = (safe_divide(edge, new, 0.0) for edge, new in ((edge_r, new_r), (edge_l, new_l)))
    return jnp.stack([pole, new_r, new_l, -old_r, -old_l, *ratios])


def _inverse(matrix: Array) -> Array:
    """Of a covariance or an information (n, n) whose entries differ by many orders of magnitude."""
    scale = 1.0 / jnp.sqrt(jnp.maximum(jnp.diagonal(matrix), jnp.finfo(float).tiny))
    scaled = scale[:, None] * matrix * scale
    return scale[:, None] * jax.vmap(solve_positive, (None, 1), 1)(scaled, jnp.eye(len(matrix))) * scale

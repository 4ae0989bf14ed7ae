"""Covariance of the shared unknowns at the end of a search."""

import jax.numpy as jnp

from jaxident.array_types import Unknowns, UnknownsMatrix
from jaxident.estimation.poses.curvature import Local, Point
from jaxident.estimation.poses.parameters import Law, is_logarithmic, names
from jaxident.estimation.poses.prior import FLAT, Prior, posterior
from jaxident.estimation.poses.scoring import Damping, eliminate, with_prior


def data_curvature(local: Local, law: Law) -> UnknownsMatrix:
    """Expected curvature (unknowns, unknowns) of the shared unknowns, start states eliminated."""
    return eliminate(local, Damping(0.0, 0.0), jnp.zeros(len(names(law)), bool))[0]


def posterior_at(point: Point, local: Local, law: Law, prior: Prior) -> tuple[UnknownsMatrix, Unknowns]:
    """Covariance and the prior's share of each variance, as `posterior` gives them, where a search has ended; its
    `local` holds the prior's terms."""
    return posterior(data_curvature(with_prior(local, point.shared, law, prior, -1.0), law), point.shared, law, prior)


def covariance_at(point: Point, local: Local, law: Law) -> UnknownsMatrix:
    """Covariance (unknowns, unknowns) of the shared unknowns in natural units, start states and noise law as nuisance:
    the inverse of the expected curvature.

    Directions that the data do not determine get a finite, enormous variance (curvature floored at FLAT of the largest,
    all unknowns scaled alike).
    """
    shared = data_curvature(local, law)
    scale = jnp.sqrt(jnp.diagonal(local.shared))
    scale = jnp.where(scale > 0.0, scale, 1.0)
    values, vectors = jnp.linalg.eigh(shared / scale[:, None] / scale)
    values = jnp.maximum(values, FLAT * jnp.maximum(values[-1], FLAT))
    natural = jnp.where(is_logarithmic(law), jnp.exp(point.shared), 1.0) / scale
    rows = natural[:, None] * vectors / jnp.sqrt(values)
    return rows @ rows.T

"""Start values from the setup time, PAPER section VI: linear least squares, then the nonlinear cost (21).

    J = sum over the measured samples of ((dl - dl_hat) / s_l)^2 + ((dtheta - dtheta_hat) / s_theta)^2

in one of two readings of dl_hat and dtheta_hat: `one_step` puts the measured last increment on the right of
(13)-(14), `free_run` the model's own. The search runs over the dead zones (and, in free run, the poles) alone;
`projection` solves for everything else.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import lineax
import optimistix

from jaxident.array_types import Array, Increment
from jaxident.errors import InputError
from jaxident.estimation.observations import Observations
from jaxident.estimation.projection import Projected, free_run_reading, grid_squares, one_step_reading, project
from jaxident.robot.difference import Difference

GRID = 10
"""Dead zones per wheel on the grid that the search starts from."""

POLES = (0.2, 0.6, 0.8, 0.9, 0.96, 0.985, 0.996)
"""Poles per channel on that grid, in free run."""

STARTS = 2
MAX_STEPS = 12
RTOL, ATOL = 1e-9, 1e-10

WINDOW = 5
ZOOMS = 12
"""The last search: windows of WINDOW^2 dead zones, each half as wide as the one before."""

SMALLEST_WEIGHT = 1e-9
"""Residual [m], [rad] that noise-free data are weighted by."""

READINGS = ("free_run", "one_step")


class Setup(NamedTuple):
    """Parameters of (13)-(14) and dead zones (2,) from the setup time.

    cost is J; weight s, the residual [m], [rad] of the linear fit in each channel; ok: finite, and no lower than what
    the search began with; steps: how many it took from its best start.
    """

    difference: Difference
    dead_zone: Any
    cost: Any
    weight: Increment
    ok: Any
    steps: Any


class Cost(NamedTuple):
    """J as functions: what is left at a point (2,) or (4,); J on a grid of right and left dead zones, at one pole per
    channel, by channel (2, n, m); and the weights s (2,)."""

    left: Callable[[Array], Projected]
    grid: Callable[[Array, Array, Array], Array]
    weight: Array

    def at(self, point: Array) -> Array:
        """J at one point."""
        return jnp.sum((self.left(point).residual / self.weight[:, None]) ** 2)


def initialise(observations: Observations, *, d_max: Array, reading: str = "free_run") -> Setup:
    """Minimise J over all twelve parameters, 0 <= D <= d_max, |alpha| < 1 in free run.

    J has kinks where a dead zone crosses a level of the commands, and local minima between them: the search starts
    from the best points of a coarse grid, follows optimistix's Levenberg-Marquardt from each, and ends with ever
    smaller grids around the lowest. Pure: runs under jit and vmap. Double precision.
    """
    cost = _cost(observations, reading)
    points, costs = (_one_step_starts if reading == "one_step" else _free_run_starts)(cost, d_max)
    starts = points[jax.lax.top_k(-costs, STARTS)[1]]
    ends, costs, steps = jax.lax.map(lambda start: _refine(cost, d_max, start), starts)
    best = jnp.argmin(jnp.where(jnp.isfinite(costs), costs, jnp.inf))
    point = _settle(cost, d_max, ends[best])
    left, lowest = cost.left(point), cost.at(point)
    return Setup(
        difference=Difference(left.alpha, left.numerator[:, :2], -left.numerator[:, 2:]),
        dead_zone=point[:2],
        cost=lowest,
        weight=Increment(cost.weight[0], cost.weight[1]),
        ok=jnp.isfinite(lowest) & (lowest <= cost.at(starts[0])) & jnp.all(jnp.isfinite(left.numerator)),
        steps=steps[best],
    )


def _cost(observations: Observations, reading: str) -> Cost:
    """J in one reading, each channel weighted by its residual after a linear fit without dead zones, (19)-(20)."""
    if reading not in READINGS:
        raise InputError(f"reading {reading!r}: one of {', '.join(READINGS)}")
    one_step, use = one_step_reading(observations)
    linear = project(one_step, observations, jnp.zeros(2)).residual
    weight = jnp.maximum(jnp.sqrt(jnp.sum(linear**2, axis=1) / jnp.maximum(jnp.sum(use), 1)), SMALLEST_WEIGHT)
    read = one_step if reading == "one_step" else free_run_reading(observations)
    return Cost(
        left=lambda point: project(read, observations, point),
        grid=lambda *where: grid_squares(read, observations, *where) / weight[:, None, None] ** 2,
        weight=weight,
    )


def _one_step_starts(cost: Cost, d_max: Array) -> tuple[Array, Array]:
    """Points (GRID^2, 2) and J there."""
    widths = d_max * (jnp.arange(GRID) + 0.5) / GRID
    return _pairs(widths), jnp.sum(cost.grid(widths, widths, jnp.zeros(2)), axis=0).ravel()


def _free_run_starts(cost: Cost, d_max: Array) -> tuple[Array, Array]:
    """Points (GRID^2, 4) and J there. Each channel takes its best pole on its own: given the dead zones the two
    share nothing."""
    widths = d_max * (jnp.arange(GRID) + 0.5) / GRID
    poles = jnp.asarray(POLES)
    by_channel = jax.lax.map(lambda pole: cost.grid(widths, widths, jnp.stack([pole, pole])), poles)
    best = poles[jnp.argmin(by_channel, axis=0)].reshape(2, -1)
    points = jnp.concatenate([_pairs(widths), best.T], axis=1)
    return points, jnp.sum(jnp.min(by_channel, axis=0), axis=0).ravel()


def _refine(cost: Cost, d_max: Array, start: Array) -> tuple[Array, Array, Array]:
    """Levenberg-Marquardt from one point, in coordinates that cannot leave the bounds: the end, J there, the steps."""

    def residual(coordinates, _):
        return (cost.left(_inside(coordinates, d_max)).residual / cost.weight[:, None]).ravel()

    search: optimistix.Solution = optimistix.least_squares(
        residual,
        optimistix.LevenbergMarquardt(RTOL, ATOL, linear_solver=lineax.Normal(lineax.Cholesky())),
        _coordinates(start, d_max),
        max_steps=MAX_STEPS,
        throw=False,
    )
    point = _inside(search.value, d_max)
    return point, cost.at(point), search.stats["num_steps"]


def _settle(cost: Cost, d_max: Array, point: Array) -> Array:
    """The lowest point nearby on ever smaller grids of dead zones.

    On a kink the gradient says nothing of the other side, and Levenberg-Marquardt stops short of the lowest point.
    """
    poles = point[2:] if len(point) > 2 else jnp.zeros(2)
    sides = jnp.linspace(-1.0, 1.0, WINDOW)

    def zoom(k, centre):
        reach = 0.5 * d_max / GRID * 0.5**k
        rights, lefts = (jnp.clip(c + reach * sides, 0.0, d_max) for c in centre)
        lowest = jnp.argmin(jnp.sum(cost.grid(rights, lefts, poles), axis=0))
        return jnp.stack([rights[lowest // WINDOW], lefts[lowest % WINDOW]])

    settled = point.at[:2].set(jax.lax.fori_loop(0, ZOOMS, zoom, point[:2]))
    return jnp.where(cost.at(settled) < cost.at(point), settled, point)


def _pairs(widths: Array) -> Array:
    return jnp.stack(jnp.meshgrid(widths, widths, indexing="ij"), axis=-1).reshape(-1, 2)


def _inside(coordinates: Array, d_max: Array) -> Array:
    """Dead zones d_max sin^2 and poles tanh: smooth, and both bounds of a dead zone can be reached."""
    return jnp.concatenate([d_max * jnp.sin(coordinates[:2]) ** 2, jnp.tanh(coordinates[2:])])


def _coordinates(point: Array, d_max: Array) -> Array:
    return jnp.concatenate([jnp.arcsin(jnp.sqrt(point[:2] / d_max)), jnp.arctanh(point[2:])])

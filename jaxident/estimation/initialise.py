"""Start values from the setup time, PAPER section VI: linear least squares, then the nonlinear cost (21).

    J = sum over the measured samples of ((dl - dl_hat) / s_l)^2 + ((dtheta - dtheta_hat) / s_theta)^2

in one of the two readings of dl_hat and dtheta_hat of `readings`. The search runs over the dead zones and the poles
alone; `projection` solves for everything else.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import lineax
import optimistix

from jaxident.array_types import Array, Increment
from jaxident.estimation.observations import Observations
from jaxident.estimation.projection import Projected, linear_residual, profile, project
from jaxident.estimation.readings import Reading, one_step, reading_of, usable
from jaxident.robot.difference import Difference

GRID = 21
"""Dead zones of either wheel in the first look, over all of them."""

WINDOW, WINDOWS, FINER = 11, 15, 1.8
"""The windows of WINDOW^2 dead zones that follow, each FINER times as fine as the one before."""

FIRST_WINDOW = 2.5
"""Half-width of the first window in steps of the grid. The last tells dead zones 1e-5 of the largest apart."""

POLES = (0.0, 0.4, 0.65, 0.8, 0.88, 0.94, 0.97, 0.985, 0.9925, 0.998)
"""Poles that a free run starts from: the time constant grows by a half or more from one to the next."""

POLE_LIMIT = 0.9995
"""Largest pole that a window, which is right to first order alone, may suggest in free run."""

MAX_STEPS = 4
RTOL, ATOL = 1e-9, 1e-10

UNKNOWNS = 12

SMALLEST_WEIGHT = 1e-9
"""Residual [m], [rad] that noise-free data are weighted by."""


class Setup(NamedTuple):
    """Parameters of (13)-(14) and dead zones (2,) from the setup time.

    cost is J; weight s, the residual [m], [rad] of the linear fit in each channel; ok: finite, from more
    samples than unknowns; steps: how many it took from its best start.
    """

    difference: Difference
    dead_zone: Any
    cost: Any
    weight: Increment
    ok: Any
    steps: Any


class Cost(NamedTuple):
    """J as functions of a point (4,), dead zones and poles: what is left at a point; J and the best points (n, m, 4)
    for all pairs of n right and m left dead zones, seen from a point. weight: s (2,)."""

    left: Callable[[Array], Projected]
    around: Callable[[Array, Array, Array], tuple[Array, Array]]
    weight: Array

    def best(self, points: Array) -> tuple[Array, Array, Array]:
        """The lowest of some points (n, 4), J and the numerators there."""
        left = jax.vmap(self.left)(points)
        costs = jnp.sum((left.residual / self.weight[:, None]) ** 2, axis=(1, 2))
        best = jnp.argmin(jnp.where(jnp.isfinite(costs), costs, jnp.inf))
        return points[best], costs[best], left.numerator[best]


def initialise(observations: Observations, *, d_max: Array, reading: str = "one_step") -> Setup:
    """Minimise J over all twelve parameters, 0 <= D <= d_max, |alpha| < 1 in free run.

    J has kinks where a dead zone crosses a level of the commands, and local minima between them. A gradient sees
    neither: windows of dead zones, each finer than the last, find the lowest valley, and optimistix's
    Levenberg-Marquardt its floor. Pure: runs under jit and vmap. Double precision.
    """
    read = reading_of(observations, reading)
    weight, count = _linear_weight(observations)
    cost = _cost(observations, read, weight)
    if reading == "one_step":
        start = _overview(cost, jnp.zeros(2), d_max)
    else:
        coarse = _overview(_cost(observations, one_step(observations), weight), jnp.zeros(2), d_max)
        start = _overview(cost, _best_poles(cost, coarse), d_max)
    start = _windows(cost, start, d_max)
    refined, steps = _refine(cost, read, d_max, start)
    point, lowest, numerator = cost.best(jnp.stack([start, refined]))
    return Setup(
        difference=Difference(point[2:], numerator[:, :2], -numerator[:, 2:]),
        dead_zone=point[:2],
        cost=lowest,
        weight=Increment(weight[0], weight[1]),
        ok=jnp.isfinite(lowest) & jnp.all(jnp.isfinite(numerator)) & (count > UNKNOWNS),
        steps=steps,
    )


def _linear_weight(observations: Observations) -> tuple[Array, Array]:
    """Root-mean-square residual (2,) of (19)-(20), the one-step fit without dead zones, and of how many samples."""
    read = one_step(observations)
    count = jnp.sum(usable(observations))
    residual = jax.vmap(lambda y: linear_residual(read, observations, y))(jnp.stack(observations.increment))
    mean = jnp.sum(residual**2, axis=1) / jnp.maximum(count, 1)
    return jnp.maximum(jnp.sqrt(mean), SMALLEST_WEIGHT), count


def _cost(observations: Observations, reading: Reading, weight: Array) -> Cost:
    limit = jnp.abs(reading.pole(jnp.asarray(jnp.inf))) * POLE_LIMIT

    def around(point: Array, rights: Array, lefts: Array) -> tuple[Array, Array]:
        squares, poles = profile(reading, observations, point, rights, lefts)
        costs = jnp.sum(squares / weight[:, None, None] ** 2, axis=0)
        pairs = jnp.meshgrid(rights, lefts, indexing="ij")
        return costs, jnp.stack([*pairs, *jnp.clip(poles, -limit, limit)], axis=-1)

    return Cost(lambda point: project(reading, observations, point), around, weight)


def _best_poles(cost: Cost, point: Array) -> Array:
    """For each channel the best (2,) of POLES: given the dead zones, the channels share nothing."""
    poles = jnp.asarray(POLES)
    left = jax.vmap(lambda pole: cost.left(point.at[2:].set(pole)).residual)(poles)
    return poles[jnp.argmin(jnp.sum(left**2, axis=2), axis=0)]


def _overview(cost: Cost, poles: Array, d_max: Array) -> Array:
    """The lowest point (4,) of a grid over all dead zones, seen from its middle and some poles."""
    widths = jnp.linspace(0.0, 1.0, GRID) * d_max
    return _lowest(cost, jnp.concatenate([jnp.full(2, 0.5 * d_max), poles]), (widths, widths))


def _windows(cost: Cost, point: Array, d_max: Array) -> Array:
    """The lowest point (4,) that ever finer windows find, each around the best of the one before."""
    offsets = FIRST_WINDOW * d_max / (GRID - 1) * jnp.linspace(-1.0, 1.0, WINDOW)

    def look(k, centre):
        return _lowest(cost, centre, [jnp.clip(d + FINER ** -(1.0 * k) * offsets, 0.0, d_max) for d in centre[:2]])

    return jax.lax.fori_loop(0, WINDOWS, look, point)


def _lowest(cost: Cost, centre: Array, widths: Sequence[Array]) -> Array:
    """The best point for all pairs of a right and a left dead zone, seen from a centre (4,)."""
    costs, points = cost.around(centre, *widths)
    return points.reshape(-1, 4)[jnp.argmin(costs)]


def _refine(cost: Cost, reading: Reading, d_max: Array, start: Array) -> tuple[Array, Array]:
    """Levenberg-Marquardt from one point, in coordinates that cannot leave the bounds: the end, and the steps."""

    @jax.custom_jvp
    def residual(point):
        return cost.left(point).residual / cost.weight[:, None]

    @residual.defjvp
    def _(primals, tangents):
        left = cost.left(*primals)
        width, pole = tangents[0][:2], tangents[0][2:, None]
        slope = jnp.einsum("cds,d->cs", left.slope[:, :2], width) + pole * left.slope[:, 2]
        return left.residual / cost.weight[:, None], slope / cost.weight[:, None]

    def inside(coordinates):
        return jnp.concatenate([d_max * jnp.sin(coordinates[:2]) ** 2, reading.pole(coordinates[2:])])

    search: optimistix.Solution = optimistix.least_squares(
        lambda coordinates, _: residual(inside(coordinates)),
        optimistix.LevenbergMarquardt(RTOL, ATOL, linear_solver=lineax.Normal(lineax.Cholesky())),
        jnp.concatenate([jnp.arcsin(jnp.sqrt(start[:2] / d_max)), reading.coordinate(start[2:])]),
        max_steps=MAX_STEPS,
        throw=False,
    )
    return inside(search.value), search.stats["num_steps"]

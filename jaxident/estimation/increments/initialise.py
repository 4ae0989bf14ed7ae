"""Start values from the setup time, PAPER section VI: linear least squares, then the nonlinear cost (21).

    J = sum over the measured samples of ((dl - dl_hat) / s_l)^2 + ((dtheta - dtheta_hat) / s_theta)^2

in one of the two readings of dl_hat and dtheta_hat of `readings`. The search runs over the dead zones and the poles
alone; `projection` solves for everything else.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Increment, PerChannel, SearchPoint
from jaxident.estimation.increments.input_forms import Reading, free_run, one_step, reading_of, usable
from jaxident.estimation.increments.observations import Observations
from jaxident.estimation.increments.projection import Projected, inputs_of, linear_residual, profile, project, triangle
from jaxident.numerics import in_blocks
from jaxident.robot.difference import Difference

COARSE, COARSE_WIDTHS = 21, (0.5, 0.11)
"""Dead zones of either wheel in the first two windows, and half of these windows' widths over the largest dead zone:
the first window takes all of them."""

FINE, FINE_WIDTHS = 7, tuple(0.025 * 0.016 ** (k / 5) for k in range(6))
"""The same of the windows that follow. The last tells dead zones 1.3e-4 of the largest apart; levels of the commands,
where the kinks are, are met exactly."""

BLOCKS = (40, 10)
"""Trials at once, of the whole and within it of the search, where many are mapped: few enough for the cache."""

POLES = (0.0, 0.4, 0.65, 0.8, 0.88, 0.94, 0.97, 0.985, 0.9925, 0.998)
"""Poles that a free run starts from: the time constant grows by a half or more from one to the next."""

POLE_LIMIT = 0.9995
"""Largest pole that a window, which is right to first order alone, may suggest in free run."""

MAX_STEPS = 3
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
    Levenberg-Marquardt its floor, once with the dead zones that lie on a level held there. Pure: runs under jit and
    vmap. Double precision.

    Hot: takes one trial, observations (samples,). Many trials are best mapped all at once, because small arrays waste
    most of a kernel's time; BLOCKS cuts them to what stays in a core's cache.
    """
    reading_of(observations, reading)
    return in_blocks(partial(_initialise, reading=reading), BLOCKS[0])(observations, jnp.asarray(d_max))


def _initialise(observations: Observations, d_max: Array, reading: str) -> Setup:
    weight, count = _linear_weight(observations)
    search = in_blocks(partial(_search, reading=reading), BLOCKS[1])
    start, on_level = search(observations, weight, d_max)
    read = reading_of(observations, reading)
    cost = _cost(observations, read, weight)
    refined, steps = jax.vmap(lambda held: _refine(cost, read, d_max, start, held))(
        jnp.stack([on_level, jnp.zeros_like(on_level)])
    )
    point, lowest, numerator = cost.best(jnp.concatenate([start[None], refined]))
    return Setup(
        difference=Difference(point[2:], numerator[:, :2], -numerator[:, 2:]),
        dead_zone=point[:2],
        cost=lowest,
        weight=Increment(weight[0], weight[1]),
        ok=jnp.isfinite(lowest) & jnp.all(jnp.isfinite(numerator)) & (count > UNKNOWNS),
        steps=jnp.max(steps),
    )


def _search(observations: Observations, weight: PerChannel, d_max: Array, reading: str) -> tuple[SearchPoint, Array]:
    """The lowest point (4,) of finer and finer windows, and which of its dead zones lie on a level of the commands."""
    sizes = jnp.abs(jnp.stack(observations.command))
    levels = jnp.where(sizes <= d_max, sizes, 0.0)
    coarse, fine = (d_max * jnp.array(widths) for widths in (COARSE_WIDTHS, FINE_WIDTHS))
    cost = _cost(observations, one_step(observations), weight)
    point = jnp.stack([0.5 * d_max, 0.5 * d_max, 0.0, 0.0])
    if reading == "free_run":
        point = _zoom(cost, point, levels, d_max, coarse[:1], COARSE)
        cost = _cost(observations, free_run(observations), weight)
        point = jnp.concatenate([jnp.full(2, 0.5 * d_max), _best_poles(cost, point)])
    point = _zoom(cost, point, levels, d_max, coarse, COARSE)
    point = _zoom(cost, point, levels, d_max, fine, FINE)
    return point, jnp.any(levels == point[:2, None], axis=1)


def _linear_weight(observations: Observations) -> tuple[PerChannel, Array]:
    """Root-mean-square residual (2,) of (19)-(20), the one-step fit without dead zones, and of how many samples."""
    read = one_step(observations)
    count = jnp.sum(usable(observations))
    residual = jax.vmap(lambda y: linear_residual(read, observations, y))(jnp.stack(observations.increment))
    mean = jnp.sum(residual**2, axis=1) / jnp.maximum(count, 1)
    return jnp.maximum(jnp.sqrt(mean), SMALLEST_WEIGHT), count


def _cost(observations: Observations, reading: Reading, weight: PerChannel) -> Cost:
    limit = jnp.abs(reading.pole(jnp.asarray(jnp.inf))) * POLE_LIMIT
    inputs, increments = inputs_of(observations), jnp.stack(observations.increment)

    def around(point: Array, rights: Array, lefts: Array) -> tuple[Array, Array]:
        squares, poles = profile(reading, inputs, increments, point, rights, lefts)
        return jnp.sum(squares / weight[:, None, None] ** 2, axis=0), jnp.clip(poles, -limit, limit)

    return Cost(lambda point: project(reading, observations, point), around, weight)


def _best_poles(cost: Cost, point: SearchPoint) -> PerChannel:
    """For each channel the best (2,) of POLES: given the dead zones, the channels share nothing."""
    poles = jnp.asarray(POLES)
    left = jax.vmap(lambda pole: cost.left(point.at[2:].set(pole)).residual)(poles)
    return poles[jnp.argmin(jnp.sum(left**2, axis=2), axis=0)]


def _zoom(cost: Cost, point: SearchPoint, levels: Array, d_max: Array, halves: Array, count: int) -> SearchPoint:
    """The lowest point (4,) that windows of some half-widths (n,) find, each around the best of the one before.

    A window holds `count` dead zones of either wheel and the level of its commands, levels (2, n), that lies nearest
    to the middle: a minimum on a kink is met, not approached.
    """

    def look(centre, half):
        grid = jnp.clip(centre[:2, None] + half * jnp.linspace(-1.0, 1.0, count), 0.0, d_max)
        nearest = jnp.argmin(jnp.abs(levels - centre[:2, None]), axis=1)
        kinks = jnp.take_along_axis(levels, nearest[:, None], axis=1)
        widths = jnp.concatenate([grid, kinks], axis=1)
        costs, poles = cost.around(centre, *widths)
        right, left = jnp.unravel_index(jnp.argmin(costs), costs.shape)
        return jnp.stack([widths[0, right], widths[1, left], *poles[:, right, left]]), None

    return jax.lax.scan(look, point, halves)[0]


def _refine(cost: Cost, reading: Reading, d_max: Array, start: SearchPoint, held: Array) -> tuple[SearchPoint, Array]:
    """Levenberg-Marquardt from one point, in coordinates that cannot leave the bounds: the end, and the steps.

    held (2,): dead zones that stay. The residuals and their slopes go to the search as four numbers a channel with
    the same inner products.
    """
    import lineax  # here, for both take 0.3 s, and maximum likelihood has no use for them
    import optimistix

    def triangles(point):
        return jax.vmap(triangle)(cost.left(point).products / cost.weight[:, None, None] ** 2)

    @jax.custom_jvp
    def residual(point):
        return triangles(point)[:, :, 3]

    @residual.defjvp
    def _(primals, tangents):
        table = triangles(*primals)
        width, pole = tangents[0][:2], tangents[0][2:, None]
        return table[:, :, 3], table[:, :, :2] @ width + pole * table[:, :, 2]

    def inside(coordinates):
        widths = jnp.where(held, start[:2], d_max * jnp.sin(coordinates[:2]) ** 2)
        return jnp.concatenate([widths, reading.pole(coordinates[2:])])

    search: optimistix.Solution = optimistix.least_squares(
        lambda coordinates, _: residual(inside(coordinates)),
        optimistix.LevenbergMarquardt(RTOL, ATOL, linear_solver=lineax.Normal(lineax.Cholesky())),
        jnp.concatenate([jnp.arcsin(jnp.sqrt(start[:2] / d_max)), reading.coordinate(start[2:])]),
        max_steps=MAX_STEPS,
        throw=False,
    )
    return inside(search.value), search.stats["num_steps"]

"""The likelihood around a point: its value, gradient and expected curvature, by derivatives through the simulator.

With z and log s of `likelihood`, gradient and expected curvature of -log p are sums over samples of
    z dz + dlog s / 2        and        E' E + dlog s' dlog s / 2,   E = dz + z dlog s / 2
(E is the derivative of the innovation over sqrt(s)). A standard deviation of white errors divides z, dz and E of its
sensor, and nothing else: its optimum for the rest, and all sums there, follow from the sums at any other deviation.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array, Column
from jaxident.estimation.poses.likelihood import Innovations, innovations
from jaxident.estimation.poses.parameters import Law, bounds, names
from jaxident.estimation.poses.runs import Runs, run_axes

START_STATES = 5
SMALLEST_SQUARE = 1e-30
"""Mean square of innovations below which a deviation falls no further in one step."""


class Point(NamedTuple):
    """Unknowns: shared vector (unknowns,), start states (runs, 5)."""

    shared: Any
    starts: Any


class Local(NamedTuple):
    """-log p at a point, its gradient in both parts, and expected curvature: shared (unknowns, unknowns), of each start
    (runs, 5, 5), and between them (runs, unknowns, 5)."""

    value: Any
    gradient: Point
    shared: Any
    starts: Any
    between: Any


class Sums(NamedTuple):
    """Sums over the samples of one run, in its shared and own unknowns (n,).

    Of each sensor (sensors,): count of numbers; squares z^2; slope z dz (sensors, n); curvature E' E (sensors, n, n).
    Of all together: log_variance log s, log_slope dlog s (n,), log_curvature dlog s' dlog s (n, n). found: the
    innovations themselves.
    """

    count: Any
    squares: Any
    slope: Any
    curvature: Any
    log_variance: Any
    log_slope: Any
    log_curvature: Any
    found: Any


def local_at(point: Point, runs: Runs, law: Law) -> Local:
    """Value, gradient and expected curvature at a point."""
    sums = sums_at(point, runs, law)
    return _local(sums, jnp.zeros(sums.count.shape[1]), len(point.shared))


def local_at_best_deviations(point: Point, runs: Runs, law: Law) -> tuple[Point, Local]:
    """The point with the deviations of white errors at their optimum for the rest, and the same three there. With slip
    the camera's deviations divide more than z, and stay."""
    return at_best_deviations(point, sums_at(point, runs, law), law)


def at_best_deviations(point: Point, sums: Sums, law: Law) -> tuple[Point, Local]:
    """The same from the sums at the point."""
    mean = jnp.sum(sums.squares, axis=0) / jnp.maximum(jnp.sum(sums.count, axis=0), 1)
    moves = np.array([name == "wheel_noise" or not law.slip for name in deviations(law)])
    change = jnp.where(moves, 0.5 * jnp.log(jnp.maximum(mean, SMALLEST_SQUARE)), 0.0)
    low, high = bounds(law, jnp.inf)
    place = np.array([names(law).index(name) for name in deviations(law)])
    shared = point.shared.at[place].set(jnp.clip(point.shared[place] + change, low[place], high[place]))
    return point._replace(shared=shared), _local(sums, (shared - point.shared)[place], len(shared))


def deviations(law: Law) -> tuple[str, ...]:
    """The standard deviation of each sensor: of positions, headings and, where the law has them, wheel speeds."""
    return ("position", "heading", "wheel_noise") if law.wheels else ("position", "heading")


def _local(sums: Sums, change: Array, cut: int) -> Local:
    """From sums over each run (runs, ...), where the logarithms of the deviations (sensors,) changed by so much."""
    part = jnp.exp(-2.0 * change)
    value = sums.squares @ part + sums.log_variance + 2.0 * sums.count @ change
    gradient = jnp.einsum("s,rsn->rn", part, sums.slope) + 0.5 * sums.log_slope
    curvature = jnp.einsum("s,rsnm->rnm", part, sums.curvature) + 0.5 * sums.log_curvature
    return Local(
        0.5 * jnp.sum(value),
        Point(jnp.sum(gradient[:, :cut], axis=0), gradient[:, cut:]),
        jnp.sum(curvature[:, :cut, :cut], axis=0),
        curvature[:, cut:, cut:],
        curvature[:, :cut, cut:],
    )


def sums_at(point: Point, runs: Runs, law: Law) -> Sums:
    """The sums over each run (runs, ...)."""
    of_run = _general_sums if law.memory or law.slip or law.wheels else _white_sums
    unknowns = jnp.concatenate([jnp.tile(point.shared, (len(point.starts), 1)), point.starts], axis=1)
    return jax.vmap(lambda own, run: of_run(own, run, law), in_axes=(0, run_axes(runs)))(unknowns, runs)


def _general_sums(unknowns: Column, run: Runs, law: Law) -> Sums:
    """The sums over one run at its shared and own unknowns (n,)."""

    def both(unknowns: Column) -> tuple[Innovations, Innovations]:
        found = innovations(unknowns[:-START_STATES], unknowns[-START_STATES:], run, law)
        return found, found

    slopes, found = jax.jacfwd(both, has_aux=True)(unknowns)
    z, log_variance = _by_sensor(found, ())
    dz, dlog = _by_sensor(slopes, (len(unknowns),))
    error = [one + 0.5 * size[:, None] * log for one, size, log in zip(dz, z, dlog, strict=True)]
    together = jnp.concatenate(dlog)
    return Sums(
        count=_counts(run, law),
        squares=jnp.stack([size @ size for size in z]),
        slope=jnp.stack([size @ one for size, one in zip(z, dz, strict=True)]),
        curvature=jnp.stack([one.T @ one for one in error]),
        log_variance=jnp.sum(jnp.concatenate(log_variance)),
        log_slope=jnp.sum(together, axis=0),
        log_curvature=together.T @ together,
        found=found,
    )


def _white_sums(unknowns: Column, run: Runs, law: Law) -> Sums:
    """The same where the camera error is white and nothing slips, in closed form by both deviations."""
    size, first = len(unknowns), names(law).index("position")
    sensor, own = np.arange(2), first + np.arange(2)
    others = np.delete(np.arange(size), own)

    def both(moving: Column) -> tuple[Array, Innovations]:
        whole = unknowns.at[others].set(moving)
        found = innovations(whole[:-START_STATES], whole[-START_STATES:], run, law)
        return found.normalised, found

    slope, found = jax.jacfwd(both, has_aux=True)(unknowns[others])
    dz = slope[:2].reshape(-1, len(others)), slope[2]
    z, log_variance = _by_sensor(found, ())
    count, squares = _counts(run, law), jnp.stack([one @ one for one in z])
    slopes = jnp.stack([one @ by for one, by in zip(z, dz, strict=True)])
    curvature = jnp.stack([by.T @ by for by in dz])
    return Sums(
        count=count,
        squares=squares,
        slope=jnp.zeros((2, size)).at[:, others].set(slopes).at[sensor, own].set(-squares),
        curvature=jnp.zeros((2, size, size)).at[:, others[:, None], others].set(curvature),
        log_variance=jnp.sum(jnp.concatenate(log_variance)),
        log_slope=jnp.zeros(size).at[own].set(2.0 * count),
        log_curvature=jnp.zeros((size, size)).at[own, own].set(4.0 * count),
        found=found,
    )


def _by_sensor(found: Innovations, tail: tuple[int, ...]) -> tuple[list[Array], list[Array]]:
    """Innovations and log variances of each sensor (numbers, *tail); slopes have a tail."""

    def parts(camera: Array, wheels: Array | None) -> list[Array]:
        own = camera[:2], camera[2:], *(() if wheels is None else (wheels,))
        return [part.reshape(-1, *tail) for part in own]

    return parts(found.normalised, found.turning), parts(found.log_variance, found.turning_log_variance)


def _counts(run: Runs, law: Law) -> Array:
    """How many numbers each sensor has measured (sensors,)."""
    seen = jnp.sum(run.seen)
    counts = [2.0 * seen, 1.0 * seen, *([1.0 * jnp.sum(jnp.stack(run.turning))] if law.wheels else [])]
    return jnp.stack(counts)

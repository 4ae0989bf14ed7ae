"""A first estimate from the data alone: a global search in which everything but dead zones and rates is linear.

For given dead zones D and rate r, heading is linear in the gains of its row and in each window's heading and turn rate
at its start; with the measured heading as direction, so are x and y in the gains of theirs. Windows with a start of
their own keep slip and drift from piling up. Concentrated over the noise, each channel's cost is n/2 log(squares),
the two are added, and finer grids follow around the lowest pairs of dead zones on a grid.
"""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array
from jaxident.estimation.poses.runs import Runs, rows_used
from jaxident.numerics import hold_integrals, safe_divide, sin_cos
from jaxident.robot.dead_zone import dead_zone

WIDTHS, RATES, LOOKS, FINER = 9, 7, 3, 3.0
"""Dead zones and rates in a grid, how many grids, each FINER times as fine as the one before."""
FOLLOWED = 20
"""Points of the first grid that finer ones follow, over the square of the number of windows: of several windows the
best alone will do, of one the right valley is not always the deepest at first (`experiments/efficiency.md`)."""
MORE = 2
"""Grids more where several points are followed: a short run has kinks beside its optimum, at levels of its commands."""
SLOWEST, FASTEST = 0.25, 2.5
"""Rates searched first: from SLOWEST per window to FASTEST per step."""


class Channel(NamedTuple):
    """One channel of windows, rows first as scans take them: measured coordinates (rows, coordinates, windows) less
    their mean (coordinates, windows) over each window, the direction in which a path counts (rows, coordinates,
    windows), and weights 1 or 0 (rows, windows)."""

    measured: Any
    mean: Any
    direction: Any
    weight: Any


class Fits(NamedTuple):
    """Squares left for every rate and pair of dead zones (rates, right, left), and both gains there (..., 2)."""

    squares: Any
    gain: Any


class Start(NamedTuple):
    """A first estimate: rate (2,), gain (2, 2), dead_zone (2,), and root-mean-square residual (2,) [m], [rad]."""

    rate: Any
    gain: Any
    dead_zone: Any
    residual: Any


def first_estimate(pair: tuple[Channel, Channel], windows: Runs, d_max: Array) -> Start:
    """The best of LOOKS grids over dead zones in [0, d_max] and rates; windows (windows, rows) and their channels.

    The first grid's best points, as many as FOLLOWED says, each lead to finer ones around them; if they are several,
    MORE grids follow around the best of all.
    """
    rows, step = rows_used(windows), jnp.mean(windows.step)
    counts = jnp.stack([jnp.sum(c.weight) * c.measured.shape[1] for c in pair])
    first = jnp.geomspace(SLOWEST / (rows * step), FASTEST / step, RATES)
    spread = (first[1] / first[0]) ** jnp.linspace(-1.0, 1.0, RATES)

    def look(best, finer):
        """The best of a grid around a point, in rates and dead zones so many times finer than the first."""
        sides = 0.5 * d_max / finer * jnp.linspace(-1.0, 1.0, WIDTHS)
        widths = jnp.clip(best.dead_zone[:, None] + sides, 0.0, d_max)
        rates = best.rate[:, None] * spread ** (FINER / finer)
        found, cost = _search(pair, windows, rates, widths, counts, 1)
        return jax.tree.map(lambda leaf: leaf[0], (found, cost))

    def follow(point, finer):
        """From a point (Start, cost) through grids so many times finer to the last one's best."""
        return jax.lax.scan(lambda now, finer: (look(now[0], finer), None), point, finer)[0]

    widths = jnp.linspace(0.0, d_max, WIDTHS)
    many = max(1, FOLLOWED // len(windows.seen) ** 2)
    points = _search(pair, windows, jnp.tile(first, (2, 1)), jnp.tile(widths, (2, 1)), counts, many)
    found, cost = jax.lax.map(partial(follow, finer=FINER ** jnp.arange(1.0, LOOKS)), points)
    best = jax.tree.map(lambda leaf: leaf[jnp.argmin(cost)], found)
    if many > 1:
        best, _ = follow((best, jnp.min(cost)), FINER ** jnp.arange(LOOKS, LOOKS + MORE))
    return best._replace(residual=jnp.sqrt(best.residual / jnp.maximum(counts, 1.0)))


def channels(windows: Runs) -> tuple[Channel, Channel]:
    """Position and heading of windows as channels; the heading is unwrapped and bridged where it is missing."""
    seen = windows.seen
    heading = jax.vmap(_bridge)(windows.pose.theta, seen)
    turn = jnp.diff(heading, axis=1, append=heading[:, -1:])
    sine, cosine = sin_cos(heading + 0.5 * turn)
    chord = jnp.sinc(turn / (2.0 * jnp.pi))

    def channel(measured, direction):
        measured, direction = (jnp.moveaxis(jnp.stack(part), 2, 0) for part in (measured, direction))
        weight = seen.T.astype(float)
        mean = _mean(weight, measured)
        return Channel(measured - mean, mean, direction, weight)

    along = channel([windows.pose.x, windows.pose.y], [chord * cosine, chord * sine])
    return along, channel([heading], [jnp.ones_like(heading)])


def _mean(weight: Array, columns: Array) -> Array:
    """Mean (..., windows) over weighted rows of columns (rows, ..., windows)."""
    return jnp.einsum("rw,r...w->...w", weight, columns) / jnp.maximum(jnp.sum(weight, axis=0), 1.0)


def _bridge(theta: Array, seen: Array) -> Array:
    """Heading (rows,) without jumps, linear between the rows where it was seen."""
    rows = jnp.arange(len(theta))
    before = jax.lax.cummax(jnp.where(seen, rows, -1))
    after = jax.lax.cummin(jnp.where(seen, rows, len(theta)), reverse=True)
    before = jnp.where(before < 0, jnp.minimum(after, len(theta) - 1), before)
    after = jnp.where(after >= len(theta), before, after)
    last = jnp.concatenate([before[:1], before[:-1]])
    change = jnp.where(seen, theta - theta[last], 0.0)
    whole = theta[before[0]] + jnp.cumsum(change - 2.0 * jnp.pi * jnp.round(change / (2.0 * jnp.pi)))
    part = safe_divide(rows - before, after - before, jnp.zeros(len(theta)))
    return whole[before] + part * (whole[after] - whole[before])


def _search(pair: tuple, windows: Runs, rates: Array, widths: Array, counts: Array, many: int) -> tuple[Start, Array]:
    """The best points (many, ...) of a grid, their squares (2,) in `residual`, and their costs (many,).

    rates (2, RATES), widths (2, WIDTHS), counts (2,): how many numbers each channel has.
    """
    fits = [_fit(channel, windows, rate, widths) for channel, rate in zip(pair, rates, strict=True)]
    cost = sum(n * jnp.log(jnp.min(fit.squares, axis=0)) for n, fit in zip(counts, fits, strict=True))

    def at(place):
        right, left = jnp.unravel_index(place, cost.shape)
        best = [jnp.argmin(fit.squares[:, right, left]) for fit in fits]
        return Start(
            rate=jnp.stack([rate[k] for rate, k in zip(rates, best, strict=True)]),
            gain=jnp.stack([fit.gain[k, right, left] for fit, k in zip(fits, best, strict=True)]),
            dead_zone=jnp.stack([widths[0][right], widths[1][left]]),
            residual=jnp.stack([fit.squares[k, right, left] for fit, k in zip(fits, best, strict=True)]),
        )

    falling, places = jax.lax.top_k(-cost.ravel(), many)
    return jax.vmap(at)(places), -falling


@jax.jit
def _fit(channel: Channel, windows: Runs, rates: Array, grid: Array) -> Fits:
    """Least squares in both gains and every window's start, for all rates and pairs of dead zones (2, widths).

    Under `jit` to be traced once for the first grid and the finer ones.
    """
    passed = [dead_zone(u.T[..., None], widths) for u, widths in zip(windows.command, grid, strict=True)]
    pull = jnp.concatenate(passed, axis=-1)
    step = windows.step if jnp.ndim(windows.step) == 0 else windows.step.T[..., None]
    products = jax.lax.map(lambda rate: _products(channel, step, pull, rate), rates)
    widths = grid.shape[1]
    gram, cross, power = products[:, :-1, :-1], products[:, :-1, -1], products[:, -1, -1]
    a, c = (jnp.diagonal(gram[:, cut, cut], axis1=1, axis2=2) for cut in (slice(None, widths), slice(widths, None)))
    a, b, c = a[:, :, None], gram[:, :widths, widths:], c[:, None, :]
    u, v = cross[:, :widths, None], cross[:, None, widths:]
    determinant = a * c - b * b
    regular = determinant > 1e-9 * a * c
    safe = jnp.where(regular, determinant, 1.0)
    gains = [jnp.where(regular, top / safe, 0.0) for top in (c * u - b * v, a * v - b * u)]
    squares = power[:, None, None] - gains[0] * u - gains[1] * v
    return Fits(jnp.maximum(squares, 1e-14 * power[:, None, None] + 1e-300), jnp.stack(gains, axis=-1))


def _products(channel: Channel, step: Array, pull: Array, rate: Array) -> Array:
    """Inner products (columns + 1, columns + 1) at one rate of the paths that accelerations (rows, windows, columns)
    cause and, last, of the data; start position and start speed of every window projected out.

    The projections are made on the products: made on the paths themselves they pass through memory again and again.
    """
    weight = channel.weight[:, None]
    table = weight[..., None] * _lay(rate, step, pull, channel.direction)
    table = jnp.concatenate([table, (weight * channel.measured)[..., None]], axis=-1).transpose(2, 3, 1, 0)
    sums = jnp.sum(table, axis=3)
    table = table.reshape(*table.shape[:2], -1)
    products = table @ table.swapaxes(1, 2)
    count = jnp.maximum(jnp.sum(channel.weight, axis=0), 1.0)[:, None, None]
    products = products - sums @ sums.swapaxes(1, 2) / count
    coast = products[:, :1]
    share = safe_divide(coast, coast[:, :, :1], jnp.zeros(()))
    return jnp.sum(products - share.swapaxes(1, 2) * coast, axis=0)[1:, 1:]


def _lay(rate: Array, step: Array, pull: Array, direction: Array) -> Array:
    """Coordinates (rows, coordinates, windows, 1 + columns) of paths laid along a direction per row (rows, coordinates,
    windows): first of coasting from speed 1, then from rest under accelerations (rows, windows, columns)."""
    even = jnp.ndim(step) == 0
    shared = hold_integrals(rate, step)
    pull = jnp.concatenate([jnp.zeros_like(pull[..., :1]), pull], axis=-1)

    def body(now, row):
        speed, place = now
        own, pull, direction = row
        decay, once, twice = shared if even else own
        moved = place + (once * speed + twice * pull) * direction[..., None]
        return (decay * speed + once * pull, moved), place

    first = jnp.zeros(pull.shape[1:]).at[:, 0].set(1.0)
    place = jnp.zeros((direction.shape[1], *first.shape))
    return jax.lax.scan(body, (first, place), (None if even else shared, pull, direction))[1]


def start_states(start: Start, pair: tuple[Channel, Channel], windows: Runs) -> Array:
    """The state (windows, 5) x, y, theta, v, w at the first row of every window, by the same least squares."""
    step = windows.step if jnp.ndim(windows.step) == 0 else windows.step.T[..., None]
    passed = [dead_zone(u.T, width) for u, width in zip(windows.command, start.dead_zone, strict=True)]

    def of_channel(channel, row):
        weight = channel.weight
        pull = sum(gain * m for gain, m in zip(start.gain[row], passed, strict=True))[..., None]
        laid = _lay(start.rate[row], step, pull, channel.direction)
        coast, rest = laid[..., 0], channel.measured - laid[..., 1]
        mean_coast, mean_rest = _mean(weight, coast), _mean(weight, rest)
        centred = weight[:, None] * (coast - mean_coast)
        power = jnp.sum(centred**2, axis=(0, 1))
        speed = safe_divide(jnp.sum(centred * rest, axis=(0, 1)), power, jnp.zeros(()))
        return channel.mean + mean_rest - speed * mean_coast, speed[None]

    (position, v), (heading, w) = (of_channel(channel, row) for row, channel in enumerate(pair))
    return jnp.concatenate([position, heading, v, w]).T

"""A first estimate from the data alone: a global search in which everything but dead zones and rates is linear.

For given dead zones D and rate r, heading is linear in the gains of its row and in each window's heading and turn rate
at its start; with the measured heading as direction, so are x and y in the gains of theirs. Windows with a start of
their own keep slip and drift from piling up. Concentrated over the noise, each channel's cost is n/2 log(squares),
the two are added, and the lowest pair of dead zones on a grid wins; a second, finer grid follows.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Wheels
from jaxident.estimation.runs import Runs
from jaxident.numerics import hold_integrals, safe_divide, sin_cos
from jaxident.robot.dead_zone import dead_zone

WIDTHS, RATES, LOOKS, FINER = 9, 7, 3, 3.0
"""Dead zones and rates in a grid, how many grids, each FINER times as fine in dead zones as the one before; in rates
the next grid spans the neighbours of the best."""
SLOWEST, FASTEST = 0.25, 2.5
"""Rates searched first: from SLOWEST per window to FASTEST per step."""


class Channel(NamedTuple):
    """One channel of windows (windows, rows): measured coordinates (windows, rows, coordinates), the direction in which
    a path counts (windows, rows, coordinates), and weights 1 or 0 (windows, rows)."""

    measured: Any
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


def first_estimate(windows: Runs, d_max: Array) -> Start:
    """The best of two grids over dead zones in [0, d_max] and rates; windows (windows, rows)."""
    pair = channels(windows)
    rows, step = windows.seen.shape[1], jnp.mean(windows.step)
    counts = jnp.stack([jnp.sum(c.weight) * c.measured.shape[-1] for c in pair])

    def look(grid, finer):
        """The best of a grid (rates (2, RATES), widths (2, WIDTHS)), and the next grid around it."""
        rates, widths = grid
        best = _search(pair, windows, rates, widths, counts)
        spread = (rates[0, 1] / rates[0, 0]) ** jnp.linspace(-1.0, 1.0, RATES)
        sides = 0.5 * d_max * finer * jnp.linspace(-1.0, 1.0, WIDTHS)
        return (best.rate[:, None] * spread, jnp.clip(best.dead_zone[:, None] + sides, 0.0, d_max)), best

    rates = jnp.geomspace(SLOWEST / (rows * step), FASTEST / step, RATES)
    widths = jnp.linspace(0.0, d_max, WIDTHS)
    first = jnp.tile(rates, (2, 1)), jnp.tile(widths, (2, 1))
    _, found = jax.lax.scan(look, first, FINER ** -jnp.arange(1.0, LOOKS + 1))
    best = jax.tree.map(lambda leaf: leaf[-1], found)
    return best._replace(residual=jnp.sqrt(best.residual / jnp.maximum(counts, 1.0)))


def channels(windows: Runs) -> tuple[Channel, Channel]:
    """Position and heading of windows as channels; the heading is unwrapped and bridged where it is missing."""
    seen = windows.seen
    heading = jax.vmap(_bridge)(windows.pose.theta, seen)
    turn = jnp.diff(heading, axis=1, append=heading[:, -1:])
    sine, cosine = sin_cos(heading + 0.5 * turn)
    chord = jnp.sinc(turn / (2.0 * jnp.pi))
    position = jnp.stack([windows.pose.x, windows.pose.y], axis=-1)
    along = Channel(position, jnp.stack([chord * cosine, chord * sine], axis=-1), seen.astype(float))
    return along, Channel(heading[..., None], jnp.ones_like(heading)[..., None], seen.astype(float))


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


def _search(pair: tuple, windows: Runs, rates: Array, widths: Array, counts: Array) -> Start:
    """The best point of a grid, its squares (2,) in `residual`; counts (2,): how many numbers each channel has."""
    fits = [_fit(channel, windows, rate, widths) for channel, rate in zip(pair, rates, strict=True)]
    costs = [n * jnp.log(jnp.min(fit.squares, axis=0)) for n, fit in zip(counts, fits, strict=True)]
    right, left = jnp.unravel_index(jnp.argmin(costs[0] + costs[1]), costs[0].shape)
    best = [jnp.argmin(fit.squares[:, right, left]) for fit in fits]
    return Start(
        rate=jnp.stack([rate[k] for rate, k in zip(rates, best, strict=True)]),
        gain=jnp.stack([fit.gain[k, right, left] for fit, k in zip(fits, best, strict=True)]),
        dead_zone=jnp.stack([widths[0][right], widths[1][left]]),
        residual=jnp.stack([fit.squares[k, right, left] for fit, k in zip(fits, best, strict=True)]),
    )


def _fit(channel: Channel, windows: Runs, rates: Array, grid: Array) -> Fits:
    """Least squares in both gains and every window's start, for all rates and pairs of dead zones."""
    axis = None if jnp.ndim(windows.step) == 0 else 0

    def moments(channel, step, command, time):
        return jax.vmap(lambda rate: _moments(channel, step, command, grid, rate))(rates)

    every = jax.vmap(moments, in_axes=(0, axis, 0, None))(channel, windows.step, windows.command, None)
    gram, cross, power = (jnp.sum(part, axis=0) for part in every)
    right, left = gram[:, 0, 0], gram[:, 1, 1]
    a = jnp.diagonal(right, axis1=1, axis2=2)[:, :, None]
    c = jnp.diagonal(left, axis1=1, axis2=2)[:, None, :]
    b, u, v = gram[:, 0, 1], cross[:, 0, :, None], cross[:, 1, None, :]
    determinant = a * c - b * b
    regular = determinant > 1e-9 * a * c
    safe = jnp.where(regular, determinant, 1.0)
    gains = [jnp.where(regular, top / safe, 0.0) for top in (c * u - b * v, a * v - b * u)]
    squares = power[:, None, None] - gains[0] * u - gains[1] * v
    return Fits(jnp.maximum(squares, 1e-14 * power[:, None, None] + 1e-300), jnp.stack(gains, axis=-1))


def _moments(channel: Channel, step: Array, command: Wheels, grid: Array, rate: Array):
    """Gram matrix (wheels, wheels, widths, widths), products with the data (wheels, widths) and the data's power of one
    window at one rate, start position and start speed projected out."""
    weight = channel.weight[:, None]

    def centred(coordinates):
        mean = jnp.sum(weight[..., None] * coordinates, axis=0) / jnp.maximum(jnp.sum(channel.weight), 1.0)
        return weight[..., None] * (coordinates - mean)

    passed = jnp.stack([dead_zone(u[:, None], widths) for u, widths in zip(command, grid, strict=True)], axis=1)
    laid = centred(_lay(rate, step, passed.reshape(len(passed), -1), channel.direction))
    data = centred(channel.measured[:, None, :])
    table = jnp.concatenate([laid, data], axis=1).transpose(1, 0, 2).reshape(laid.shape[1] + 1, -1)
    products = table @ table.T
    free = products[1:, 1:] - safe_divide(
        products[1:, :1] * products[:1, 1:], products[0, 0], jnp.zeros_like(products[1:, 1:])
    )
    wheels, widths = grid.shape
    gram = free[:-1, :-1].reshape(wheels, widths, wheels, widths).transpose(0, 2, 1, 3)
    return gram, free[:-1, -1].reshape(wheels, widths), free[-1, -1]


def _lay(rate: Array, step: Array, pull: Array, direction: Array) -> Array:
    """Coordinates (rows, 1 + columns, coordinates) of paths laid along a direction per row (rows, coordinates): first
    that of coasting from speed 1, then those from rest under accelerations (rows, columns)."""
    holds = (jnp.broadcast_to(p, pull.shape[:1]) for p in hold_integrals(rate, step))
    pull = jnp.concatenate([jnp.zeros_like(pull[:, :1]), pull], axis=1)

    def body(now, row):
        speed, place = now
        decay, once, twice, pull, direction = row
        place_next = place + (once * speed + twice * pull)[:, None] * direction
        return (decay * speed + once * pull, place_next), place

    columns = pull.shape[1]
    first = jnp.zeros(columns).at[0].set(1.0), jnp.zeros((columns, direction.shape[1]))
    return jax.lax.scan(body, first, (*holds, pull, direction))[1]


def start_states(start: Start, windows: Runs) -> Array:
    """The state (windows, 5) x, y, theta, v, w at the first row of every window, by the same least squares."""
    pair = channels(windows)

    def of_window(step, command, channel, row):
        passed = [dead_zone(u, width) for u, width in zip(command, start.dead_zone, strict=True)]
        pull = sum(gain * m for gain, m in zip(start.gain[row], passed, strict=True))
        laid = _lay(start.rate[row], step, pull[:, None], channel.direction)
        weight = channel.weight[:, None]
        count = jnp.maximum(jnp.sum(channel.weight), 1.0)
        rest = channel.measured - laid[:, 1]
        mean_coast, mean_rest = (jnp.sum(weight * c, axis=0) / count for c in (laid[:, 0], rest))
        centred = weight * (laid[:, 0] - mean_coast)
        speed = safe_divide(jnp.sum(centred * rest), jnp.sum(centred**2), jnp.zeros(()))
        return mean_rest - speed * mean_coast, speed

    axis = None if jnp.ndim(windows.step) == 0 else 0
    over = jax.vmap(of_window, in_axes=(axis, 0, 0, None))
    (position, v), (heading, w) = (over(windows.step, windows.command, c, row) for row, c in enumerate(pair))
    return jnp.concatenate([position, heading, v[:, None], w[:, None]], axis=1)

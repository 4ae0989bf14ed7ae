from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Increment, Wheels
from jaxident.estimation.least_squares import Solution, solve_columns, solve_normal
from jaxident.estimation.observations import Observations
from jaxident.robot.dead_zone import dead_zone

POLE_LIMIT = 1.0 - 1e-6
POLES = (0.0, 0.4, 0.65, 0.8, 0.88, 0.94, 0.97, 0.985, 0.9925, 0.998)


class Profile(NamedTuple):
    cost: Array
    alpha: tuple


def channel_profile(right, left, extra, target) -> Solution:
    n, m = right.shape[1], left.shape[1]
    pair = jnp.stack([extra, target])
    table = jnp.concatenate([right.reshape(2 * n, -1), pair]) @ jnp.concatenate([left.reshape(2 * m, -1), pair]).T
    r, r_before = table[:n], table[n : 2 * n]
    now, before = slice(0, m), slice(m, 2 * m)
    e, t = table[2 * n], table[2 * n + 1]

    def within(wheel):
        return [[jnp.sum(a * b, -1) for b in wheel] for a in wheel]

    rr = [[p[:, None] for p in row] for row in within(right)]
    ll = [[p[None, :] for p in row] for row in within(left)]
    gram = [
        [rr[0][0]],
        [rr[1][0], rr[1][1]],
        [r[:, now], r_before[:, now], ll[0][0]],
        [r[:, before], r_before[:, before], ll[1][0], ll[1][1]],
        [r[:, 2 * m, None], r_before[:, 2 * m, None], e[None, now], e[None, before], e[2 * m]],
    ]
    moments = [r[:, -1:], r_before[:, -1:], t[None, now], t[None, before], e[-1]]
    return solve_normal(gram, moments, t[-1])


def _shift(x, axis=0):
    return jnp.concatenate([jnp.zeros_like(x[:1]), x[:-1]])


class OneStep(NamedTuple):
    command: Wheels
    before: Wheels
    past: Increment
    target: Increment


def prepare_one_step(o: Observations) -> OneStep:
    seen_before = _shift(o.seen)
    single = o.measured & (o.first | seen_before)
    use = single & ~o.first & _shift(single)
    mask = lambda x: jnp.where(use, x, 0.0)
    return OneStep(
        Wheels(*map(mask, o.command)),
        Wheels(*map(mask, o.command_before)),
        Increment(*(mask(_shift(y)) for y in o.increment)),
        Increment(*map(mask, o.increment)),
    )


def one_step_grid(data: OneStep, weight, point, width_r, width_l) -> Profile:
    right, left = (
        dead_zone(jnp.stack([u, b])[:, None, :], w[:, None])
        for u, b, w in zip(data.command, data.before, (width_r, width_l))
    )
    s = [channel_profile(right, left, p, y) for p, y in zip(data.past, data.target)]
    cost = sum(x.remainder / w**2 for x, w in zip(s, weight))
    return Profile(cost, tuple(x.coefficients[4] for x in s))


def one_step_fit(data: OneStep, width, alpha):
    columns = [dead_zone(u, d) for (u, b), d in zip(zip(data.command, data.before), width) for u in (u, b)]
    return [solve_columns(jnp.stack([*columns, p]), y) for p, y in zip(data.past, data.target)]


class FreeRun(NamedTuple):
    command: Wheels
    target: Increment
    first: Any
    restart: Any
    measured: Any


def prepare_free_run(o: Observations) -> FreeRun:
    return FreeRun(o.command, o.increment, o.first, o.first | _shift(o.seen), o.measured)


def respond(data: FreeRun, alpha, passed):
    """passed (samples, columns) -> now, before (samples, columns), gap sums."""

    def body(carry, sample):
        last, total, total_before = carry
        m, first, restart = sample
        before = jnp.where(first, 0.0, last)
        now = alpha * before + m
        total = jnp.where(restart, 0.0, total) + now
        total_before = jnp.where(restart, 0.0, total_before) + before
        return (now, total, total_before), (total, total_before)

    zero = jnp.zeros_like(passed[0]) + 0.0 * alpha
    return jax.lax.scan(body, (zero, zero, zero), (passed, data.first, data.restart))[1]


def start_gains(data: FreeRun, start):
    """start (samples,): response to the start increment, gap-summed."""

    def body(energy, sample):
        g, first, measured = sample
        energy = jnp.where(first, 0.0, energy)
        new = energy + jnp.where(measured, g * g, 0.0)
        some, old = new > 0.0, energy > 0.0
        keep = jnp.where(some, jnp.where(old, jnp.sqrt(jnp.where(old, energy, 1.0) / jnp.where(some, new, 1.0)), 0.0), 1.0)
        gain = jnp.where(old, g / jnp.where(old, energy, 1.0), 0.0)
        return new, (jnp.where(measured, keep, 0.0), gain)

    return jax.lax.scan(body, 0.0 * start[0], (start, data.first, data.measured))[1]


def eliminate_start(data: FreeRun, start, gains, columns):
    """columns (samples, n): the innovation form."""
    keep, gain = gains

    def body(known, sample):
        c, g, k, h, first, measured = sample
        known = jnp.where(first, 0.0, known)
        return known + jnp.where(measured, g * c, 0.0), k * (c - h * known)

    return jax.lax.scan(body, jnp.zeros_like(columns[0]), (columns, start, keep, gain, data.first, data.measured))[1]


def free_columns(data: FreeRun, alpha, passed, target):
    """passed (samples, n), one channel: columns (2, n, samples) and target (samples,) free of the start."""
    n = passed.shape[1]
    signals = jnp.concatenate([passed, jnp.where(data.first, 1.0, 0.0)[:, None]], axis=1)
    now, before = respond(data, alpha, signals)
    start = now[:, n]
    gains = start_gains(data, start)
    free = eliminate_start(data, start, gains, jnp.concatenate([now[:, :n], before[:, :n], target[:, None]], axis=1))
    return free[:, : 2 * n].T.reshape(2, n, -1), free[:, -1], (start, gains)


def passed_columns(data, width_r, width_l):
    return jnp.concatenate([dead_zone(u[:, None], w) for u, w in zip(data.command, (width_r, width_l))], axis=1)


def free_run_grid(data: FreeRun, weight, width_r, width_l) -> Profile:
    n = len(width_r)
    passed = passed_columns(data, width_r, width_l)

    def at_pole(alpha):
        out = []
        for y in data.target:
            columns, target, _ = free_columns(data, alpha, passed, y)
            out.append(channel_profile(columns[:, :n], columns[:, n:], jnp.zeros_like(target), target).remainder)
        return out

    poles = jnp.array(POLES)
    remainders = jax.vmap(at_pole)(poles)
    cost = sum(jnp.min(r, axis=0) / w**2 for r, w in zip(remainders, weight))
    return Profile(cost, tuple(poles[jnp.argmin(r, axis=0)] for r in remainders))


def free_run_fit(data: FreeRun, width, alpha):
    passed = passed_columns(data, width[:1], width[1:])
    out = []
    for a, y in zip(alpha, data.target):
        columns, target, _ = free_columns(data, a, passed, y)
        out.append(solve_columns(columns.transpose(1, 0, 2).reshape(4, -1), target))
    return out


def free_run_around(data: FreeRun, weight, point, width_r, width_l) -> Profile:
    """Linearised in the poles."""
    width, alpha = point
    n = len(width_r)
    centre = passed_columns(data, width[:1], width[1:])
    passed = jnp.concatenate([passed_columns(data, width_r, width_l), centre], axis=1)
    cost, alphas = 0.0, []
    for a, y, w in zip(alpha, data.target, weight):
        columns, target, (start, gains) = free_columns(data, a, passed, y)
        mid = columns[:, -2:].transpose(1, 0, 2).reshape(4, -1)
        solution, _ = solve_columns(mid, target)
        slope = pole_slope(data, a, centre, y, solution.coefficients)
        extra = eliminate_start(data, start, gains, slope[:, None])[:, 0]
        r = channel_profile(columns[:, :n], columns[:, n:-2], extra, target)
        cost = cost + r.remainder / w**2
        room = 0.5 * (1.0 - jnp.abs(a))
        alphas.append(jnp.clip(a + jnp.clip(r.coefficients[4], -room, 2 * room), -POLE_LIMIT, POLE_LIMIT))
    return Profile(cost, tuple(alphas))


def pole_slope(data, alpha, centre, target, theta):
    """d model / d alpha (samples,), gap-summed."""
    before = jnp.where(data.first[:, None], 0.0, _shift(centre))
    force = centre @ jnp.stack(theta[0::2]) + before @ jnp.stack(theta[1::2])
    # own output without start, then the start per run
    def body(carry, s):
        y, g, total, total_g = carry
        f, first, restart = s
        y = jnp.where(first, 0.0, alpha * y) + f
        g = jnp.where(first, 1.0, alpha * g)
        total = jnp.where(restart, 0.0, total) + y
        total_g = jnp.where(restart, 0.0, total_g) + g
        return (y, g, total, total_g), (y, g, total, total_g)
    z = 0.0 * alpha + 0.0 * force[0]
    _, (y, g, total, total_g) = jax.lax.scan(body, (z, z, z, z), (force, data.first, data.restart))
    def forward(carry, s):
        num, den = carry
        e, g, first, measured = s
        num = jnp.where(first, 0.0, num) + jnp.where(measured, g * e, 0.0)
        den = jnp.where(first, 0.0, den) + jnp.where(measured, g * g, 0.0)
        return (num, den), jnp.where(den > 0, num / jnp.where(den > 0, den, 1.0), 0.0)
    _, b = jax.lax.scan(forward, (z, z), (target - total, total_g, data.first, data.measured))
    last = jnp.concatenate([data.first[1:], jnp.ones(1, bool)])
    # the run's last value, carried backwards
    def backward(carry, s):
        b, last = s
        v = jnp.where(last, b, carry)
        return v, v
    _, b = jax.lax.scan(backward, z, (b, last), reverse=True)
    out = y + b * g
    past = jnp.where(data.first, 0.0, _shift(out))
    return respond(data, alpha, past[:, None])[0][:, 0]

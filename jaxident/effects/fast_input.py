"""From commands to the pushes at the wheels, over the substeps of whole runs: everything that remembers the input.

Pushes are kept as mean and slope over a substep, mean + slope (s - 1/2) for s in [0, 1]. A delay reads them from the
integrals of what the wheels were asked for, so that it switches where it should at any length.
"""

import functools
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Wheels
from jaxident.effects.effect import EffectRecord
from jaxident.effects.signals import Push, Substep
from jaxident.effects.stages import CHAIN, INPUT, acting, remembered_at_rest, static_push
from jaxident.numerics import safe_divide
from jaxident.robot.drive import Physical, force, wheel_speeds

PUSHING = tuple(effect.name for stage in INPUT for effect in CHAIN[stage] if effect.search is not None)
"""Effects that act before the wheels: beside the dead zones, pushes depend on nothing else but, by some coordinates
(`coordinates.BY_DRIVE`), on the nominal drive."""
OPTIONAL = tuple(
    effect.name for stage in ("arrival", "slew", "gear") for effect in CHAIN[stage] if effect.search is not None
)
"""Effects among these that cost where no robot has them: a late arrival reads the rows at other times, and what slews
or is in the gears takes a loop over all rows."""
Acts = Mapping[str, Array]
"""For names of OPTIONAL whether any robot of a call has the effect, truth values ()."""
SUBSTEPS = 2
"""Per row; the nominal part is exact whatever their number."""
RUN_UP = 3.0
"""Commands [s] before a stretch that bring what the input remembers to where it stands: six time constants of the
slowest lag that a search visits, and longer than any delay."""
NODES = (0.21132486540518713, 0.7886751345948129)
"""Gauss-Legendre on a substep, of third degree."""
JUST_BEFORE = 1e-9
"""Part of a step by which a delay reads early: its derivative at zero is that of a growing delay."""


def pushes(
    settings, drive: Physical, dead_zone: Array, t: Array, session: Array, command: Array, acts: Acts | None = None
) -> Push:
    """The pushes of runs: t (rows, runs) [s], session (runs,) [s], command (rows, runs, 2); dead_zone (2,). drive: what
    tells the speed of wheels that coast. acts: see `_unless_idle`."""
    return expected_pushes(settings, drive, dead_zone, t, session, command, None, acts)[0]


def expected_pushes(
    settings,
    drive: Physical,
    dead_zone: Array,
    t: Array,
    session: Array,
    command: Array,
    lost: Array | None,
    acts: Acts | None = None,
) -> tuple[Push, Array | None]:
    """The pushes that are to be expected where each command is lost with a probability, and the deviation of the jolts
    (rows, runs, 2) that losing them makes (`_expected`); with None lost, as `pushes`, and None."""
    part = _lengths(t) / SUBSTEPS
    arrived = _arrived(settings, t, session)
    own = _lengths(arrived) / SUBSTEPS
    asked, jolt = _asked(settings, dead_zone, t, session, command, own, acts), None
    if lost is not None:
        asked, jolt = _expected(asked, lost)
    read = functools.partial(_read, arrived=arrived, own=own, t=t, part=part)
    asked = _unless_idle([effect for effect, _ in acting("arrival", settings)], acts, read, asked, _in_line)
    return _remembered(settings, drive, asked, part, acts), jolt


def _unless_idle(
    effects: Sequence[EffectRecord],
    acts: Acts | None,
    run: Callable[[Any], Any],
    value: Any,
    idle: Callable[[Any], Any] = lambda same: same,
) -> Any:
    """What some effects make of a value, or what is left of it (`idle`) where `acts` says that none of them does
    anything. Without `acts`, and for effects that are not in it, they are run."""
    if acts is None or any(effect.name not in acts for effect in effects):
        return run(value)
    return jax.lax.cond(functools.reduce(operator.or_, (acts[effect.name] for effect in effects)), run, idle, value)


def _lengths(t: Array) -> Array:
    """Steps (rows, runs) from each row to the next; that of the last is a second."""
    return jnp.diff(t, axis=0, append=t[-1:] + 1.0)


def _arrived(settings, t: Array, session: Array) -> Array:
    """When the commands of rows (rows, runs) take effect."""
    for effect, values in acting("arrival", settings):
        t = effect.law(t, session, **values)
    return t


def _asked(
    settings, dead_zone: Array, t: Array, session: Array, command: Array, part: Array, acts: Acts | None
) -> Push:
    """Pushes of each row from every static law, on a time axis that starts when the row arrives; substeps are `part`
    long there."""
    sent = Wheels(command[..., 0], command[..., 1])
    for effect, values in acting("command", settings):
        sent = effect.law(sent, **values)
    slews = []
    for effect, values in acting("slew", settings):
        run = functools.partial(_slewed, effect, values, step=part * SUBSTEPS)
        slews.append((effect, values, _unless_idle([effect], acts, run, sent)))

    def at(elapsed):
        """The pushes `elapsed` [s] (rows, runs) after each row."""
        u = sent
        for effect, values, before in slews:
            u = effect.law(before, u, elapsed, **values)
        return jnp.stack(static_push(settings, dead_zone, u, session + t + elapsed), axis=-1)

    means, slopes = [], []
    for number in range(SUBSTEPS):
        early, late = (at((number + node) * part) for node in NODES)
        means.append(0.5 * (early + late))
        slopes.append(6.0 * (NODES[1] - 0.5) * (late - early))
    return Push(jnp.stack(means, axis=2), jnp.stack(slopes, axis=2))


def _expected(asked: Push, lost: Array) -> tuple[Push, Array]:
    """Mean pushes where each command is lost with a probability p, and the one before stays in force: (1 - p) m + p of
    the row before's; and the deviation (rows, runs, 2) of a jolt in that row that lasts as uncertain a time. A change
    comes j rows late, j geometric: p / (1 - p) on average, with the deviation sqrt(p) / (1 - p)."""

    def body(last, now):
        mean, slope = now
        arrived = (1.0 - lost) * mean + lost * last
        return arrived[:, -1:], (arrived, (1.0 - lost) * slope, mean[:, 0] - last[:, 0])

    begin = jnp.zeros_like(asked.mean[0, :, :1])
    _, (mean, slope, change) = jax.lax.scan(body, begin, asked)
    return Push(mean, slope), change * jnp.sqrt(lost) / (1.0 - lost)


def _slewed(effect: EffectRecord, values, sent: Wheels, step: Array) -> Wheels:
    """The command (rows, runs) that a slew has reached at each row."""

    def body(now, row):
        goal, own = row
        return effect.law(now, goal, own, **values), now

    still = Wheels(*(jnp.zeros_like(u[0]) for u in sent))
    return jax.lax.scan(body, still, (sent, step))[1]


def _read(asked: Push, arrived: Array, own: Array, t: Array, part: Array) -> Push:
    """Pushes that were asked for on the time axis of arrivals (rows, runs), substeps `own` long, as means and slopes
    over the substeps `part` of the rows themselves; nothing is asked for before the first row arrives."""
    mean, slope = _in_line(asked)
    given, size = (_flat(jnp.broadcast_to(each[:, :, None], asked.mean.shape[:3])) for each in (own, part))
    nodes, starts = t[:1] + _integral(size), arrived[:1] + _integral(given)[:-1]
    given, size = given[..., None], size[..., None]
    first = _integral(given * mean)
    # exact for a push that varies within a substep
    second = _integral(given * first[:-1] + given**2 * (0.5 * mean - slope / 12.0))
    early = nodes - JUST_BEFORE * part[0]
    place = jax.vmap(lambda a, v: jnp.searchsorted(a, v, side="right") - 1, in_axes=1, out_axes=1)(starts, early)
    known = jnp.concatenate([first[:-1], second[:-1], mean, slope, starts[..., None], given], axis=-1)
    found = jnp.take_along_axis(known, jnp.maximum(place, 0)[..., None], axis=0)
    elapsed = early[..., None] - found[..., 8:9]
    s = safe_divide(elapsed, found[..., 9:], 0.0)
    once = found[..., 0:2] + elapsed * (found[..., 4:6] + found[..., 6:8] * 0.5 * (s - 1.0))
    twice = (
        found[..., 2:4] + elapsed * found[..., 0:2]
        + elapsed**2 * (0.5 * found[..., 4:6] + found[..., 6:8] * (s / 6.0 - 0.25))
    )  # fmt: skip
    inside = (place >= 0)[..., None]
    once, twice = jnp.where(inside, once, 0.0), jnp.where(inside, twice, 0.0)
    mean = jnp.diff(once, axis=0) / size
    slope = 12.0 * (0.5 * (once[1:] + once[:-1]) - jnp.diff(twice, axis=0) / size) / size
    return Push(mean, slope)


def _in_line(asked: Push) -> Push:
    """Pushes (rows, runs, substeps, 2) as (rows * substeps, runs, 2)."""
    return Push(*map(_flat, asked))


def _flat(values: Array) -> Array:
    """(rows, runs, substeps, ...) to (rows * substeps, runs, ...)."""
    return jnp.moveaxis(values, 2, 1).reshape(-1, values.shape[1], *values.shape[3:])


def _integral(pieces: Array) -> Array:
    """Sums (points + 1, ...) of pieces (points, ...) before each point."""
    return jnp.concatenate([jnp.zeros_like(pieces[:1]), jnp.cumsum(pieces, axis=0)])


def _remembered(settings, drive: Physical, asked: Push, part: Array, acts: Acts | None) -> Push:
    """Pushes (rows * substeps, runs, 2) behind the gears, as (rows, runs, substeps, 2)."""
    rows, runs = part.shape
    size = jnp.repeat(part, SUBSTEPS, axis=0)[..., None]
    for effect, values in acting("gear", settings):
        law = functools.partial(scanned, effect) if effect.fast is None else effect.fast
        run = functools.partial(_passed, law, drive, size, values)
        asked = _unless_idle([effect], acts, run, asked)
    return Push(*(x.reshape(rows, SUBSTEPS, runs, 2).transpose(0, 2, 1, 3) for x in asked))


def _passed(law: Callable[..., Push], drive: Physical, size: Array, values, asked: Push) -> Push:
    return law(asked, drive, size, **values)


def scanned(effect: EffectRecord, asked: Push, drive: Physical, size: Array, **values) -> Push:
    """An effect of stage `gear` over whole runs (points, runs, 2) by its law of one substep; speeds of the wheels are
    those of the nominal drive at the start of each."""

    def body(carry, now):
        memory, v, w = carry
        mean, slope, step = now
        step = step[:, 0]
        own = Substep(step, lambda _: wheel_speeds(drive, v, w))
        passed, memory = effect.act(Push(Wheels(*mean.T), Wheels(*slope.T)), memory, own, **values)
        pull = force(drive, passed.mean)
        steady_v = (pull.along + drive.coupling[0] * w) / drive.rate[0]
        steady_w = (pull.heading + drive.coupling[1] * v) / drive.rate[1]
        v = steady_v + (v - steady_v) * jnp.exp(-drive.rate[0] * step)
        w = steady_w + (w - steady_w) * jnp.exp(-drive.rate[1] * step)
        return (memory, v, w), [jnp.stack(part, axis=-1) for part in passed]

    still = jnp.zeros_like(asked.mean[0, :, 0])
    return Push(*jax.lax.scan(body, (remembered_at_rest(effect, still), still, still), (*asked, size))[1])

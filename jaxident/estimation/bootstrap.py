"""Intervals that do not take the noise law on trust: refits to resampled residuals, or to resampled runs.

Every replicate is fitted in full, from the estimate on. `bootstrap` tells the two ways of resampling.
"""

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array
from jaxident.errors import InputError, WorkError
from jaxident.estimation.identify import D_MAX_SHARE, Identification
from jaxident.estimation.poses.curvature import Point
from jaxident.estimation.poses.likelihood import innovations
from jaxident.estimation.poses.maximum_likelihood import MOST_STEPS
from jaxident.estimation.poses.parameters import Law, Robot, from_vector, names, to_vector
from jaxident.estimation.poses.prior import Prior
from jaxident.estimation.poses.runs import Runs, run_axes, stack_runs, with_wheels
from jaxident.estimation.poses.scoring import search_from
from jaxident.estimation.uncertainty.blocks import block_length, draw_blocks, long_run_variance
from jaxident.estimation.uncertainty.precision import law_of, natural_values
from jaxident.estimation.uncertainty.replicate import replicate_run
from jaxident.log import Log, join
from jaxident.numerics import require_float64, safe_divide

RESAMPLES = ("blocks", "runs")
SMALLEST_COUNT = 40
"""Replicates that tell a standard deviation to 11 %."""
FEWEST_RUNS = 5
PILOTS = 40
"""Refits that tell by how much innovations are smaller than errors."""
LARGEST_FACTOR = 4.0
AT_ONCE = 8
"""Replicates fitted side by side."""
NORMAL_HALF = 1.96


class Bootstrap(NamedTuple):
    """Refits to resampled data.

    Attributes:
        order: names of the unknowns.
        replicates: (count, unknowns) in natural units.
        ok: (count,), whether each refit arrived.
        covariance: (unknowns, unknowns), from those that arrived.
        interval: (unknowns, 2), 95 %, likewise.
        resample: "blocks" or "runs".
        block: rows in a block, None for whole runs.
    """

    order: tuple[str, ...]
    replicates: Any
    ok: Any
    covariance: Any
    interval: Any
    resample: str
    block: int | None


def bootstrap(
    key: Array,
    found: Identification,
    logs: Log | Sequence[Log],
    *,
    count: int = 200,
    resample: str = "blocks",
    block: int | None = None,
    d_max: float | None = None,
) -> Bootstrap:
    """Refit a maximum-likelihood model to resampled data, for intervals that do not take the noise law on trust.

    Blocks of innovations, all three channels together, become poses by the fitted robot. They keep what neighbours
    within a block share, for any input and a single run. They are blind to what lasts longer than a block, and to
    errors that come with certain commands. Whole runs drawn with replacement keep all that runs hold, misfits of the
    model included; that needs many. After Kuensch (1989) and Cameron, Gelbach and Miller (2008). Needs double
    precision.

    Args:
        key: of the random draws.
        found: the fit, by `identify`.
        logs: the logs that it was fitted to.
        count: number of replicates, at least 40.
        resample: "blocks" of innovations, or whole "runs" (at least five).
        block: rows in a block, by default from the correlation of the innovations (`block_length`).
        d_max: the bound of the dead zones as given to `identify` [unit of the command].

    Returns:
        Bootstrap: the replicates, whether each arrived, their covariance and 95 % intervals.

    Raises:
        InputError: another method than the maximum likelihood, too few replicates or runs, a block that no run holds.
        WorkError: fewer than half of the refits arrive.

    Examples:
        >>> import dataclasses, jax, jaxident as ji
        >>> ji.start_jax()
        >>> robot = dataclasses.replace(ji.load_model("published"), noise=ji.Noise(position=5e-4, heading=5e-3))
        >>> inputs = ji.excite(jax.random.key(0), "multilevel", 300, robot.sample_period)
        >>> log = ji.simulate(robot, inputs, key=jax.random.key(1))
        >>> found = ji.identify(log, noise_law="white")
        >>> refits = ji.bootstrap(jax.random.key(2), found, log, count=40)
        >>> refits.order[0], refits.interval.shape
        ('rate_1', (10, 2))
    """
    require_float64("bootstrap")
    if found.fit is None:
        raise InputError("bootstrap: a property of maximum likelihood; other methods have none")
    if count < SMALLEST_COUNT:
        raise InputError(f"bootstrap: {count} replicates; a standard deviation needs at least {SMALLEST_COUNT}")
    log = join(logs)
    largest = float(np.nanmax(np.abs(np.stack(log.command))))
    runs = _runs_of(log, found.fit.robot, resample)
    law = law_of(found.fit.robot.drive, found.fit.robot.noise, runs.wheels is not None)
    fitted = found.fit.robot, found.fit.starts, found.fit.innovations.normalised
    _check(resample, runs, block)
    if resample == "blocks":
        block = block or block_length(np.asarray(fitted[2]), np.asarray(runs.seen))
    arrays = jax.tree.map(
        jnp.asarray, (*fitted, runs, D_MAX_SHARE * largest if d_max is None else d_max, found.fit.prior)
    )
    robot, begins, innovation, runs, limit, prior = arrays
    keys = jax.random.split(key, count)
    if block is not None:
        innovation = innovation * enlargement(keys[:PILOTS], robot, begins, innovation, runs, limit, law, block, prior)
    values, ok, _ = refit(keys, robot, begins, innovation, runs, limit, law, block, prior)
    estimate = np.asarray(natural_values(robot, law))
    return summarise(estimate, np.asarray(values), np.asarray(ok), names(law), resample, block)


def _runs_of(log: Log, robot: Robot, resample: str) -> Runs:
    """The runs of a log with the sensors that a fit has used."""
    if robot.wheels is None:
        return stack_runs(log)
    if resample == "blocks":
        raise InputError("bootstrap: blocks of residuals are drawn of poses alone; with wheel speeds draw whole 'runs'")
    return with_wheels(stack_runs(log), log)


def _check(resample: str, runs: Runs, block: int | None) -> None:
    longest = int(np.max(np.sum(runs.seen, axis=1)))
    if resample not in RESAMPLES:
        raise InputError(f"resample {resample!r}: choose from {', '.join(RESAMPLES)}")
    if resample == "runs" and block is not None:
        raise InputError("block: a setting of 'blocks'; 'runs' draws runs whole")
    if resample == "runs" and len(runs.seen) < FEWEST_RUNS:
        raise InputError(f"resample 'runs': {len(runs.seen)} runs; it needs at least {FEWEST_RUNS}, better 20")
    if block is not None and not 1 <= block <= longest:
        raise InputError(f"block {block}: should be at least 1 and at most the longest run's {longest} poses")


def summarise(
    estimate: np.ndarray, values: np.ndarray, ok: np.ndarray, order: tuple[str, ...], resample: str, block: int | None
) -> Bootstrap:
    """A `Bootstrap` from the estimate (unknowns,) and replicates (count, unknowns), those that are ok.

    Intervals are the estimate and 1.96 standard deviations of the replicates either way: under AR(1) noise taken for
    white they covered 93.8 %, percentiles 92.4 % (100 robots, 100 replicates).
    """
    if np.sum(ok) < max(0.5 * len(ok), 2):
        raise WorkError(f"bootstrap: only {np.sum(ok)} of {len(ok)} refits arrived")
    covariance = np.cov(values[ok], rowvar=False)
    half = NORMAL_HALF * np.sqrt(np.diagonal(covariance))
    interval = np.stack([estimate - half, estimate + half], axis=1)
    return Bootstrap(order, values, ok, covariance, interval, resample, block)


def describe(found: Bootstrap) -> str:
    """What the intervals rest on, in a sentence."""
    what = f"blocks of {found.block} residuals" if found.resample == "blocks" else "whole runs"
    return (
        f"Bootstrap: {int(np.sum(found.ok))} of {len(found.ok)} refits to resampled {what}. Much wider than the "
        "likelihood's own, its intervals say that the noise law is not that of the residuals."
    )


def enlargement(
    keys: Array,
    robot: Robot,
    starts: Array,
    normalised: Array,
    runs: Runs,
    d_max: Array,
    law: Law,
    block: Array,
    prior: Prior,
) -> Array:
    """By what to multiply innovations (runs, 3, rows) so that they have the long-run variance of the errors: (3, 1).

    A fit takes out of its innovations some of what is slow in the errors, and blocks cut what is longer. Refits to
    resampled innovations take out the same share once more, which tells how much it was (bootstrap estimate of bias,
    Efron and Tibshirani 1993, ch. 10).
    """
    before = long_run_variance(normalised, runs.seen, block)
    _, ok, after = refit(keys, robot, starts, normalised, runs, d_max, law, block, prior)
    mean = jnp.sum(jnp.where(ok[:, None], after, 0.0), axis=0) / jnp.maximum(jnp.sum(ok), 1)
    return jnp.sqrt(jnp.clip(safe_divide(before, mean, 1.0), 1.0, LARGEST_FACTOR))[:, None]


@partial(jax.jit, static_argnames="law")
def refit(
    keys: Array,
    robot: Robot,
    starts: Array,
    normalised: Array,
    runs: Runs,
    d_max: Array,
    law: Law,
    block: Array | None,
    prior: Prior,
) -> tuple[Array, Array, Array]:
    """Replicates (keys, unknowns) in natural units, whether each arrived, and the long-run variances (keys, 3) that are
    left in their own innovations: from blocks of some rows, or of whole runs (block None, no variances). Pure."""
    point = Point(to_vector(robot, law), starts)

    def one(key: Array) -> tuple[Array, Array, Array]:
        own, begin = _resampled(key, robot, point, normalised, runs, block)
        end = search_from(begin, own, law, d_max, MOST_STEPS, prior)
        values = natural_values(from_vector(end.point.shared, law), law)
        left = jnp.zeros(3)
        if block is not None:
            over = jax.vmap(lambda start, run: innovations(end.point.shared, start, run, law), (0, run_axes(own)))
            left = long_run_variance(over(end.point.starts, own).normalised, runs.seen, block)
        return values, end.arrived & jnp.all(jnp.isfinite(values)), left

    return jax.lax.map(one, keys, batch_size=AT_ONCE)


def _resampled(
    key: Array, robot: Robot, point: Point, normalised: Array, runs: Runs, block: Array | None
) -> tuple[Runs, Point]:
    """Resampled runs, and the point that a search of them begins at."""
    if block is None:
        drawn = jax.random.randint(key, (len(point.starts),), 0, len(point.starts))
        own = jax.tree.map(lambda leaf: leaf if jnp.ndim(leaf) == 0 else leaf[drawn], runs)
        return own, point._replace(starts=point.starts[drawn])
    fresh = draw_blocks(key, normalised, runs.seen, block)
    over = jax.vmap(replicate_run, in_axes=(None, 0, run_axes(runs), 0))
    return runs._replace(pose=over(robot, point.starts, runs, fresh)), point

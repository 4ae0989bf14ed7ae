"""What is known of a robot before its log is read: weak priors in physical units.

Rates [1/s] are absolute: robots from 5 cm to 5 m answer within 0.03 to 3 s. They are log-normal, 95 % in 0.3 to 30.
All else is measured by the log's own speed S and largest command U: a toy is slower than a truck, and the command's
unit is the user's. S [m/s] is the larger of the speed along and the turn rate at HALF_TRACK; it covers both channels.
The steady speed per command, gain over rate, is normal about SPEED S / U with that same deviation, its sign that of a
differential drive: + + along and + - in heading. Dead zones are normal about DEAD_ZONE U, deviation DEAD_ZONE_SPREAD U.
Coupling is zero with the deviation that makes one speed of size S change the other by S at the middle rate. Radius and
track of measured wheels are log-normal, absolute.

The likelihood's search adds half the squared departures to -log p. They are a few units over the whole range, where
the poses of an informative log speak in thousands.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array, Column, Gains, Pose, Rows, Square, Unknowns, UnknownsMatrix, Wheels
from jaxident.estimation.poses.parameters import Law, is_logarithmic, names
from jaxident.estimation.poses.runs import Runs, row_times, rows_used
from jaxident.numerics import safe_divide, sin_cos, wrap
from jaxident.programs import kept_program
from jaxident.robot.drive import TYPICAL_RATE

RATE, RATE_SPREAD = TYPICAL_RATE, 1.175
"""Middle of the rates [1/s], and the deviation of their logarithm."""
SLOWEST_ROBOT = float(RATE * np.exp(-1.96 * RATE_SPREAD))
"""The rate [1/s] below which one robot in forty answers."""
SPEED = 1.5
"""Steady speed at the largest command of one wheel, over S."""
HALF_TRACK = 0.25
"""Distance [m] by which a turn rate is taken as a speed. A smaller robot turns fast, which raises S for it. A larger
one has a smaller gain in heading than the prior's middle, by less than the deviation."""
SIGNS = ((1.0, 1.0), (1.0, -1.0))
"""Of the gains of a differential drive."""
DEAD_ZONE, DEAD_ZONE_SPREAD = 0.15, 0.3
WHEEL, WHEEL_SPREAD = (0.1, 0.5), 1.0
"""Middle of radius and track [m] of a robot that measures its wheels, and the deviation of their logarithms: 95 % have
wheels of 1.4 to 70 cm, 7 cm to 3.5 m apart."""
LAG_SHARE, LONGEST_LAG = 10, 25
"""Rows over which speeds are taken: a tenth of a run, 25 at most. Over one row the camera's error would rule."""
FIRMLY = 1e4
"""Weight on the departure of a rate that is held at the prior's middle."""
MOSTLY = 0.5
"""A number is called the prior's from this share of its variance on. A number that depends on no other then has more
than 0.7 of the prior's deviation."""
FLAT = 1e-13
"""Floor of the curvature, relative to its largest, all unknowns scaled alike."""


class Prior(NamedTuple):
    """speed [m/s] and command [unit]: S and U. held (2,): whether a rate stays at RATE. weight: 1, or 0 for none."""

    speed: Any
    command: Any
    held: Any
    weight: Any


def coasting(rate: Array, seconds: float, driven: Array, doubted: bool) -> np.ndarray:
    """Which speeds (2,) coast: at a rate [1/s] below nearly all robots', too slow to settle within the longest stretch
    with a start speed of its own [s], and either in a model that is doubted anyway, or not clearly driven (2,)."""
    return (rate < SLOWEST_ROBOT) & (rate * seconds < 1.0) & (doubted | ~driven)


@kept_program(Prior, Runs, Wheels, Pose)
def prior_of(runs: Runs) -> Prior:
    """The prior for runs (runs, rows); pure, maps over trials."""
    largest = jnp.maximum(jnp.max(jnp.abs(jnp.stack(runs.command))), 1e-12)
    along, turning = speeds(runs)
    speed = jnp.maximum(jnp.maximum(along, HALF_TRACK * turning), 1e-9)
    return Prior(speed, largest, jnp.zeros(2, bool), jnp.asarray(1.0))


def no_prior() -> Prior:
    """A prior that says nothing: the poses alone."""
    return Prior(jnp.asarray(1.0), jnp.asarray(1.0), jnp.zeros(2, bool), jnp.asarray(0.0))


def speeds(runs: Runs) -> tuple[Array, Array]:
    """Root-mean-square speed along [m/s] and in heading [rad/s] of runs (runs, rows), from poses some rows apart."""
    lag = jnp.clip(rows_used(runs) // LAG_SHARE, 1, LONGEST_LAG)
    rows = jnp.arange(runs.seen.shape[1])
    before, usable = jnp.maximum(rows - lag, 0), runs.seen & (rows >= lag)
    step = jnp.broadcast_to(runs.step, runs.seen.shape)
    path, heading, time = jax.vmap(_travelled)(runs._replace(step=step))
    passed = time - time[:, before]

    def size(way: Array) -> Array:
        squares = safe_divide(way - way[:, before], passed, 0.0) ** 2
        mean = jnp.sum(jnp.where(usable, squares, 0.0)) / jnp.maximum(jnp.sum(usable), 1)
        return jnp.sqrt(jnp.maximum(mean, 1e-24))

    return size(path), size(heading)


def _travelled(run: Runs) -> tuple[Rows, Rows, Rows]:
    """Signed path [m], heading [rad] and time [s] (rows,) of one run up to the last pose seen at each row."""
    rows = jnp.arange(run.seen.shape[0])
    now = jax.lax.cummax(jnp.where(run.seen, rows, -1))
    first = jnp.argmax(run.seen)
    now = jnp.where(now < 0, first, now)
    before = jnp.concatenate([now[:1], now[:-1]])
    x, y, theta = (column[now] - column[before] for column in run.pose)
    turn = wrap(theta)
    sine, cosine = sin_cos(run.pose.theta[before] + 0.5 * turn)
    return jnp.cumsum(x * cosine + y * sine), jnp.cumsum(turn), row_times(run)[now]


def middle_gain(prior: Prior) -> Gains:
    """Gains (2, 2) at the prior's middle."""
    return RATE * _steady_speeds(prior)


def _steady_speeds(prior: Prior) -> Gains:
    """Steady speeds per command (2, 2) at the prior's middle [m/s, rad/s per unit]."""
    return SPEED * prior.speed / prior.command * jnp.array(SIGNS) / jnp.array([[1.0], [HALF_TRACK]])


def departures(shared: Unknowns, law: Law, prior: Prior) -> Array:
    """How far a vector (unknowns,) of shared unknowns departs from the prior, in its deviations, one after the other:
    two rates, four steady speeds, two dead zones, and two couplings, radius and track where the law has them."""
    firmness = jnp.where(prior.held, FIRMLY, 1.0)
    rates = firmness * (shared[:2] - jnp.log(RATE)) / RATE_SPREAD
    steady = shared[2:6].reshape(2, 2) * jnp.exp(-shared[:2])[:, None]
    gains = (steady / _steady_speeds(prior) - 1.0).ravel()
    dead_zones = (shared[6:8] / prior.command - DEAD_ZONE) / DEAD_ZONE_SPREAD
    couplings = shared[8:10] / (RATE * jnp.array([HALF_TRACK, 1.0 / HALF_TRACK])) if law.coupling else jnp.zeros(0)
    parts = [rates, gains, dead_zones, couplings]
    if law.wheels:
        first = names(law).index("wheel_radius")
        parts.append((shared[first : first + 2] - jnp.log(jnp.array(WHEEL))) / WHEEL_SPREAD)
    return prior.weight * jnp.concatenate(parts)


def prior_terms(shared: Unknowns, law: Law, prior: Prior) -> tuple[Array, Unknowns, UnknownsMatrix]:
    """Half the squared departures, their gradient (unknowns,) and curvature (unknowns, unknowns) without second
    derivatives."""

    def both(shared):
        found = departures(shared, law, prior)
        return found, found

    slope, found = jax.jacfwd(both, has_aux=True)(shared)
    return 0.5 * jnp.sum(found**2), slope.T @ found, slope.T @ slope


def posterior(data: UnknownsMatrix, shared: Unknowns, law: Law, prior: Prior) -> tuple[UnknownsMatrix, Unknowns]:
    """Covariance (unknowns, unknowns) in natural units from the data's curvature of the shared unknowns, start states
    eliminated, and the prior's; and the share (unknowns,) of each variance that is the prior's.

    With data D, prior P and C = 1 / (D + P), C = C D C + C P C; the share is that of the second. A held rate keeps the
    prior's variance: what the data say of it is struck out.
    """
    _, _, own = prior_terms(shared, law, prior._replace(held=jnp.zeros(2, bool)))
    held = jnp.zeros(len(shared)).at[:2].set(jnp.where(prior.held, 1.0, 0.0))
    whole = _strike(data + own, held)
    scale = jnp.sqrt(jnp.maximum(jnp.diagonal(whole), 1e-300))
    values, vectors = jnp.linalg.eigh(whole / scale[:, None] / scale)
    values = jnp.maximum(values, FLAT * jnp.maximum(values[-1], FLAT))
    rows = vectors / jnp.sqrt(values) / scale[:, None]
    covariance = rows @ rows.T
    share = jnp.einsum("ij,jk,ki->i", covariance, own, covariance) / jnp.diagonal(covariance)
    natural = jnp.where(is_logarithmic(law), jnp.exp(shared), 1.0)
    return natural[:, None] * covariance * natural, jnp.clip(share, 0.0, 1.0)


def _strike(whole: Square, held: Column) -> Square:
    """A curvature (n, n) in which held unknowns (n,), 1 or 0, know no more than the prior once all others are free."""
    free = 1.0 - held
    others = whole * free[:, None] * free + jnp.diag(held)
    across = whole * free[:, None] * held
    kept = across.T @ jnp.linalg.solve(others, across) + jnp.diag(held / RATE_SPREAD**2)
    return whole * (1.0 - held[:, None] * held) + kept


def from_prior(share: Unknowns, law: Law) -> tuple[str, ...]:
    """The names of the robot's parameters that come mostly from the prior."""
    robot = ("rate", "gain", "dead", "coupling", "wheel")
    shares = zip(names(law), share, strict=True)
    return tuple(name for name, own in shares if own > MOSTLY and name.split("_")[0] in robot)

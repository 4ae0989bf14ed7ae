"""The filtered state of a robot with or without effects, and its free run from there: the one way to predict.

An extended Kalman filter (Jazwinski 1970, section 8.3) over the rows before the start, in the coordinates of
`effects.coordinates`. What the input remembers (delay, slew, play, lag) follows from the commands alone and is run up
from rest; pose, speeds, random slip and a camera error with a memory are filtered. Derivatives by differences of the
fast integrator serve effects with corners as well. Stretches lie on the last axis.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, State, Wheels
from jaxident.effects.coordinates import by_effect
from jaxident.effects.discovered import turned, with_laws
from jaxident.effects.fast_input import SUBSTEPS, expected_pushes
from jaxident.effects.fast_motion import Rolling, Row, advance_row, drive_of, lags_of, rolling
from jaxident.effects.law_arrays import Laws
from jaxident.estimation.ahead.camera_pose import missed_by, seen_by, shown_as
from jaxident.estimation.ahead.stretches import Stretch
from jaxident.robot.drive import force
from jaxident.robot.noise import Noise

STEPS = (1e-6, 1e-5, 1e-4, 1e-4, 1e-3)
"""Steps of the differences: heading [rad], v [m/s], w [rad/s], slip along [m/s^2] and in heading [rad/s^2]."""
WIDE = (0.1, 0.1, 0.3, 1.0, 10.0)
"""Deviations of the state about its first guess [m, m, rad, m/s, rad/s], before its first pose is taken in."""
LIMIT, DOUBT = 5.0, 2.0
"""Standard deviations beyond which a pose is not taken in, an outlier among the last of which must not throw the start;
and what the covariance is multiplied with instead: where poses go on to disagree, it is the state that is wrong."""


class Run(NamedTuple):
    """What the filter says of each row, then the free run: the pose that the camera would report (rows, 3, n), the
    covariance (rows, 3, 3, n) of its error by what is not known at the start row, and by the slip since; squared
    normalised innovations (rows, n), none beyond LIMIT, summed over the three channels; angles (rows, laws, n) of the
    wheels that laws go by, None without laws."""

    pose: Any
    start: Any
    slip: Any
    innovation: Any
    angles: Any


class _Belief(NamedTuple):
    """Mean (states, n), the two parts of the covariance (states, states, n), and how the wheels roll."""

    mean: Any
    start: Any
    slip: Any
    wheels: Rolling


def filter_and_run(
    vector: Array, laws: Laws | None, noise: Noise, lost: Array | None, stretch: Stretch, before: int
) -> Run:
    """The filter up to row `before`, that row's pose included, and the free run after it; pure.

    vector (SIZE,): coordinates for the commands as they stand in the stretch, and so are the discovered laws; their
    phase (laws, n) is that where the filter begins. lost: the probability that a command never arrives, None without.
    States are x, y, theta, v, w; then slip along and in heading where `noise.slip_time` is given, and the camera's
    errors where its `correlation_time` is.
    """
    settings, drive = with_laws(by_effect(vector), laws), drive_of(vector)
    t = stretch.t
    step = jnp.diff(t, axis=0, append=2.0 * t[-1:] - t[-2:-1])
    push, jolt = expected_pushes(settings, drive, vector[6:8], t, stretch.session, stretch.command, lost)
    part = step / SUBSTEPS
    mean, slope = (leaf.transpose(0, 2, 3, 1) for leaf in push)
    jolt = None if jolt is None else jnp.stack(force(drive, Wheels(*jnp.moveaxis(jolt, 2, 0))), axis=1)
    past = None if laws is None else stretch.past
    rows = Row(mean, slope, part, lags_of(drive, part), stretch.session + t, past)
    number = jnp.arange(len(t))
    size = 5 + 2 * (noise.slip_time is not None) + 3 * (noise.correlation_time is not None)
    none = jnp.zeros((size, t.shape[1]))
    nothing, wide = jnp.zeros((size, *none.shape)), _wide(noise)
    phase: Array | None = None
    sure: Array = 1.0
    if laws is not None:
        phase, sure = (jnp.broadcast_to(part, (len(part), t.shape[1])) for part in (laws.phase, laws.sure))
    begin = _Belief(none, nothing, nothing, rolling(none[0], phase, sure))
    opening = shown_as(settings, stretch.pose[stretch.first, jnp.arange(t.shape[1])].T)

    def body(belief, now):
        k, row, own, pose, seen, jolt = now
        belief = belief._replace(start=jnp.where(k == stretch.begin, wide, belief.start))
        belief = _opened(wide, belief, opening, stretch.speeds, phase, k == stretch.first)
        guess = belief.mean
        belief, innovation = _take_in(settings, noise, belief, pose, seen & (k >= stretch.first) & (k <= before))
        belief = _turned(settings, belief, guess)
        shown, camera = seen_by(settings, belief.mean)
        told, angles = [_between(camera, part[:3, :3]) for part in (belief.start, belief.slip)], belief.wheels.angles
        belief = _one_row_on(settings, drive, noise, belief, row, own, jolt, k >= before)
        return belief, (shown, *told, innovation, angles)

    return Run(*jax.lax.scan(body, begin, (number, rows, step, stretch.pose, stretch.seen, jolt))[1])


def _wide(noise: Noise) -> Array:
    """Covariance (states, states, 1) of a state of which next to nothing is known."""
    variances = [*(deviation**2 for deviation in WIDE), *_stationary(noise)]
    return jnp.diag(jnp.stack([jnp.asarray(value, float) for value in variances]))[..., None]


def _turned(settings, belief: _Belief, guess: Array) -> _Belief:
    """The belief whose wheels have turned as far as a pose moved it on from a guess (states, n)."""
    dx, dy, turn = belief.mean[:3] - guess[:3]
    way = dx * jnp.cos(belief.mean[2]) + dy * jnp.sin(belief.mean[2])
    wheels = belief.wheels
    return belief._replace(wheels=wheels._replace(angles=turned(settings, wheels.angles, way, turn)))


def _opened(wide: Array, belief: _Belief, opening: Array, speeds: Array, phase: Array | None, here: Array) -> _Belief:
    """Where the filter begins: at the pose (3, n) whose report is the first, hardly known; at some speeds, hardly known
    either, or at those of the run-up, as well as it knows them; wheels that laws go by at a phase (laws, n)."""
    mean, start, slip, wheels = belief
    guessed = jnp.isfinite(speeds).all(axis=0)
    v, w = (jnp.where(guessed, guess, own) for guess, own in zip(speeds, mean[3:5], strict=True))
    fresh = jnp.concatenate([opening, jnp.stack([v, w]), mean[5:]])
    kept = jnp.arange(len(mean)) >= jnp.where(guessed, 5, 3)[:, None]
    known = jnp.where((kept[:, :, None] & kept[:, None, :]).transpose(1, 2, 0), start, wide)
    wheels = wheels if phase is None else wheels._replace(angles=jnp.where(here, phase, wheels.angles))
    return _Belief(jnp.where(here, fresh, mean), jnp.where(here, known, start), jnp.where(here, 0.0, slip), wheels)


def _stationary(noise: Noise) -> list[Array]:
    """Variances of the slip and of the camera's errors in the long run, as far as they are states."""
    found: list[Array] = []
    if noise.slip_time is not None:
        found += [density**2 / (2.0 * noise.slip_time) for density in (noise.slip_along, noise.slip_heading)]
    if noise.correlation_time is not None:
        position, heading = (whole**2 - white**2 for whole, white in _camera(noise))
        found += [position, position, heading]
    return found


def _camera(noise: Noise) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Deviations of the whole camera error and of its white part, in position and in heading."""
    white = (0.0 if part is None else part for part in (noise.white_position, noise.white_heading))
    position, heading = zip((noise.position, noise.heading), white, strict=True)
    return position, heading


def _take_in(settings, noise: Noise, belief: _Belief, pose: Array, seen: Array) -> tuple[_Belief, Array]:
    """The belief after a pose (n, 3), one coordinate after the other, and the squares of its normalised innovations."""
    mean, covariance = belief.mean, belief.start
    memory = noise.correlation_time is not None
    shown, camera = seen_by(settings, mean)
    error = missed_by(pose.T, shown + (mean[-3:] if memory else 0.0))
    whole, total, far = mean, jnp.zeros_like(mean[0]), jnp.zeros_like(seen)
    for k, (sd, white) in enumerate((_camera(noise)[0], *_camera(noise))):
        weights = jnp.zeros_like(mean).at[:3].set(camera[k])
        weights = weights.at[k - 3].add(1.0) if memory else weights
        shared = jnp.sum(covariance * weights, axis=1)
        variance = jnp.sum(weights * shared, axis=0) + (white if memory else sd) ** 2
        left = error[k] - jnp.sum(weights * (mean - whole), axis=0)
        gain = shared / variance
        mean = mean + gain * left
        covariance = covariance - gain[:, None] * shared
        square = jnp.minimum(left**2 / variance, LIMIT**2)
        total, far = total + jnp.where(seen, square, 0.0), far | (square == LIMIT**2)
    # rounding makes the two halves differ, and each pose that is not taken in would double that
    covariance = 0.5 * (covariance + jnp.swapaxes(covariance, 0, 1))
    taken = seen & ~far
    mean, doubtful = jnp.where(taken, mean, belief.mean), jnp.where(seen, DOUBT, 1.0) * belief.start
    return belief._replace(mean=mean, start=jnp.where(taken, covariance, doubtful)), total


def _between(left: Array, middle: Array) -> Array:
    """left middle left' of matrices (3, 3, n)."""
    return _times(_times(left, middle), jnp.swapaxes(left, 0, 1))


def _times(left: Array, right: Array) -> Array:
    return jnp.sum(left[:, :, None] * right[None], axis=1)


def _one_row_on(settings, drive, noise: Noise, belief: _Belief, row: Row, step: Array, jolt, free: Array) -> _Belief:
    """The belief one row later; what is random in it counts as slip once the run is free. jolt (2, n): deviation of an
    acceleration by commands that may have been lost, None without."""
    mean, start, slip, wheels = belief
    moved, slopes, wheels = _moved(settings, drive, noise, mean, wheels, row)
    size = len(mean)
    change = jnp.zeros((size, size, mean.shape[1]))
    change = change.at[jnp.arange(2), jnp.arange(2)].set(1.0).at[:5, 2:5].set(slopes[:, :3])
    fresh = jnp.zeros_like(change)
    kept, entry = [], slopes[:, 3:]
    if noise.slip_time is None:
        pushed = [density**2 / step for density in (noise.slip_along, noise.slip_heading)]
        fresh = fresh.at[:5, :5].set(sum(p * entry[:, None, k] * entry[None, :, k] for k, p in enumerate(pushed)))
    else:
        change = change.at[:5, 5:7].set(entry)
        kept += [jnp.exp(-step / noise.slip_time)] * 2
    if noise.correlation_time is not None:
        kept += [jnp.exp(-step / noise.correlation_time)] * 3
    if jolt is not None:
        moved_by = jnp.sum(entry * jolt, axis=1)
        fresh = fresh.at[:5, :5].add(moved_by[:, None] * moved_by)
    for k, (share, variance) in enumerate(zip(kept, _stationary(noise), strict=True), start=5):
        change, fresh = change.at[k, k].set(share), fresh.at[k, k].set((1.0 - share**2) * variance)
    travelled = jnp.sum((moved[:2] - mean[:2]) ** 2, axis=0)
    start_bend = _bend(start, step, travelled)
    mean = jnp.concatenate([moved, *(share[None] * mean[k : k + 1] for k, share in enumerate(kept, start=5))])
    start, slip = (_times(_times(change, part), jnp.swapaxes(change, 0, 1)) for part in (start, slip))
    start = start.at[jnp.arange(2), jnp.arange(2)].add(start_bend)
    return _Belief(mean, start + jnp.where(free, 0.0, fresh), slip + jnp.where(free, fresh, 0.0), wheels)


def _bend(covariance: Array, step: Array, travelled: Array) -> Array:
    """Variance (n,) of x and of y by what a linearisation leaves out where heading and speed are uncertain together."""
    heading = covariance[2, 2] + 0.25 * step**2 * covariance[4, 4]
    return heading * step**2 * covariance[3, 3] + 0.5 * heading**2 * travelled


def _moved(settings, drive, noise: Noise, mean: Array, wheels: Rolling, row: Row):
    """The state (5, n) one row later, its derivatives (5, 5, n) by heading, v, w and a slip along and in heading, and
    how the wheels roll then."""
    x, y, theta, v, w = mean[:5]
    slip = mean[5:7] if noise.slip_time is not None else jnp.zeros_like(mean[:2])
    nudge = jnp.diag(jnp.array(STEPS)) @ jnp.eye(5, 6, 1)
    theta, v, w, *slip = (a + d[:, None] for a, d in zip((theta, v, w, *slip), nudge, strict=True))
    before = wheels
    if wheels.angles is not None:
        before = wheels._replace(angles=wheels.angles[:, None], sure=wheels.sure[:, None])
    lanes, after = advance_row(settings, drive, State(x, y, theta, v, w), before, row, slip)
    lanes = jnp.stack([jnp.broadcast_to(part, theta.shape) for part in lanes])
    slopes = (lanes[:, 1:] - lanes[:, :1]) / jnp.array(STEPS)[:, None]
    excess = [jnp.broadcast_to(one, theta.shape)[0] for one in after.excess]
    angles = None if after.angles is None else after.angles[:, 0]
    return lanes[:, 0], slopes, wheels._replace(excess=excess, angles=angles)

"""The extended Kalman filter on poses: innovations of a robot whose wheels slip at random.

States x, y, theta, v, w, and with camera error of a memory the three errors too; linearised about the filtered path
(Jazwinski 1970, section 8.3). Slip is an acceleration held over each step, of variance density^2 / step. The three
coordinates of a pose are taken in one after the other, which needs no matrix inverse.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, PerChannel, PoseRows, PoseVector, State, StateMatrix, StateVector
from jaxident.numerics import GAUSS_WEIGHTS, sin_cos, wrap
from jaxident.robot.drive import Force, Hold, Response
from jaxident.robot.noise import Noise


class Belief(NamedTuple):
    """Mean (states,) and covariance (states, states) of x, y, theta, v, w and, with memory, the camera's errors."""

    mean: Any
    covariance: Any


def filter_run(solution: Hold, pull: Force, start: State, noise: Noise, run) -> tuple[PoseRows, PoseRows]:
    """Normalised innovations and log variances (3, rows) of one run (rows,), the start state taken as known.

    `solution` is that of one step, or of each (rows - 1,); `pull` (rows,).
    """
    _, (normalised, log_variance) = scan_filter(solution, pull, first_belief(start, noise), noise, run)
    return normalised.T, log_variance.T


def first_belief(start: State, noise: Noise) -> Belief:
    """A known start state, and camera errors as they are in the long run."""
    if noise.correlation_time is None:
        return Belief(jnp.stack(start), jnp.zeros((5, 5)))
    zeros = jnp.zeros(5)
    variance = jnp.stack([noise.position, noise.position, noise.heading]) ** 2
    return Belief(jnp.concatenate([jnp.stack(start), zeros[:3]]), jnp.diag(jnp.concatenate([zeros, variance])))


def scan_filter(solution: Hold, pull: Force, belief: Belief, noise: Noise, run):
    """The filter over all rows: the belief after the last pose, and innovations of every row (rows, 3)."""
    weights = step_weights(solution)
    even = jnp.ndim(solution.step) == 0
    poses = jnp.stack(run.pose, axis=-1)
    pulls = jnp.stack(pull, axis=-1)[:-1]  # a last command acts on nothing any more, and may be missing

    def body(belief, now):
        pull, own, pose, seen = now
        belief, found = take_in(belief, pose, seen, noise)
        return predict_belief(belief, pull, weights if even else own, noise), found

    belief, found = jax.lax.scan(body, belief, (pulls, None if even else weights, poses[:-1], run.seen[:-1]))
    belief, last = take_in(belief, poses[-1], run.seen[-1], noise)
    return belief, jax.tree.map(lambda rows, row: jnp.concatenate([rows, row[None]]), found, last)


class StepWeights(NamedTuple):
    """A `Hold` as matrices over (v, w, along, heading): speed and turn at the nodes (nodes, 4), turn, v and w at the
    end (3, 4); step [s]. All with leading axis (rows - 1,) for uneven steps."""

    step: Any
    node_v: Any
    node_turn: Any
    end: Any


def step_weights(solution: Hold) -> StepWeights:
    """The exact solution over a step as matrices."""

    def rows(responses: tuple[Response, ...]) -> Array:
        zero = jnp.zeros_like(solution.step)
        return jnp.stack([jnp.stack([zero if r is None else r for r in one], -1) for one in responses], -2)

    end = rows((solution.turn, solution.v, solution.w))
    return StepWeights(solution.step, rows(solution.node_v), rows(solution.node_turn), end)


def take_in(
    belief: Belief, pose: PoseVector, seen: Array, noise: Noise, limit: float | None = None
) -> tuple[Belief, tuple[PoseVector, PoseVector]]:
    """The belief after a pose (3,), and its normalised innovations and log variances (3,); 0 where unseen.

    limit: standard deviations beyond which an innovation counts no more than one of that size (Huber 1964).
    """
    mean, covariance = belief
    memory = noise.correlation_time is not None
    results = []
    for k, sd in enumerate((noise.position, noise.position, noise.heading)):
        shared = covariance[:, k] + covariance[:, 5 + k] if memory else covariance[:, k]
        variance = shared[k] + shared[5 + k] if memory else shared[k] + sd**2
        error = pose[k] - (mean[k] + mean[5 + k] if memory else mean[k])
        error = wrap(error) if k == 2 else error
        weight = jnp.where(seen, shared / variance, 0.0)
        size = jnp.sqrt(variance)
        mean = mean + weight * (error if limit is None else jnp.clip(error, -limit * size, limit * size))
        covariance = covariance - weight[:, None] * shared
        results.append((error / size, jnp.log(variance)))
    normalised, log_variance = (jnp.where(seen, jnp.stack(part), 0.0) for part in zip(*results, strict=True))
    return Belief(mean, covariance), (normalised, log_variance)


def predict_belief(belief: Belief, pull: PerChannel, weights: StepWeights, noise: Noise) -> Belief:
    """The belief one step later under accelerations (2,) along and in heading."""
    state, transition, entry = advance_with_slopes(belief.mean[:5], pull, weights)
    entry = entry * (jnp.stack([noise.slip_along, noise.slip_heading]) / jnp.sqrt(weights.step))
    if noise.correlation_time is None:
        left, fresh, mean = jnp.ones(0), jnp.ones(0), state
    else:
        left = jnp.full(3, jnp.exp(-weights.step / noise.correlation_time))
        fresh = (1.0 - left**2) * jnp.stack([noise.position, noise.position, noise.heading]) ** 2
        mean = jnp.concatenate([state, left * belief.mean[5:]])
    size = len(mean)
    whole = jnp.zeros((size, size)).at[:5, :5].set(transition)
    whole = whole + jnp.diag(jnp.concatenate([jnp.zeros(5), left]))
    entry = jnp.zeros((size, 2)).at[:5].set(entry)
    covariance = _multiply(_multiply(whole, belief.covariance), whole.T) + _multiply(entry, entry.T)
    return Belief(mean, covariance + jnp.diag(jnp.concatenate([jnp.zeros(5), fresh])))


def advance_with_slopes(
    state: StateVector, pull: PerChannel, weights: StepWeights
) -> tuple[StateVector, StateMatrix, Array]:
    """The state (5,) one step later, its derivatives by the state (5, 5), and by a held acceleration (5, 2)."""
    start = jnp.concatenate([state[3:], pull])
    gauss = weights.step * jnp.asarray(GAUSS_WEIGHTS)
    sine, cosine = sin_cos(state[2] + jnp.sum(weights.node_turn * start, axis=1))
    v = jnp.sum(weights.node_v * start, axis=1)
    moved = jnp.stack([jnp.sum(gauss * v * cosine), jnp.sum(gauss * v * sine)])
    sideways, forward = (gauss * v * sine)[:, None], (gauss * v * cosine)[:, None]
    along_x = jnp.sum((gauss * cosine)[:, None] * weights.node_v - sideways * weights.node_turn, axis=0)
    along_y = jnp.sum((gauss * sine)[:, None] * weights.node_v + forward * weights.node_turn, axis=0)
    by_speed = jnp.concatenate([jnp.stack([along_x, along_y]), weights.end])
    by_pose = jnp.eye(5, 3).at[0, 2].set(-moved[1]).at[1, 2].set(moved[0])
    end = jnp.sum(weights.end * start, axis=1)
    after = jnp.concatenate([state[:2] + moved, state[2:3] + end[:1], end[1:]])
    return after, jnp.concatenate([by_pose, by_speed[:, :2]], axis=1), by_speed[:, 2:]


def _multiply(left: Array, right: Array) -> Array:
    """left @ right of two matrices in plain arithmetic, which maps over trials."""
    return jnp.sum(left[:, :, None] * right[None, :, :], axis=1)

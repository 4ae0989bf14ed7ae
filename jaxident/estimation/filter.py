"""The extended Kalman filter on poses: innovations of a robot whose wheels slip at random.

States x, y, theta, v, w, and with camera error of a memory the three errors too; linearised about the filtered path
(Jazwinski 1970, section 8.3). Slip is an acceleration held over each step, of variance density^2 / step. The three
coordinates of a pose are taken in one after the other, which needs no matrix inverse.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, State
from jaxident.numerics import GAUSS_WEIGHTS, sin_cos, wrap
from jaxident.robot.drive import Force, Hold, Response, advance
from jaxident.robot.noise import Noise


class Belief(NamedTuple):
    """Mean (states,) and covariance (states, states) of x, y, theta, v, w and, with memory, the camera's errors."""

    mean: Any
    covariance: Any


def filter_run(solution: Hold, pull: Force, start: State, noise: Noise, run) -> tuple[Array, Array]:
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
    """The filter over all rows: the belief after the last one, and innovations of every row (rows, 3)."""
    even = jnp.ndim(solution.step) == 0
    poses = jnp.stack(run.pose, axis=-1)

    def body(belief, now):
        pull, own, pose, seen, last = now
        belief, found = take_in(belief, pose, seen, noise)
        pull = Force(*(jnp.where(last, 0.0, f) for f in pull))
        return predict_belief(belief, pull, solution if even else own, noise), found

    last = jnp.arange(len(pull.along)) == len(pull.along) - 1
    steps = None if even else jax.tree.map(lambda leaf: jnp.append(leaf, leaf[-1]), solution)
    return jax.lax.scan(body, belief, (pull, steps, poses, run.seen, last))


def take_in(belief: Belief, pose: Array, seen: Array, noise: Noise) -> tuple[Belief, tuple[Array, Array]]:
    """The belief after a pose (3,), and its normalised innovations and log variances (3,); 0 where unseen."""
    mean, covariance = belief
    memory = noise.correlation_time is not None
    results = []
    for k, sd in enumerate((noise.position, noise.position, noise.heading)):
        shared = covariance[:, k] + covariance[:, 5 + k] if memory else covariance[:, k]
        variance = shared[k] + shared[5 + k] if memory else shared[k] + sd**2
        error = pose[k] - (mean[k] + mean[5 + k] if memory else mean[k])
        error = wrap(error) if k == 2 else error
        weight = jnp.where(seen, shared / variance, 0.0)
        mean = mean + weight * error
        covariance = covariance - weight[:, None] * shared
        results.append((error / jnp.sqrt(variance), jnp.log(variance)))
    normalised, log_variance = (jnp.where(seen, jnp.stack(part), 0.0) for part in zip(*results, strict=True))
    return Belief(mean, covariance), (normalised, log_variance)


def predict_belief(belief: Belief, pull: Force, solution: Hold, noise: Noise) -> Belief:
    """The belief one step later."""
    state = State(*belief.mean[:5])
    transition, entry = slopes(state, pull, solution)
    density = jnp.stack([noise.slip_along, noise.slip_heading])
    entry = entry * (density / jnp.sqrt(solution.step))
    slip = jnp.sum(entry[:, None, :] * entry[None, :, :], axis=-1)
    mean = jnp.stack(advance(state, pull, solution))
    if noise.correlation_time is None:
        return Belief(mean, _carry(_carry(belief.covariance, transition).T, transition) + slip)
    left = jnp.exp(-solution.step / noise.correlation_time)
    fresh = (1.0 - left**2) * jnp.stack([noise.position, noise.position, noise.heading]) ** 2
    p = belief.covariance
    cross = left * _carry(p[:5, 5:], transition)
    states = _carry(_carry(p[:5, :5], transition).T, transition) + slip
    errors = left**2 * p[5:, 5:] + jnp.diag(fresh)
    return Belief(
        jnp.concatenate([mean, left * belief.mean[5:]]),
        jnp.concatenate([jnp.concatenate([states, cross], 1), jnp.concatenate([cross.T, errors], 1)], 0),
    )


def slopes(state: State, pull: Force, solution: Hold) -> tuple[Array, Array]:
    """Derivatives of the state one step later: by the state (5, 5), and by a held acceleration (5, 2)."""
    start = (state.v, state.w, pull.along, pull.heading)
    along_x, along_y = jnp.zeros(4), jnp.zeros(4)
    x = y = 0.0
    for weight, node_v, node_turn in zip(GAUSS_WEIGHTS, solution.node_v, solution.node_turn, strict=True):
        by_v, by_turn = _row(node_v), _row(node_turn)
        sine, cosine = sin_cos(state.theta + _dot(by_turn, start))
        v = _dot(by_v, start)
        along_x = along_x + weight * (cosine * by_v - v * sine * by_turn)
        along_y = along_y + weight * (sine * by_v + v * cosine * by_turn)
        x, y = x + weight * v * cosine, y + weight * v * sine
    h = solution.step
    by_speed = jnp.stack([h * along_x, h * along_y, _row(solution.turn), _row(solution.v), _row(solution.w)])
    by_pose = jnp.eye(5, 3).at[0, 2].set(-h * y).at[1, 2].set(h * x)
    return jnp.concatenate([by_pose, by_speed[:, :2]], axis=1), by_speed[:, 2:]


def _row(response: Response) -> Array:
    return jnp.stack([jnp.zeros(()) if weight is None else jnp.asarray(weight) for weight in response])


def _dot(row: Array, start: tuple) -> Array:
    return sum(row[k] * value for k, value in enumerate(start))


def _carry(matrix: Array, transition: Array) -> Array:
    """transition @ matrix, in plain arithmetic that maps over trials."""
    return jnp.sum(transition[:, :, None] * matrix[None, :, :], axis=1)

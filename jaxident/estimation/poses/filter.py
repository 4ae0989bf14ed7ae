"""The extended Kalman filter on poses: innovations of a robot whose wheels slip at random.

States x, y, theta, v, w, and with camera error of a memory the three errors too; linearised about the filtered path
(Jazwinski 1970, section 8.3). Slip is an acceleration held over each step, of variance density^2 / step. The three
coordinates of a pose are taken in one after the other, which needs no matrix inverse.

Inside the loop over rows each entry of a mean or a matrix is a signal of its own, and zeros by construction are left
out (None). Derivatives and runs then make each entry one long row of numbers. As arrays (5, 5) they made loops over
five: six runs of 1000 rows, with all derivatives, took eight times as long, though a single run three quarters.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Pose, PoseRows, State
from jaxident.numerics import GAUSS_WEIGHTS, sin_cos, wrap
from jaxident.robot.drive import Force, Hold, weigh
from jaxident.robot.noise import Noise

STATES = 5
Entry = Any
"""A number of a matrix, whatever its shape; None for a zero by construction."""
MatrixRows = tuple[tuple[Entry, ...], ...]


class Belief(NamedTuple):
    """Mean (states,) and covariance (states, states) of x, y, theta, v, w and, with memory, the camera's errors."""

    mean: Any
    covariance: Any


class Entries(NamedTuple):
    """A belief entry by entry: mean, and rows of the covariance from the diagonal on."""

    mean: tuple
    covariance: MatrixRows


class RowInnovations(NamedTuple):
    """Of one row: normalised innovations of x, y and theta, and the logarithms of their variances."""

    normalised: tuple
    log_variance: tuple


class Slopes(NamedTuple):
    """Derivatives of the state after a step, five rows each: by the state before, and by a held acceleration along and
    in heading."""

    by_state: MatrixRows
    by_pull: MatrixRows


def filter_run(solution: Hold, pull: Force, start: State, noise: Noise, run) -> tuple[PoseRows, PoseRows]:
    """Normalised innovations and log variances (3, rows) of one run (rows,), the start state taken as known.

    `solution` is that of one step, or of each (rows - 1,); `pull` (rows,).
    """
    _, (normalised, log_variance) = scan_filter(solution, pull, first_belief(start, noise), noise, run)
    return normalised, log_variance


def first_belief(start: State, noise: Noise) -> Belief:
    """A known start state, and camera errors as they are in the long run."""
    if noise.correlation_time is None:
        return Belief(jnp.stack(start), jnp.zeros((STATES, STATES)))
    zeros = jnp.zeros(STATES)
    variance = jnp.stack([noise.position, noise.position, noise.heading]) ** 2
    return Belief(jnp.concatenate([jnp.stack(start), zeros[:3]]), jnp.diag(jnp.concatenate([zeros, variance])))


def scan_filter(solution: Hold, pull: Force, belief: Belief, noise: Noise, run) -> tuple[Belief, tuple[Array, Array]]:
    """The filter over all rows: the belief after the last pose, and innovations and log variances of every row
    (3, rows)."""
    even = jnp.ndim(solution.step) == 0

    def body(belief, now):
        pull, own, pose, seen = now
        belief, found = take_in(belief, pose, seen, noise)
        return predict_belief(belief, pull, solution if even else own, noise), found

    pulls = Force(*(part[:-1] for part in pull))  # a last command acts on nothing any more, and may be missing
    early = Pose(*(part[:-1] for part in run.pose))
    rows = pulls, None if even else solution, early, run.seen[:-1]
    entries, found = jax.lax.scan(body, entries_of(belief), rows)
    entries, last = take_in(entries, Pose(*(part[-1] for part in run.pose)), run.seen[-1], noise)
    whole = jax.tree.map(lambda rows, row: jnp.concatenate([rows, row[None]]), found, last)
    return belief_of(entries), (jnp.stack(whole.normalised), jnp.stack(whole.log_variance))


def entries_of(belief: Belief) -> Entries:
    """A belief entry by entry."""
    size = len(belief.mean)
    rows = tuple(tuple(belief.covariance[i, j] for j in range(i, size)) for i in range(size))
    return Entries(tuple(belief.mean), rows)


def belief_of(entries: Entries) -> Belief:
    """A belief as a vector and a matrix."""
    size = len(entries.mean)
    return Belief(jnp.stack(entries.mean), dense(tuple(_row(entries.covariance, i) for i in range(size))))


def dense(rows: MatrixRows) -> Array:
    """A matrix from its rows of numbers."""
    return jnp.stack([jnp.stack([jnp.asarray(0.0 if entry is None else entry) for entry in row]) for row in rows])


def take_in(belief: Entries, pose: Pose, seen: Array, noise: Noise) -> tuple[Entries, RowInnovations]:
    """The belief after a pose, its normalised innovations and log variances; 0 where it was not seen."""
    mean, covariance = belief
    memory = noise.correlation_time is not None
    normalised, log_variances = [], []
    for k, sd in enumerate((noise.position, noise.position, noise.heading)):
        shared = _row(covariance, k)
        if memory:
            shared = tuple(a + b for a, b in zip(shared, _row(covariance, STATES + k), strict=True))
        variance = shared[k] + (shared[STATES + k] if memory else sd**2)
        error = pose[k] - (mean[k] + mean[STATES + k] if memory else mean[k])
        error = wrap(error) if k == 2 else error
        weight = jnp.where(seen, 1.0 / variance, 0.0)
        gain = tuple(weight * part for part in shared)
        mean = tuple(part + by * error for part, by in zip(mean, gain, strict=True))
        covariance = tuple(
            tuple(entry - gain[i] * part for entry, part in zip(row, shared[i:], strict=True))
            for i, row in enumerate(covariance)
        )
        normalised.append(jnp.where(seen, error / jnp.sqrt(variance), 0.0))
        log_variances.append(jnp.where(seen, jnp.log(variance), 0.0))
    return Entries(mean, covariance), RowInnovations(tuple(normalised), tuple(log_variances))


def predict_belief(belief: Entries, pull: Force, solution: Hold, noise: Noise) -> Entries:
    """The belief one step later under accelerations along and in heading."""
    state, slopes = advance_with_slopes(State(*belief.mean[:STATES]), pull, solution)
    slip = [density / jnp.sqrt(solution.step) for density in (noise.slip_along, noise.slip_heading)]
    entry = tuple(tuple(map(_times, row, slip)) for row in slopes.by_pull)
    if noise.correlation_time is None:
        return Entries(tuple(state), _add(_sandwich(slopes.by_state, belief.covariance), _square(entry)))
    left = jnp.exp(-solution.step / noise.correlation_time)
    errors = tuple((None,) * (STATES + k) + (left,) + (None,) * (2 - k) for k in range(3))
    transition = tuple((*row, None, None, None) for row in slopes.by_state) + errors
    fresh = [(1.0 - left**2) * sd**2 for sd in (noise.position, noise.position, noise.heading)]
    variance = tuple((own,) + (None,) * (2 - k) for k, own in enumerate(fresh))
    slipped = tuple((*row, None, None, None) for row in _square(entry))
    mean = *state, *(left * part for part in belief.mean[STATES:])
    return Entries(mean, _add(_sandwich(transition, belief.covariance), slipped + variance))


def advance_with_slopes(state: State, pull: Force, solution: Hold) -> tuple[State, Slopes]:
    """The state one step later as `drive.advance` has it, and its derivatives."""
    start = (state.v, state.w, *pull)
    moved: list = [None, None]
    by_start: list[list] = [[None] * 4, [None] * 4]
    for part, node_v, node_turn in zip(GAUSS_WEIGHTS, solution.node_v, solution.node_turn, strict=True):
        sine, cosine = sin_cos(state.theta + weigh(node_turn, start))
        v = weigh(node_v, start)
        for axis, (ahead, aside) in enumerate(((cosine, -sine), (sine, cosine))):
            share = part * solution.step
            moved[axis] = _sum(moved[axis], share * v * ahead)
            for k in range(4):
                own = _sum(_times(node_v[k], share * ahead), _times(node_turn[k], share * v * aside))
                by_start[axis][k] = _sum(by_start[axis][k], own)
    end = solution.turn, solution.v, solution.w
    theta, v, w = (weigh(response, start) for response in end)
    after = State(state.x + moved[0], state.y + moved[1], state.theta + theta, v, w)
    one = jnp.ones_like(theta)
    by_pose = (one, None, -moved[1]), (None, one, moved[0]), (None, None, one), (None,) * 3, (None,) * 3
    by_start.extend(map(list, end))
    by_state = tuple((*pose, *speeds[:2]) for pose, speeds in zip(by_pose, by_start, strict=True))
    return after, Slopes(by_state, tuple(tuple(speeds[2:]) for speeds in by_start))


def _row(covariance: MatrixRows, i: int) -> tuple:
    """Row i of a symmetric matrix that is given from the diagonal on."""
    return tuple(covariance[min(i, j)][abs(i - j)] for j in range(len(covariance)))


def _sandwich(left: MatrixRows, covariance: MatrixRows) -> MatrixRows:
    """L P L' from the diagonal on."""
    columns = [_row(covariance, j) for j in range(len(covariance))]
    half = [tuple(_dot(row, column) for column in columns) for row in left]
    return tuple(tuple(_dot(row, other) for other in left[i:]) for i, row in enumerate(half))


def _square(rows: MatrixRows) -> MatrixRows:
    """A A' from the diagonal on."""
    return tuple(tuple(_dot(row, other) for other in rows[i:]) for i, row in enumerate(rows))


def _add(one: MatrixRows, other: MatrixRows) -> MatrixRows:
    return tuple(tuple(map(_sum, a, b)) for a, b in zip(one, other, strict=True))


def _dot(row: tuple, other: tuple) -> Entry:
    total = None
    for product in map(_times, row, other):
        total = _sum(total, product)
    return total


def _sum(a: Entry, b: Entry) -> Entry:
    return b if a is None else a if b is None else a + b


def _times(a: Entry, b: Entry) -> Entry:
    return None if a is None or b is None else a * b

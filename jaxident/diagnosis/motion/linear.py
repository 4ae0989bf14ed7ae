"""The poses of all windows linearised: residuals and their differences, whitened, start states projected out.

Everything after this is linear algebra on Gram matrices: steps of the search, scores, replays. Derivatives are forward
differences of the one compiled program that follows windows: they serve effects with corners as well, where a
derivative would say nothing, and compile in a fraction of the time.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array, State, Wheels
from jaxident.diagnosis.motion.driving import each_of, pushes_of, run_each
from jaxident.diagnosis.motion.paths import move, residuals
from jaxident.diagnosis.motion.responses import answer_to_start
from jaxident.diagnosis.motion.rims import rim_speeds
from jaxident.diagnosis.motion.windows import Windows, filled_up, with_room
from jaxident.effects.coordinates import limits, sizes
from jaxident.effects.fast_input import Push
from jaxident.effects.law_arrays import Laws
from jaxident.programs import kept_program

START_STATES = 5
PART = 1e-5
"""Of a coordinate's size: the step of a difference."""
START_STEPS = np.array([1e-5, 1e-4])
"""Steps of differences by the speed along [m/s] and the turn rate [rad/s] at the start."""


class Linear(NamedTuple):
    """Residuals (windows, numbers), derivatives of the modelled poses by coordinates (windows, numbers, columns) and by
    the own start state (windows, numbers, 5); numbers are rows times x, y, heading. rims: the
    speeds of the rims in place of residuals (`motion.rims`), and their derivatives; None without wheel speeds."""

    residual: Any
    slopes: Any
    starts: Any
    rims: Any = None


class Gram(NamedTuple):
    """Products per window of whitened columns free of start states (windows, n, n), the residual last, and what start
    states take of each column (windows, 5, n)."""

    products: Any
    solve: Any


_OF_MOTION = Push, Windows, Wheels, Laws
_residuals, _tracked = kept_program(*_OF_MOTION)(each_of(residuals)), kept_program(*_OF_MOTION, State)(move)


def follow(vectors: Array, starts: Array, windows: Windows) -> np.ndarray:
    """Residuals (batch, windows, numbers) at vectors (batch, SIZE) and starts (batch, 5, windows)."""
    found = run_each(_residuals, vectors, starts, windows)
    return found.transpose(0, 2, 1, 3).reshape(len(found), found.shape[2], -1)


def linearise(vector: Array, starts: Array, windows: Windows, places: list[int]) -> Linear:
    """At a vector (SIZE,) and starts (5, windows), by the coordinates at some places of the vector."""
    step = PART * sizes()
    _, high = limits()
    step = np.where(vector + step > high, -step, step)[places]
    columns = len(places)
    vectors = np.tile(vector, (1 + columns + 2, 1))
    vectors[1 + np.arange(columns), places] += step
    lanes = np.tile(starts, (len(vectors), 1, 1))
    lanes[[-2, -1], [3, 4]] += START_STEPS[:, None]
    found = follow(vectors, lanes, windows)
    change = np.moveaxis(found[:1] - found[1:], 0, -1)
    # by position and heading in closed form; a robot that loses speed to friction or in turns is not slowed as it says
    answers = answer_to_start(np.exp(vector[:2]), found[0], windows)
    answers[..., 3:] = change[..., columns:] / START_STEPS
    return Linear(found[0], change[..., :columns] / step, answers, _of_rims(vectors, lanes, windows, step))


def _of_rims(vectors: Array, lanes: Array, windows: Windows, step: Array) -> Linear | None:
    """Rims at the first of some vectors and starts, and what they gain by the others."""
    if windows.wheels is None:
        return None
    found = rim_speeds(vectors, lanes, windows)
    change = np.moveaxis(found[1:] - found[:1], 0, -1)
    starts = np.zeros((*found.shape[1:], START_STATES))
    starts[..., 3:] = change[..., len(step) :] / START_STEPS
    return Linear(found[0], change[..., : len(step)] / step, starts)


def motion_of(vector: Array, starts: Array, windows: Windows) -> list[np.ndarray]:
    """x, y, heading, v, w (windows, rows) at each row, and the mean pushes from there on (windows, rows, 2)."""
    own, windows = len(windows.run), jax.tree.map(jnp.asarray, with_room(windows))
    starts = filled_up(starts)
    (push,) = pushes_of(vector[None], windows)
    states = [np.asarray(part).T[:own] for part in _tracked(vector, starts, push, windows)]
    return [*states, np.asarray(push.mean).mean(axis=1).transpose(2, 0, 1)[:own]]


def gram(whitener: Array, columns: Array, starts: Array, more: Array | None = None) -> Gram:
    """Products of columns (windows, numbers, n) after a whitener (windows, numbers, numbers); `more`: white rows of
    another sensor (windows, rows, n + 5), start states last."""
    rest, solve = without_starts(whitener, columns, starts, more)
    return Gram(rest.transpose(0, 2, 1) @ rest, solve)


def without_starts(
    whitener: Array, columns: Array, starts: Array, more: Array | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Whitened columns (windows, numbers, n) free of start states, and what these take of them (windows, 5, n)."""
    whitened = whitener @ np.concatenate([columns, starts], axis=2)  # the whitener is read once
    whitened = whitened if more is None else np.concatenate([whitened, more], axis=1)
    columns, starts = whitened[..., :-START_STATES], whitened[..., -START_STATES:]
    scale = np.sqrt(np.sum(starts**2, axis=1, keepdims=True)) + 1e-300
    basis, upper = np.linalg.qr(starts / scale)
    upper = upper + 1e-9 * np.eye(START_STATES)
    taken = basis.transpose(0, 2, 1) @ columns
    return columns - basis @ taken, np.linalg.solve(upper, taken) / scale.transpose(0, 2, 1)


def spread(scores: Array) -> np.ndarray:
    """Covariance (n, n) of a sum of scores (windows, n) that is zero, as these spread over windows."""
    windows = len(scores)
    return scores.T @ scores * windows / max(windows - 1, 1)


def left_over(products: Array, columns: list[int]) -> float:
    """Half the squares that a fit of the last column by some others leaves."""
    last = len(products) - 1
    if not columns:
        return 0.5 * float(products[last, last])
    own, cross, _ = normal(products, columns)
    return 0.5 * float(products[last, last] - cross @ np.linalg.solve(own, cross))


def normal(products: Array, columns: list[int], ridge: float = 1e-10) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normal equations for some columns in units of their length: matrix, right side, lengths."""
    own = products[np.ix_(columns, columns)]
    scale = np.sqrt(np.maximum(np.diagonal(own), 1e-300))
    return own / scale[:, None] / scale + ridge * np.eye(len(columns)), products[columns, -1] / scale, scale

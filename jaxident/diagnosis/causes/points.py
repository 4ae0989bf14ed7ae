"""Points of a grid from which effects without a derivative at neutral, and further forms of others, are looked for."""

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.fit.refit import Data, Solution, bounds
from jaxident.diagnosis.motion.linear import follow, gram, left_over
from jaxident.diagnosis.motion.rims import rim_speeds
from jaxident.diagnosis.preparation.steps import likely_steps
from jaxident.effects.coordinates import (
    COORDINATES,
    PLACES,
    REACHED,
    SEARCHED,
    SILENT,
    seeds,
)
from jaxident.effects.effect import Seed

CENTRES = 6
"""Places along each axis of the field where the centre of an effect of the optics is looked for."""


def points_of(name: str, data: Data, solution: Solution) -> list[Seed]:
    """Seeds for a solution's data; where a record says so, those that the poses or the residuals suggest."""
    suggested = SEARCHED[name].suggested
    if suggested is None:
        return seeds(name, float(data.windows.session[-1] + data.windows.t[-1, -1]))
    if suggested.by == "places":
        return [suggested.seed(*place) for place in _centres(data)]
    return [suggested.seed(*step) for step in likely_steps(data, solution)]


def _centres(data: Data) -> list[tuple[float, float]]:
    """Places (x, y) all over the field that the poses fill, and somewhat beyond."""
    seen = np.asarray(data.windows.pose)[np.asarray(data.windows.seen)]
    ends = [np.percentile(seen[:, k], (1, 99)) for k in (0, 1)]
    x, y = (np.linspace(low - 0.25 * (high - low), high + 0.25 * (high - low), CENTRES) for low, high in ends)
    return [(float(a), float(b)) for a in x for b in y]


def seeded(vector: Array, name: str, seed: dict[str, float]) -> np.ndarray:
    """A vector with an effect at a seed."""
    moved = np.array(vector)
    for key, value in seed.items():
        moved[PLACES[name, key]] = value
    return moved


def sizes_of(name: str) -> list[tuple[str, str]]:
    """The coordinates of an effect that do something alone."""
    return [(name, c.name) for c in COORDINATES[name] if (name, c.name) not in SILENT]


def differences(data: Data, solution: Solution, vectors: list[np.ndarray]) -> np.ndarray:
    """What poses gain when a solution's vector becomes each of some others, (windows, numbers, vectors)."""
    if not vectors:
        return np.zeros((*solution.linear.residual.shape, 0))
    starts = np.broadcast_to(solution.starts, (len(vectors), *solution.starts.shape))
    return np.moveaxis(solution.linear.residual[None] - follow(np.stack(vectors), starts, data.windows), 0, -1)


def rim_differences(data: Data, solution: Solution, vectors: list[np.ndarray]) -> np.ndarray:
    """What rims gain, (windows, numbers, vectors), as in `differences`."""
    base = solution.linear.rims.residual
    if not vectors:
        return np.zeros((*base.shape, 0))
    starts = np.broadcast_to(solution.starts, (len(vectors), *solution.starts.shape))
    return np.moveaxis(rim_speeds(np.stack(vectors), starts, data.windows) - base, 0, -1)


def at_best(data: Data, solution: Solution, pair: tuple[str, str]) -> np.ndarray:
    """The vector of a solution with one coordinate, an instant or a step, where it fits best, all else following
    linearly: -log p has a valley in every window, or jumps wherever a command rounds to another tooth."""
    place, base, (low, high) = PLACES[pair], len(solution.places), bounds(data.windows)
    best = np.array(solution.vector)
    reach = np.array(REACHED[pair].reach)
    for span in best[place] * reach if REACHED[pair].relative else reach:
        vectors = np.tile(best, (17, 1))
        vectors[:, place] += span * np.linspace(-1.0, 1.0, len(vectors))
        vectors[:, place] = np.clip(vectors[:, place], low[place], high[place])
        lanes = np.broadcast_to(solution.starts, (len(vectors), *solution.starts.shape))
        found = np.moveaxis(follow(vectors, lanes, data.windows), 0, -1)
        columns = np.concatenate([solution.linear.slopes, found], axis=2)
        more = _rim_residuals(data, solution, vectors, lanes)
        products = gram(data.whitener, columns, solution.linear.starts, more).products.sum(axis=0)
        orders = [[*range(base), base + k] for k in range(len(vectors))]
        left = [left_over(products[np.ix_(order, order)], order[:-1]) for order in orders]
        best = vectors[_middle_of_best(np.array(left))]
    return best


def _rim_residuals(data: Data, solution: Solution, vectors: Array, lanes: Array) -> np.ndarray | None:
    """White rows of rims: a solution's slopes, what each of some vectors leaves, and the start states."""
    rims, own = data.rims, solution.linear.rims
    if rims is None:
        return None
    left = np.moveaxis(rims.residual(rim_speeds(vectors, lanes, data.windows)), 0, -1)
    return np.concatenate([rims.white(own.slopes), rims.whitener @ left, rims.white(own.starts)], axis=2)


def _middle_of_best(left: Array) -> int:
    """The place in the middle of those next to the best that are as good."""
    best = int(np.argmin(left))
    worse = np.flatnonzero(left > left[best] + 0.5)
    low = np.max(worse[worse < best], initial=-1)
    high = np.min(worse[worse > best], initial=len(left))
    return int((low + high) // 2)

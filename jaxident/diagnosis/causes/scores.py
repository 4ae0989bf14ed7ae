"""Scores of all effects from one fit, without refitting: which are worth a refit, and which this input could show."""

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.causes.search import Data, Solution
from jaxident.diagnosis.causes.steps import likely_steps
from jaxident.diagnosis.motion.linear import explained, follow, gram, left_over, linearise, normal
from jaxident.effects.coordinates import (
    COORDINATES,
    FORMED,
    PLACES,
    REACHED,
    SEARCHED,
    SILENT,
    SMOOTH,
    STEPPED,
    limits,
    seeds,
)
from jaxident.effects.effect import Seed

CENTRES = 6
"""Places along each axis of the field where the centre of an effect of the optics is looked for."""


def _own_seeds(name: str, data: Data, solution: Solution) -> list[Seed]:
    """Seeds for a solution's data; where a record says so, those that the poses or the residuals suggest."""
    suggested = SEARCHED[name].suggested
    if suggested is None:
        return seeds(name, float(data.windows.session[-1] + data.windows.t[-1, -1]))
    if suggested.by == "places":
        return [suggested.seed(*place) for place in _centres(data)]
    return [suggested.seed(step) for step in likely_steps(data, solution)]


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


def score(data: Data, solution: Solution) -> dict[str, float]:
    """What each effect promises to explain beyond a solution, its coordinates free: a linear prediction by the
    derivative at neutral, or by the difference that its best seed makes, whichever is more."""
    free = list(solution.places)
    smooth = {name: [PLACES[pair] for pair in sizes_of(name) if PLACES[pair] not in free] for name in SMOOTH}
    seeded_names = [name for name in COORDINATES if name not in SMOOTH or name in FORMED]
    more = [place for places in smooth.values() for place in places]
    linear = linearise(solution.vector, solution.starts, data.windows, [*free, *more])
    jumps = [
        (name, seed) for name in seeded_names if PLACES[sizes_of(name)[0]] not in free
        for seed in _own_seeds(name, data, solution) if seed
    ]  # fmt: skip
    change = differences(data, solution, [seeded(solution.vector, *jump) for jump in jumps])
    columns = np.concatenate([linear.slopes, change, linear.residual[..., None]], axis=2)
    products = gram(data.whitener, columns, linear.starts).products.sum(axis=0)
    base, column_of = list(range(len(free))), {place: len(free) + k for k, place in enumerate(more)}
    scores = {
        name: explained(products, base, [column_of[p] for p in places]) if places else 0.0
        for name, places in smooth.items()
    }
    for k, (name, _) in enumerate(jumps):
        gain = explained(products, base, [len(free) + len(more) + k])
        scores[name] = max(scores.get(name, 0.0), gain)
    return scores


def sizes_of(name: str) -> list[tuple[str, str]]:
    """The coordinates of an effect that do something alone."""
    return [(name, c.name) for c in COORDINATES[name] if (name, c.name) not in SILENT]


def differences(data: Data, solution: Solution, vectors: list[np.ndarray]) -> np.ndarray:
    """What poses gain when a solution's vector becomes each of some others, (windows, numbers, vectors)."""
    if not vectors:
        return np.zeros((*solution.linear.residual.shape, 0))
    starts = np.broadcast_to(solution.starts, (len(vectors), *solution.starts.shape))
    return np.moveaxis(solution.linear.residual[None] - follow(np.stack(vectors), starts, data.windows), 0, -1)


def beginnings(data: Data, solution: Solution, name: str) -> list[np.ndarray]:
    """Vectors from which to refit one more effect: neutral, and a seed of each further form; or the seed that promises
    most, and one of middling size where size matters, for at a fit that a large effect has bent the promises mislead.
    """
    points = _own_seeds(name, data, solution)
    if name in FORMED:
        return [seeded(solution.vector, name, point) for point in points]
    if len(points) == 1:
        return [seeded(solution.vector, name, points[0])]
    vectors, gains, parts = _promises(data, solution, name, points)
    best = int(np.argmax(gains))
    if name in SMOOTH:  # as large as it promises most: a faint lens far off bends the field as if it were a scale
        low, high = limits()
        return [np.clip(solution.vector + parts[best] * (vectors[best] - solution.vector), low, high)]
    if any((name, key) in STEPPED for key in points[best]):
        near = [{key: v * part for key, v in points[best].items()} for part in np.linspace(0.99, 1.01, 15)]
        vectors, gains, _ = _promises(data, solution, name, near)
        return [vectors[int(np.argmax(gains))]]
    middle = (3 * len(points)) // 5
    return [vectors[best]] if best == middle else [vectors[best], vectors[middle]]


def _promises(data: Data, solution: Solution, name: str, points) -> tuple[list[np.ndarray], list[float], list[float]]:
    """Vectors with an effect at some seeds, the gain that each promises, and of how many times its size."""
    vectors = [seeded(solution.vector, name, seed) for seed in points]
    change = differences(data, solution, vectors)
    columns = np.concatenate([solution.linear.slopes, change, solution.linear.residual[..., None]], axis=2)
    products = gram(data.whitener, columns, solution.linear.starts).products.sum(axis=0)
    base = list(range(len(solution.places)))
    gains, parts, alone = [], [], left_over(products, base) - 0.5 * float(products[-1, -1])
    for k in range(len(points)):
        own, cross, scale = normal(products, [*base, len(base) + k])
        size = np.linalg.solve(own, cross)
        gains.append(alone + 0.5 * float(cross @ size))
        parts.append(float(size[-1] / scale[-1]))
    return vectors, gains, parts


def at_best(data: Data, solution: Solution, pair: tuple[str, str]) -> np.ndarray:
    """The vector of a solution with one coordinate, an instant or a step, where it fits best, all else following
    linearly: -log p has a valley in every window, or jumps wherever a command rounds to another tooth."""
    place, base = PLACES[pair], len(solution.places)
    best = np.array(solution.vector)
    reach = np.array(REACHED[pair].reach)
    for span in best[place] * reach if REACHED[pair].relative else reach:
        vectors = np.tile(best, (17, 1))
        vectors[:, place] += span * np.linspace(-1.0, 1.0, len(vectors))
        lanes = np.broadcast_to(solution.starts, (len(vectors), *solution.starts.shape))
        found = np.moveaxis(follow(vectors, lanes, data.windows), 0, -1)
        columns = np.concatenate([solution.linear.slopes, found], axis=2)
        products = gram(data.whitener, columns, solution.linear.starts).products.sum(axis=0)
        orders = [[*range(base), base + k] for k in range(len(vectors))]
        left = [left_over(products[np.ix_(order, order)], order[:-1]) for order in orders]
        best = vectors[_middle_of_best(np.array(left))]
    return best


def _middle_of_best(left: Array) -> int:
    """The place in the middle of those next to the best that are as good."""
    best = int(np.argmin(left))
    worse = np.flatnonzero(left > left[best] + 0.5)
    low = np.max(worse[worse < best], initial=-1)
    high = np.min(worse[worse > best], initial=len(left))
    return int((low + high) // 2)

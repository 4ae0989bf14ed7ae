"""Scores of all effects from one fit, without refitting: which are worth a refit, and which this input could show."""

from collections.abc import Iterable

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.causes.search import Data, Solution
from jaxident.diagnosis.causes.steps import likely_steps
from jaxident.diagnosis.motion.linear import explained, follow, gram, left_over, linearise, normal
from jaxident.effects.coordinates import (
    COORDINATES,
    PLACES,
    SILENT,
    SMOOTH,
    STEPPED,
    limits,
)

STEPS = np.geomspace(0.02, 0.4, 96)
"""Steps of a quantised command where nothing suggests better ones, in largest commands."""
FORMED = ("backlash", "traction_limit")
"""Effects with a derivative at neutral that says nothing of another form of theirs."""
LENS, CENTRES = 0.01, 6
"""Strength [1/m^2] of a lens, and places along each axis of the field where its centre is looked for."""
INSTANTS = (10.0, 1.2, 0.15)
"""Reach [s] of each search for an instant about the best before."""
STEP_PARTS = (2e-3, 2e-4)
"""Reach, as a part of it, of each search for a step: of a thousand levels some lie within a thousandth of a jump."""
INSTANT, STEP = ("payload_change", "instant"), ("input_quantisation", "step")


def seeds(name: str, duration: float, steps: Iterable[float] = STEPS) -> list[dict[str, float]]:
    """Points from which an effect without a derivative at neutral is looked for; one neutral point for the others.
    duration [s] of all runs; steps of a quantised command."""
    if name == "input_saturation":
        return [{"level": level} for level in (0.9, 0.75, 0.6, 0.45, 0.3)]
    if name == "input_quantisation":
        return [{"step": float(step)} for step in steps]
    if name == "input_rate_limit":
        return [{"inverse_rate": inverse} for inverse in (0.03, 0.07, 0.15, 0.3, 0.6)]
    if name == "stiction":
        return [{"right": s, "left": s, "fade": fade} for s, fade in ((0.05, 0.05), (0.15, 0.05), (0.1, 0.15))]
    if name == "payload_change":
        return [{"loss": 0.1, "instant": duration * part} for part in np.linspace(0.06, 0.94, 12)]
    if name == "backlash":
        return [{}, {"right": 0.02, "left": 0.02, "coasting": 1.0}]
    if name == "traction_limit":
        return [{}, {"inverse_square": 2.0, "dry": 1.0, "spin": 0.02}]
    return [{}]


def _own_seeds(name: str, data: Data, solution: Solution) -> list[dict[str, float]]:
    """Seeds for a solution's data; steps of a quantised command are those that its residuals suggest, centres of a lens
    lie all over the field."""
    if name == "lens_distortion":
        return [{"strength": LENS, "pull_x": LENS * x, "pull_y": LENS * y} for x, y in _centres(data)]
    steps = likely_steps(data, solution) if name == "input_quantisation" else STEPS
    return seeds(name, float(data.windows.session[-1] + data.windows.t[-1, -1]), steps)


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
    for span in INSTANTS if pair == INSTANT else best[place] * np.array(STEP_PARTS):
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

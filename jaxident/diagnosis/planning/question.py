"""What a planned input is judged for: two effects at the sizes expected, what each can do for the other, the noise."""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.causes.points import seeded
from jaxident.diagnosis.noise.law import Law
from jaxident.diagnosis.preparation.prepare import BURN, horizon_rows
from jaxident.diagnosis.preparation.translate import scaled
from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.coordinates import (
    COORDINATES,
    SHAPES,
    SILENT,
    SMOOTH,
    from_catalogue,
    neutral_vector,
    nominal_vector,
    seeds,
    unit_factors,
)
from jaxident.effects.law_arrays import Laws, laws_of
from jaxident.errors import InputError
from jaxident.robot.model import Model, require_physical
from jaxident.robot.noise import Noise

CAMERA = Noise(1e-3, 1e-2)
"""Camera noise [m], [rad] where the model has none."""
SCALES = (0.25, 0.5, 1.0, 2.0)
"""Sizes, in expected ones, at which an effect may explain the other; between them it is taken as linear."""


class Question(NamedTuple):
    """What inputs are judged for, commands over the limit: the robot without the two effects (SIZE,); vectors
    (n, SIZE) with them; for each effect the place among these of its expected size, and its rays, lists of places that
    are fitted together; the noise law, sample period [s] and rows of a window; discovered laws of the robot."""

    base: Any
    vectors: Any
    expected: tuple[int, int]
    rays: tuple[list[list[int]], list[list[int]]]
    law: Law
    period: float
    rows: int
    laws: Laws | None = None


def check_names(effects: tuple[str, ...]) -> None:
    """InputError unless these are two different effects, both of which shape the path."""
    if len(effects) != 2 or effects[0] == effects[1]:
        raise InputError(f"--between {','.join(effects)}: give two different effects with a comma between")
    for name in effects:
        if name not in CATALOGUE:
            raise InputError(f"--between: unknown effect {name!r}; `jaxident effects` lists the names")
        if name not in COORDINATES:
            raise InputError(f"--between: {name} is random and leaves no mark on the mean path: no input separates it")


def noise_of(model: Model) -> tuple[Noise, bool]:
    """The model's noise, camera errors that it lacks as in CAMERA; and whether any was lacking."""
    own = model.noise or Noise()
    position, heading = float(own.position or 0.0), float(own.heading or 0.0)
    assumed = position <= 0.0 or heading <= 0.0
    return own._replace(position=position or CAMERA.position, heading=heading or CAMERA.heading), assumed


def law_of(noise: Noise, period: float) -> Law:
    """The law of a model's noise at a sample period [s]: slip without a memory independent from step to step, as it is
    drawn."""
    slip = float(noise.slip_along or 0.0), float(noise.slip_heading or 0.0)
    whole, white = np.array([noise.position, noise.heading], float), np.zeros(2)
    if noise.correlation_time is None:
        white, memory = whole, None
    else:
        white = white if noise.white_position is None else np.array([noise.white_position, noise.white_heading], float)
        memory = np.sqrt(whole**2 - white**2)
    time = noise.slip_time
    scale = np.sqrt(period if time is None else 2.0 * time)
    return Law(
        float(white[0]),
        float(white[1]),
        slip=(slip[0] / scale, slip[1] / scale) if any(slip) else None,
        slip_time=(1e-3 * period if time is None else float(time)) if any(slip) else None,
        coloured=None if memory is None else (float(memory[0]), float(memory[1])),
        coloured_time=None if noise.correlation_time is None else float(noise.correlation_time),
    )


def expected_size(model: Model, name: str, limit: float, samples: int) -> dict[str, float]:
    """Parameters of an effect in the user's unit: the model's, else the typical ones with `limit` as unit."""
    for effect in model.effects:
        if effect.name == name:
            return {key: float(value) for key, value in effect.parameters.items()}
    duration, factors = samples * float(model.sample_period), unit_factors(name, limit)
    typical = CATALOGUE[name].typical(duration)
    return {key: float(value) * factors[key] for key, value in typical.items()}


def ask(
    model: Model, effects: tuple[str, str], sizes: dict[str, dict[str, float]], noise: Noise, samples: int, limit: float
) -> Question:
    """The question in coordinates; InputError for what makes it void."""
    drive, dead_zone, period = require_physical(model), np.asarray(model.dead_zone, float), float(model.sample_period)
    if not limit > np.max(dead_zone):
        raise InputError(f"--limit {limit:g} lies within the dead zone {np.max(dead_zone):g}: nothing would move")
    rows = BURN + horizon_rows(None, period)[0]
    if samples < 2 * rows:
        raise InputError(f"--samples {samples}: at least {2 * rows} are needed, two windows of a diagnosis")
    base = neutral_vector(scaled(nominal_vector(drive, dead_zone), 1.0 / limit))
    for effect in model.effects:
        if effect.name in COORDINATES and effect.name not in effects:
            base = seeded(base, effect.name, _inner(effect.name, effect.parameters, limit, base))
    vectors: list[np.ndarray] = []
    expected, rays = [], []
    for name in effects:
        size = _inner(name, sizes[name], limit, base)
        expected.append(len(vectors))
        vectors.append(seeded(base, name, size))
        own = _points(name, size, samples * period)
        rays.append([_ray(vectors, base, name, point) for point in own])
    return Question(base, np.stack(vectors), (expected[0], expected[1]), (rays[0], rays[1]), law_of(noise, period),
                    period, rows, laws_of(model.discovered, limit))  # fmt: skip


def _inner(name: str, parameters: dict[str, Any], limit: float, base: Array) -> dict[str, float]:
    """Coordinates of an effect of the robot of a vector, commands over the limit."""
    factors = unit_factors(name, limit)
    return from_catalogue(name, {key: float(value) / factors[key] for key, value in parameters.items()}, base[:2])


def _points(name: str, size: dict[str, float], duration: float) -> list[dict[str, float]]:
    """Coordinates at which an effect may explain another; duration [s] of the input."""
    if name not in SMOOTH:
        return [size, *seeds(name, duration)]
    return [{key: v if (name, key) in SHAPES else scale * v for key, v in size.items()} for scale in SCALES]


def _ray(vectors: list[np.ndarray], base: Array, name: str, point: dict[str, float]) -> list[int]:
    """Places of the vectors, appended to the others, in which one coordinate alone is at a point."""
    shapes = {key: value for key, value in point.items() if (name, key) in SILENT}
    places = []
    for c in COORDINATES[name]:
        if c.name in point and c.name not in shapes:
            places.append(len(vectors))
            vectors.append(seeded(base, name, {**shapes, c.name: float(np.clip(point[c.name], c.low, c.high))}))
    return places

"""Between the coordinates of a search, for commands over their largest, and models in the user's unit."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.causes.search import Solution
from jaxident.diagnosis.motion.coordinates import (
    ASIDE,
    COORDINATES,
    NOMINAL,
    PLACES,
    from_catalogue,
    limits,
    natural,
    neutral_vector,
    nominal_vector,
    to_catalogue,
    unit_factors,
)
from jaxident.diagnosis.noise.law import Law
from jaxident.diagnosis.prepare import Prepared
from jaxident.effects.catalogue import by_name, to_vector
from jaxident.log import Log, join
from jaxident.robot.drive import Physical
from jaxident.robot.model import Effect, Model, Provenance, require_physical
from jaxident.robot.noise import Noise

_POWERS = np.array([0, 0, -1, -1, -1, -1, 1, 1, 0, 0])
"""How the nominal parameters scale with the unit of the command."""


def to_coordinates(model: Model, logs: Log | Sequence[Log]) -> np.ndarray:
    """The coordinates (SIZE,) of a model, its effects included, for the commands of some logs over their largest; what
    is random in it has none."""
    drive = require_physical(model)
    largest = float(np.nanmax(np.abs(np.stack(join(logs).command))))
    point = nominal_vector(drive, np.asarray(model.dead_zone))
    vector = neutral_vector(np.concatenate([point[:2], point[2:] / largest ** _POWERS[2:]]))
    whole = by_name(np.asarray(to_vector(model.effects)))
    for name in (effect.name for effect in model.effects if effect.name in COORDINATES):
        factors = unit_factors(name, largest)
        values = from_catalogue(name, {key: float(v) / factors[key] for key, v in whole[name].items()})
        for key, value in values.items():
            vector[PLACES[name, key]] = value
    return vector


def abreast_of_marker(vector: Array) -> np.ndarray:
    """Coordinates (SIZE,) of the same robot seen from the point of its axle abreast of its marker: the speed there,
    v - b w, in place of v, and no offset of the marker to the left."""
    left = vector[PLACES[ASIDE]]
    rates, gain, (c1, c2) = np.exp(vector[:2]), np.reshape(vector[2:6], (2, 2)), vector[8:10]
    seen, back = np.array([[1.0, -left], [0.0, 1.0]]), np.array([[1.0, left], [0.0, 1.0]])
    decay = seen @ np.array([[rates[0], -c1], [-c2, rates[1]]]) @ back
    found = np.array(vector, float)
    found[:2], found[2:6] = np.log(np.maximum(np.diagonal(decay), 1e-9)), (seen @ gain).ravel()
    found[8:10], found[PLACES[ASIDE]] = (-decay[0, 1], -decay[1, 0]), 0.0
    return found


def in_user_units(point: Array, largest: float) -> list[float]:
    """Nominal parameters in the order of NOMINAL from coordinates for commands over `largest`."""
    return (natural(point) * float(largest) ** _POWERS).tolist()


def parameters_of(solution: Solution, largest: float) -> tuple[tuple[str, ...], list[float], list[float]]:
    """Names, values and standard deviations of the nominal parameters in the user's unit."""
    factor = float(largest) ** _POWERS
    values = natural(solution.vector) * factor
    slope = np.concatenate([np.exp(solution.vector[:2]), np.ones(8)]) * factor
    deviation = np.sqrt(np.diagonal(solution.covariance)[:10]) * np.abs(slope)
    return NOMINAL, values.tolist(), deviation.tolist()


def effect_of(name: str, solution: Solution, largest: float) -> Effect:
    """One effect of a solution with standard deviations, in the user's unit; deviations to first order."""
    coordinates = [c.name for c in COORDINATES[name]]
    here = {key: solution.vector[PLACES[name, key]] for key in coordinates}
    factors, values = unit_factors(name, largest), effect_values(name, solution.vector, largest)
    places = [solution.places.index(PLACES[name, key]) for key in coordinates if PLACES[name, key] in solution.places]
    if not places:  # looked for on a grid alone
        return Effect(name, values)
    own = solution.covariance[np.ix_(places, places)]
    slopes = []
    for place in places:
        key = next(k for k in coordinates if PLACES[name, k] == solution.places[place])
        step = 1e-6 * max(abs(here[key]), 1e-3)
        moved = to_catalogue(name, {**here, key: here[key] + step})
        slopes.append([(moved[k] * factors[k] - values[k]) / step for k in values])
    slope = np.array(slopes)
    spread = np.sqrt(np.maximum(np.einsum("ap,ab,bp->p", slope, own, slope), 0.0))
    deviations = dict(zip(values, spread.tolist(), strict=True))
    if name == ASIDE[0] and PLACES[ASIDE] not in solution.places:
        deviations[ASIDE[1]] = limits()[1][PLACES[ASIDE]] / 3.0**0.5  # it lies anywhere within its bounds
    return Effect(name, values, deviations)


def effect_values(name: str, vector: Array, largest: float) -> dict[str, float]:
    """Parameters of an effect at coordinates (SIZE,), in the user's unit."""
    factors = unit_factors(name, largest)
    found = to_catalogue(name, {c.name: vector[PLACES[name, c.name]] for c in COORDINATES[name]})
    return {key: value * factors[key] for key, value in found.items()}


def to_model(
    prepared: Prepared, solution: Solution, law: Law, effects: tuple[str, ...], direct: dict[str, dict] | None = None
) -> Model:
    """A solution as a model with its noise law and effects, `direct` ones by their parameters. Limits that never act
    are left out."""
    _, values, _ = parameters_of(solution, prepared.largest)
    steps = np.concatenate([np.diff(run.t) for run in prepared.log.runs()])
    found = [effect_of(name, solution, prepared.largest) for name in effects]
    found = [effect for effect in found if np.all(np.isfinite(list(effect.parameters.values())))]
    found += [Effect(name, dict(parameters)) for name, parameters in (direct or {}).items()]
    coupling: Any = np.array(values[8:10])
    return Model(
        float(np.median(steps)),
        Physical(np.array(values[:2]), np.array(values[2:6]).reshape(2, 2), coupling),
        np.array(values[6:8]),
        noise=noise_of(law),
        effects=tuple(found),
        provenance=Provenance(method="diagnosis"),
    )


def noise_of(law: Law) -> Noise:
    """A law as a model's noise: slip as a white acceleration of equal power at low frequency."""
    slip = law.slip or (0.0, 0.0)
    density = float(np.sqrt(2.0 * law.slip_time)) if law.slip_time else 0.0
    return Noise(law.position, law.heading, None, slip[0] * density, slip[1] * density)


def scaled(point: Array, largest: float) -> np.ndarray:
    """Nominal coordinates for commands over `largest` as those in the user's unit."""
    return np.concatenate([point[:2], point[2:10] * float(largest) ** _POWERS[2:]])

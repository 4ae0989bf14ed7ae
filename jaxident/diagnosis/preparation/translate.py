"""Between the coordinates of a search, for commands over their largest, and models in the user's unit."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.fit.prior import held_rates
from jaxident.diagnosis.fit.refit import Solution
from jaxident.diagnosis.noise.law import Law, deviations
from jaxident.diagnosis.preparation.prepare import Prepared
from jaxident.effects.catalogue import BY_CHANCE
from jaxident.effects.coordinates import (
    ASIDE,
    COMMAND_POWERS,
    COORDINATES,
    NOMINAL,
    PLACES,
    limits,
    natural,
    natural_deviations,
    nominal_vector,
    to_catalogue,
    unit_factors,
)
from jaxident.estimation.ahead.session import with_session
from jaxident.robot.drive import Physical
from jaxident.robot.model import Effect, Model, Provenance
from jaxident.robot.noise import Noise


def abreast_of_marker(vector: Array) -> np.ndarray:
    """Coordinates (SIZE,) of the same robot seen from the point of its axle abreast of its marker: the speed there,
    v - b w, in place of v, and no offset of the marker to the left."""
    left, robot = vector[PLACES[ASIDE]], natural(vector)
    rates, gain, (c1, c2) = robot[:2], np.reshape(robot[2:6], (2, 2)), robot[8:10]
    seen, back = np.array([[1.0, -left], [0.0, 1.0]]), np.array([[1.0, left], [0.0, 1.0]])
    decay = seen @ np.array([[rates[0], -c1], [-c2, rates[1]]]) @ back
    drive = Physical(np.maximum(np.diagonal(decay), 1e-9), seen @ gain, -decay[[0, 1], [1, 0]])
    found = np.array(vector, float)
    found[: len(NOMINAL)], found[PLACES[ASIDE]] = nominal_vector(drive, vector[6:8]), 0.0
    return found


def in_user_units(point: Array, largest: float) -> list[float]:
    """Nominal parameters in the order of NOMINAL from coordinates for commands over `largest`."""
    return (natural(point) * float(largest) ** COMMAND_POWERS).tolist()


def parameters_of(solution: Solution, largest: float) -> tuple[tuple[str, ...], list[float], list[float]]:
    """Names, values and standard deviations of the nominal parameters in the user's unit."""
    factor = float(largest) ** COMMAND_POWERS
    values = natural(solution.vector) * factor
    deviation = natural_deviations(solution.vector, solution.covariance) * factor
    return NOMINAL, values.tolist(), deviation.tolist()


def effect_of(name: str, solution: Solution, largest: float) -> Effect:
    """One effect of a solution with standard deviations, in the user's unit; deviations to first order."""
    values = effect_values(name, solution.vector, largest)
    if not {PLACES[name, c.name] for c in COORDINATES[name]} & set(solution.places):  # looked for on a grid alone
        return Effect(name, values)
    slope = _slopes(solution, lambda vector: list(effect_values(name, vector, largest).values()))
    spread = np.sqrt(np.maximum(np.sum(slope @ solution.covariance * slope, axis=1), 0.0))
    deviations = dict(zip(values, spread.tolist(), strict=True))
    if name == ASIDE[0] and PLACES[ASIDE] not in solution.places:
        deviations[ASIDE[1]] = limits()[1][PLACES[ASIDE]] / 3.0**0.5  # it lies anywhere within its bounds
    return Effect(name, values, deviations)


def effect_values(name: str, vector: Array, largest: float) -> dict[str, float]:
    """Parameters of an effect at coordinates (SIZE,), in the user's unit."""
    factors = unit_factors(name, largest)
    found = to_catalogue(name, {c.name: vector[PLACES[name, c.name]] for c in COORDINATES[name]}, vector[:2])
    return {key: value * factors[key] for key, value in found.items()}


def to_model(
    prepared: Prepared,
    vector: Array,
    law: Law,
    effects: tuple[str, ...],
    direct: dict[str, dict] | None = None,
    fit: Solution | None = None,
) -> Model:
    """Coordinates (SIZE,) as a model with its noise law and effects, `direct` ones by their parameters, and the laws of
    the model that was given; with the deviations and the covariance of a fit where one is given. Limits that never act
    are left out."""
    held = held_rates(prepared.windows) if prepared.told is None else ()
    values = in_user_units(vector, prepared.largest)
    steps = np.concatenate([np.diff(run.t) for run in prepared.log.runs()])
    found = [_effect(name, vector, prepared.largest, fit) for name in effects]
    found = [effect for effect in found if np.all(np.isfinite(list(effect.parameters.values())))]
    order, covariance = ((), None) if fit is None else covariance_of(fit, found, prepared.largest)
    found += [Effect(name, dict(parameters)) for name, parameters in (direct or {}).items()]
    return Model(
        float(np.median(steps)),
        Physical(np.array(values[:2]), np.array(values[2:6]).reshape(2, 2), np.array(values[8:10])),
        np.array(values[6:8]),
        noise=noise_of(law, BY_CHANCE["memory"] in (direct or {})),
        effects=tuple(found),
        discovered=prepared.laws,
        covariance=covariance,
        parameter_order=order,
        provenance=with_session(Provenance(method="diagnosis", from_prior=held), prepared.log),
    )


def _effect(name: str, vector: Array, largest: float, fit: Solution | None) -> Effect:
    return Effect(name, effect_values(name, vector, largest)) if fit is None else effect_of(name, fit, largest)


def covariance_of(fit: Solution, effects: list[Effect], largest: float) -> tuple[tuple[str, ...], np.ndarray]:
    """Names and covariance of the parameters of a fit in the user's units, to first order; see `slopes_of`."""
    names, slope = slopes_of(fit, effects, largest)
    return names, slope @ fit.covariance @ slope.T


def slopes_of(fit: Solution, effects: Sequence[Effect], largest: float) -> tuple[tuple[str, ...], np.ndarray]:
    """Names of the parameters of a fit in the user's units, those of effects as effect.parameter, and how they answer
    to its free coordinates (parameters, coordinates); without those that were looked for on a grid alone."""
    names = [*NOMINAL, *(f"{effect.name}.{key}" for effect in effects for key in effect.parameters)]

    def values(vector: Array) -> list[float]:
        own = [effect_values(effect.name, vector, largest) for effect in effects]
        return [*in_user_units(vector, largest), *(value for each in own for value in each.values())]

    slope = _slopes(fit, values)
    told = np.any(slope != 0.0, axis=1)
    return tuple(name for name, kept in zip(names, told, strict=True) if kept), slope[told]


def _slopes(fit: Solution, values: Callable[[Array], Any]) -> np.ndarray:
    """How some values (parameters,) of a vector (SIZE,) answer to the free coordinates of a fit (parameters,
    coordinates)."""
    columns, here = [], np.array(values(fit.vector))
    for place in fit.places:
        step, moved = 1e-6 * max(abs(fit.vector[place]), 1e-3), np.array(fit.vector)
        moved[place] += step
        with np.errstate(invalid="ignore"):  # a limit that never acts is infinite
            columns.append((np.array(values(moved)) - here) / step)
    return np.stack(columns, axis=1)


def noise_of(law: Law, apart: bool = False) -> Noise:
    """A law as a model's noise; apart: the camera's memory is told as an effect."""
    slip, time = law.slip or (0.0, 0.0), law.slip_time
    density = float(np.sqrt(2.0 * time)) if time else 0.0
    slipping = {"slip_along": slip[0] * density, "slip_heading": slip[1] * density, "slip_time": time or None}
    if law.coloured is None or apart:
        return Noise(law.position, law.heading, None, **slipping)
    _, position, heading = deviations(law).tolist()
    return Noise(position, heading, law.coloured_time, white_position=law.position, white_heading=law.heading,
                 **slipping)  # fmt: skip


def scaled(point: Array, largest: float) -> np.ndarray:
    """Nominal coordinates for commands over `largest` as those in the user's unit."""
    return np.concatenate([point[:2], point[2:10] * float(largest) ** COMMAND_POWERS[2:]])

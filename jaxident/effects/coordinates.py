"""What a diagnosis searches over: the nominal robot and every effect, in coordinates with a derivative at neutral.

A limit acts through its inverse, traction through the inverse square (tanh(c / L) L = c - c^3 / (3 L^2) + ...), a slope
through its two components, a payload through what it makes accelerations lose. All that is said here of single effects
comes from their records.
"""

from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array
from jaxident.effects.catalogue import CATALOGUE, by_name, to_vector
from jaxident.effects.effect import UNIT, Coordinate, Search, Seed
from jaxident.robot.drive import TYPICAL_RATE, Physical
from jaxident.robot.model import Model, require_physical

TYPICAL = np.log([TYPICAL_RATE, TYPICAL_RATE])
"""Both rates of a typical robot, as a search has them: logarithms."""

REACH = 1.0
"""Time [s] after which speeds are compared (`pace`): about that of a window. Of 0.3, 1 and 5 s it left fits to halves
of two Creates' logs lowest: 20 steps ended 105 and 555 higher with 0.3, 0.1 and 60 higher with 5."""

NOMINAL = ("rate_1", "rate_2", "gain_11", "gain_12", "gain_21", "gain_22", "dead_zone_r", "dead_zone_l",
           "coupling_1", "coupling_2")  # fmt: skip
"""The nominal unknowns; rates stand as their logarithms, gains and couplings for a typical robot (`pace`)."""

SEARCHED: dict[str, Search] = {name: each.search for name, each in CATALOGUE.items() if each.search is not None}
"""How each effect that shapes the mean path is looked for; the random ones are in the noise."""

COORDINATES: dict[str, tuple[Coordinate, ...]] = {name: search.coordinates for name, search in SEARCHED.items()}
"""What is searched of each of them."""

SMOOTH = tuple(name for name, search in SEARCHED.items() if search.smooth)
"""Effects whose score is a derivative at neutral; the others are looked for from `seeds`."""

FORMED = tuple(name for name in SMOOTH if SEARCHED[name].seeds is not None)
"""Effects with a derivative at neutral that says nothing of another form of theirs."""


def _pairs(quality: str) -> set[tuple[str, str]]:
    """Effect and coordinate of those that have a quality."""
    return {(name, each.name) for name, own in COORDINATES.items() for each in own if getattr(each, quality)}


STEPPED = _pairs("stepped")
"""Coordinates that poses follow in jumps, or that choose between two forms: looked for on a grid alone."""

SHAPES = _pairs("shape")
"""Coordinates that shape an effect, whatever its size, and do nothing alone."""

TWO_FORMS = sorted(STEPPED & SHAPES)
"""Coordinates that choose between two forms of an effect, by 0 or 1: a tyre that yields or a dry one."""

REACHED = {pair: next(c for c in COORDINATES[pair[0]] if c.name == pair[1]) for pair in sorted(_pairs("reach"))}
"""Coordinates by which -log p has many valleys, an instant, a phase or a step of a comb: looked for where it fits
best."""

INSTANTS = {
    (name, each.name) for name in SEARCHED for each in CATALOGUE[name].parameters
    if each.instant and (name, each.name) in REACHED
}  # fmt: skip
"""Those of them that are session times."""

BY_DRIVE = _pairs("by_drive")
"""Coordinates above 0 of which what drives the wheels depends on the nominal drive as well."""

(ASIDE,) = _pairs("unseen")
"""Seen from a point beside the middle of its axle a robot is another nominal robot, v - b w its speed along: how far to
the left a marker is nothing tells, but an effect that acts on the speeds of axle or wheels."""

ACCELERATIONS = [
    (name, c.name, c.accelerates) for name, own in COORDINATES.items() for c in own if c.accelerates is not None
]
"""Effect, coordinate and channel of accelerations. They stand for a typical robot, too (`pace`). On half a Create's log
the loss in turns over the rate was known to 2.6 %, the loss to 8 %. A table that was linear in the loss called it
doubtful. A refit without it raised -log p by 4800."""

ON_SPEEDS = {name for name, search in SEARCHED.items() if search.on_speeds}
"""Such effects; play that coasts acts on speeds, too, but tells too little."""

POSES_ONLY = frozenset(name for name in SEARCHED if CATALOGUE[name].poses_only)
"""Effects of the camera's clock, which wheel speeds are without."""

SILENT = SHAPES | _pairs("silent")
"""Coordinates that do nothing alone."""

PLACES = {
    (name, coordinate.name): len(NOMINAL) + place
    for place, (name, coordinate) in enumerate((n, c) for n, cs in COORDINATES.items() for c in cs)
}
"""Where a coordinate stands in the vector of all, behind the nominal ones."""

SIZE = len(NOMINAL) + len(PLACES)
_ALL = [coordinate for coordinates in COORDINATES.values() for coordinate in coordinates]


def pace(rates: Array, numbers: Any = np) -> Any:
    """How many times a typical robot's accelerations (2,) are those of a robot with some rates (2,), logarithms, that
    reaches the same speeds from rest within REACH: (1 - exp(-r T)) / r of the typical rate over that of its own.
    numbers: NumPy or jax.numpy.

    Poses show speeds that are reached. Where a robot settles fast, or a lag hides how fast, they tell an acceleration
    over the rate better than either. In gains as they are, 60 steps of a fit to half a Create's log zigzagged along a
    valley, their rates by a fifth to and fro, and did not arrive.
    """
    rate = numbers.exp(rates)
    return rate / numbers.expm1(-REACH * rate) * (np.expm1(-REACH * TYPICAL_RATE) / TYPICAL_RATE)


def neutral_vector(nominal: Array) -> np.ndarray:
    """All coordinates (SIZE,) of a nominal robot (10,) without effects."""
    return np.concatenate([np.asarray(nominal, float), [coordinate.neutral for coordinate in _ALL]])


def of_wheels(vectors: Array) -> np.ndarray:
    """Vectors (..., SIZE) without what acts on the poses alone."""
    free = [PLACES[name, c.name] for name in POSES_ONLY for c in COORDINATES[name]]
    found = np.array(vectors)
    found[..., free] = neutral_vector(np.zeros(len(NOMINAL)))[free]
    return found


def limits() -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest value (SIZE,) that a search may visit."""
    low = [np.log(1e-2)] * 2 + [-np.inf] * 4 + [0.0] * 2 + [-np.inf] * 2 + [c.low for c in _ALL]
    high = [np.log(1e3)] * 2 + [np.inf] * 8 + [c.high for c in _ALL]
    return np.array(low), np.array(high)


def sizes() -> np.ndarray:
    """A typical size (SIZE,) of each coordinate."""
    return np.array([0.3, 0.3, 1.0, 1.0, 5.0, 5.0, 0.1, 0.1, 0.1, 1.0, *(c.size for c in _ALL)])


def by_effect(vector: Array) -> Mapping[str, dict[str, Any]]:
    """The coordinates of a vector (SIZE,) by effect, then name; accelerations as those of its own robot."""
    times = pace(vector[:2], jnp)
    whole = {name: {c.name: vector[PLACES[name, c.name]] for c in own} for name, own in COORDINATES.items()}
    for name, key, channel in ACCELERATIONS:
        whole[name][key] = times[channel] * whole[name][key]
    return whole


def free_places(effects: tuple[str, ...]) -> list[int]:
    """Places of the nominal unknowns and of all coordinates of the effects, but one that nothing tells (`ASIDE`)."""
    untold = set() if ON_SPEEDS & set(effects) else {ASIDE}
    pairs = ((name, c.name) for name in effects for c in COORDINATES[name])
    return [*range(len(NOMINAL)), *(PLACES[pair] for pair in pairs if pair not in untold)]


def seeds(name: str, duration: float) -> list[Seed]:
    """Points from which an effect without a derivative at neutral is looked for; one neutral point for the others.
    duration [s] of all runs."""
    found = SEARCHED[name].seeds
    return [{}] if found is None else found(duration)


def to_catalogue(name: str, values: Mapping[str, float], rates: Array = TYPICAL) -> dict[str, float]:
    """Coordinates of one effect as the parameters that the catalogue has; rates (2,): logarithms, of the robot."""
    transform, times = SEARCHED[name].transform, _paces(name, rates)
    values = {key: float(value) * times.get(key, 1.0) for key, value in values.items()}
    return values if transform is None else transform.to_catalogue(values)


def from_catalogue(name: str, values: Mapping[str, float], rates: Array = TYPICAL) -> dict[str, float]:
    """The coordinates of an effect given by the parameters that the catalogue has; rates (2,): logarithms, of the
    robot."""
    transform, times = SEARCHED[name].transform, _paces(name, rates)
    if transform is None:
        found = {c.name: values.get(c.name, c.neutral) for c in COORDINATES[name]}
    else:
        found = transform.from_catalogue(values)
    return {key: value / times.get(key, 1.0) for key, value in found.items()}


def _paces(name: str, rates: Array) -> dict[str, float]:
    """The pace of a robot with some rates, for those coordinates of an effect that are accelerations."""
    chosen = {key: channel for effect, key, channel in ACCELERATIONS if effect == name}
    return {key: float(pace(rates)[channel]) for key, channel in chosen.items()}


def unit_factors(name: str, largest: float) -> dict[str, float]:
    """What each parameter of the catalogue is multiplied with to pass from commands over their largest to the user's
    unit."""
    factors = {}
    for parameter in CATALOGUE[name].parameters:
        unit = parameter.unit
        power = -1 if unit == f"1/{UNIT}" else 1 if unit.split("/")[0].split(" ")[0] == UNIT else 0
        factors[parameter.name] = largest**power
    return factors


def nominal_vector(drive: Physical, dead_zone: Array) -> np.ndarray:
    """The nominal coordinates (10,) of a drive and dead zones (2,)."""
    coupling = np.zeros(2) if drive.coupling is None else np.asarray(drive.coupling)
    rates = np.log(np.asarray(drive.rate))
    gain = np.asarray(drive.gain) / pace(rates)[:, None]
    return np.concatenate([rates, np.ravel(gain), np.asarray(dead_zone), coupling / pace(rates)])


def natural(nominal: Array) -> np.ndarray:
    """The nominal parameters (10,) that some coordinates stand for: rates in 1/s, accelerations of the robot itself."""
    times = pace(nominal[:2])
    return np.concatenate(
        [np.exp(nominal[:2]), nominal[2:6] * np.repeat(times, 2), nominal[6:8], nominal[8:10] * times]
    )


def natural_deviations(nominal: Array, covariance: Array) -> np.ndarray:
    """Standard deviations (10,) of the nominal parameters, from the covariance of coordinates, the nominal ones first;
    to first order."""
    slope = natural_slopes(nominal)
    return np.sqrt(np.sum(slope @ covariance[: len(slope), : len(slope)] * slope, axis=1))


def natural_slopes(nominal: Array) -> np.ndarray:
    """Derivatives (10, 10) of the nominal parameters by their coordinates."""
    steps = 1e-6 * np.eye(len(NOMINAL))
    return np.stack([(natural(nominal[:10] + step) - natural(nominal[:10] - step)) / 2e-6 for step in steps], axis=1)


COMMAND_POWERS = np.array([0, 0, -1, -1, -1, -1, 1, 1, 0, 0])
"""How the nominal parameters scale with the unit of the command."""


def vector_of(model: Model, largest: float = 1.0) -> np.ndarray:
    """The coordinates (SIZE,) of a physical model, its effects included, for commands over `largest`; what is random in
    it has none. InputError for a model of free numerators."""
    point = nominal_vector(require_physical(model), np.asarray(model.dead_zone))
    vector = neutral_vector(np.concatenate([point[:2], point[2:] / largest ** COMMAND_POWERS[2:]]))
    whole = by_name(np.asarray(to_vector(model.effects)))
    for name in (effect.name for effect in model.effects if effect.name in COORDINATES):
        factors = unit_factors(name, largest)
        values = from_catalogue(name, {key: float(v) / factors[key] for key, v in whole[name].items()}, vector[:2])
        for key, value in values.items():
            vector[PLACES[name, key]] = value
    return vector

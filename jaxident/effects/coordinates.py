"""What a diagnosis searches over: the nominal robot and every effect, in coordinates with a derivative at neutral.

A limit acts through its inverse, traction through the inverse square (tanh(c / L) L = c - c^3 / (3 L^2) + ...), a slope
through its two components, a payload through what it makes accelerations lose, the centre of a lens through its product
with the strength: of strength and centre many pairs bend the field nearly alike, of these coordinates few.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.effects.catalogue import CATALOGUE, by_name, to_vector
from jaxident.effects.entry import UNIT
from jaxident.robot.drive import Physical
from jaxident.robot.model import Model, require_physical

NOMINAL = ("rate_1", "rate_2", "gain_11", "gain_12", "gain_21", "gain_22", "dead_zone_r", "dead_zone_l",
           "coupling_1", "coupling_2")  # fmt: skip
"""The nominal unknowns; rates stand as their logarithms."""


class Coordinate(NamedTuple):
    """One number of an effect as it is searched for: neutral, the bounds of the search, and a typical size."""

    name: str
    neutral: float
    low: float
    high: float
    size: float


def _signed(name: str, high: float) -> Coordinate:
    return Coordinate(name, 0.0, -high, high, 0.3 * high)


def _positive(name: str, high: float) -> Coordinate:
    return Coordinate(name, 0.0, 0.0, high, 0.3 * high)


OFF = 1e3
"""A saturation level far above every command, in largest commands."""

COORDINATES: dict[str, tuple[Coordinate, ...]] = {
    "asymmetric_dead_zone": (_signed("right", 0.5), _signed("left", 0.5)),
    "direction_gain": (_signed("right", 0.7), _signed("left", 0.7)),
    "input_saturation": (Coordinate("level", OFF, 0.05, OFF, 0.5),),
    "input_quantisation": (_positive("step", 0.6),),
    "input_rate_limit": (_positive("inverse_rate", 2.0),),
    "transport_delay": (_positive("delay", 0.5),),
    "motor_lag": (_positive("time_constant", 0.5),),
    "backlash": (_positive("right", 0.5), _positive("left", 0.5), Coordinate("coasting", 0.0, 0.0, 1.0, 1.0)),
    "supply_sag": (_positive("resistance", 1.0),),
    "coulomb_friction": (_positive("right", 0.5), _positive("left", 0.5)),
    "stiction": (_positive("right", 0.6), _positive("left", 0.6), Coordinate("fade", 0.05, 0.005, 0.4, 0.05)),
    "quadratic_drag": (Coordinate("along", 0.0, 0.0, 100.0, 3.0), _positive("heading", 5.0)),
    "mass_offset": (_signed("along", 0.4), _signed("heading", 40.0)),
    "turn_loss": (Coordinate("loss", 0.0, 0.0, 50.0, 0.6),),
    "traction_limit": (
        _positive("inverse_square", 100.0),
        Coordinate("dry", 0.0, 0.0, 1.0, 1.0),
        Coordinate("spin", 0.0, 0.0, 0.3, 0.02),
    ),
    "lateral_slip": (_signed("slip", 0.5),),
    "slope": (_signed("x", 3.0), _signed("y", 3.0)),
    "gain_drift": (_signed("rate", 0.05),),
    "dead_zone_drift": (_signed("rate", 0.05),),
    "payload_change": (_signed("loss", 0.8), Coordinate("instant", 0.0, 0.0, 1e4, 10.0)),
    "marker_offset": (_signed("ahead", 0.3), _signed("left", 0.3)),
    "heading_offset": (_signed("offset", 0.6),),
    "camera_scale": (_signed("difference", 0.4),),
    "lens_distortion": (
        _signed("strength", 2.0),
        Coordinate("pull_x", 0.0, -5.0, 5.0, 0.1),
        Coordinate("pull_y", 0.0, -5.0, 5.0, 0.1),
    ),
    "camera_tilt": (_signed("along_x", 0.4), _signed("along_y", 0.4)),
}
"""Effects that shape the mean path, with what is searched; the random ones are in `noise`."""

SMOOTH = tuple(
    name for name in COORDINATES
    if name not in ("input_saturation", "input_quantisation", "input_rate_limit", "stiction", "payload_change")
)  # fmt: skip
"""Effects whose score is a derivative at neutral; the others are looked for from `seeds`."""

SHORTEST = 1e-4
"""Spin [s] of a wheel below which poses cannot tell it from none, and say nothing about it."""

STEPPED = {("input_quantisation", "step"), ("backlash", "coasting"), ("traction_limit", "dry")}
"""Coordinates that poses follow in jumps, or that choose between two forms: looked for on a grid alone."""

SHAPES = {("stiction", "fade"), ("payload_change", "instant"), ("backlash", "coasting"), ("traction_limit", "dry"),
          ("traction_limit", "spin")}  # fmt: skip
"""Coordinates that shape an effect, whatever its size, and do nothing alone."""

ASIDE = ("marker_offset", "left")
"""Seen from a point beside the middle of its axle a robot is another nominal robot, v - b w its speed along: how far to
the left a marker is nothing tells, but an effect that acts on the speeds of axle or wheels."""

ON_SPEEDS = {"coulomb_friction", "stiction", "quadratic_drag", "mass_offset", "turn_loss", "lateral_slip"}
"""Such effects; play that coasts acts on speeds, too, but tells too little."""

SILENT = SHAPES | {("lens_distortion", "pull_x"), ("lens_distortion", "pull_y"), ASIDE}
"""Coordinates that do nothing alone."""

PLACES = {
    (name, coordinate.name): len(NOMINAL) + place
    for place, (name, coordinate) in enumerate((n, c) for n, cs in COORDINATES.items() for c in cs)
}
"""Where a coordinate stands in the vector of all, behind the nominal ones."""

SIZE = len(NOMINAL) + len(PLACES)
_ALL = [coordinate for coordinates in COORDINATES.values() for coordinate in coordinates]


def neutral_vector(nominal: Array) -> np.ndarray:
    """All coordinates (SIZE,) of a nominal robot (10,) without effects."""
    return np.concatenate([np.asarray(nominal, float), [coordinate.neutral for coordinate in _ALL]])


def limits() -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest value (SIZE,) that a search may visit."""
    low = [np.log(1e-2)] * 2 + [-np.inf] * 4 + [0.0] * 2 + [-np.inf] * 2 + [c.low for c in _ALL]
    high = [np.log(1e3)] * 2 + [np.inf] * 8 + [c.high for c in _ALL]
    return np.array(low), np.array(high)


def sizes() -> np.ndarray:
    """A typical size (SIZE,) of each coordinate."""
    return np.array([0.3, 0.3, 1.0, 1.0, 5.0, 5.0, 0.1, 0.1, 0.1, 1.0, *(c.size for c in _ALL)])


def by_effect(vector: Array) -> Mapping[str, dict[str, Any]]:
    """The coordinates of a vector (SIZE,) by effect, then name."""
    return {
        name: {c.name: vector[PLACES[name, c.name]] for c in coordinates} for name, coordinates in COORDINATES.items()
    }


def free_places(effects: tuple[str, ...]) -> list[int]:
    """Places of the nominal unknowns and of all coordinates of the effects, but one that nothing tells (`ASIDE`)."""
    untold = set() if ON_SPEEDS & set(effects) else {ASIDE}
    pairs = ((name, c.name) for name in effects for c in COORDINATES[name])
    return [*range(len(NOMINAL)), *(PLACES[pair] for pair in pairs if pair not in untold)]


def to_catalogue(name: str, values: Mapping[str, float]) -> dict[str, float]:
    """Coordinates of one effect as the parameters that the catalogue has."""
    if name == "input_rate_limit":
        return {"rate": _inverse(values["inverse_rate"])}
    if name == "traction_limit":
        limit = _inverse(np.sqrt(max(values["inverse_square"], 0.0)))
        spin = float(values["spin"]) if values["spin"] > SHORTEST else 0.0
        return {"limit": limit, "dry": float(values["dry"]), "spin": spin}
    if name == "slope":
        return {
            "acceleration": float(np.hypot(values["x"], values["y"])),
            "direction": float(np.arctan2(values["y"], values["x"])),
        }
    if name == "payload_change":
        return {"ratio": 1.0 / (1.0 - values["loss"]), "instant": float(values["instant"])}
    if name == "lens_distortion":
        strength = float(values["strength"])
        x, y = (float(values[key]) / strength if strength else 0.0 for key in ("pull_x", "pull_y"))
        return {"strength": strength, "centre_x": x, "centre_y": y}
    return {key: float(value) for key, value in values.items()}


def from_catalogue(name: str, values: Mapping[str, float]) -> dict[str, float]:
    """The coordinates of an effect given by the parameters that the catalogue has."""
    if name == "input_rate_limit":
        return {"inverse_rate": 1.0 / values["rate"]}
    if name == "traction_limit":
        shape = {key: values.get(key, 0.0) for key in ("dry", "spin")}
        return {"inverse_square": values["limit"] ** -2, **shape}
    if name == "slope":
        g, angle = values["acceleration"], values["direction"]
        return {"x": g * np.cos(angle), "y": g * np.sin(angle)}
    if name == "payload_change":
        return {"loss": 1.0 - 1.0 / values["ratio"], "instant": values["instant"]}
    if name == "lens_distortion":
        strength = values["strength"]
        pulls = (strength * values.get(key, 0.0) for key in ("centre_x", "centre_y"))
        return {"strength": strength, **dict(zip(("pull_x", "pull_y"), pulls, strict=True))}
    return {c.name: values.get(c.name, c.neutral) for c in COORDINATES[name]}


def unit_factors(name: str, largest: float) -> dict[str, float]:
    """What each parameter of the catalogue is multiplied with to pass from commands over their largest to the user's
    unit."""
    factors = {}
    for parameter in CATALOGUE[name].parameters:
        unit = parameter.unit
        power = -1 if unit == f"1/{UNIT}" else 1 if unit.split("/")[0].split(" ")[0] == UNIT else 0
        factors[parameter.name] = largest**power
    return factors


def _inverse(value: float) -> float:
    return float(1.0 / value) if value > 0.0 else float("inf")


def nominal_vector(drive: Physical, dead_zone: Array) -> np.ndarray:
    """The nominal coordinates (10,) of a drive and dead zones (2,)."""
    coupling = np.zeros(2) if drive.coupling is None else np.asarray(drive.coupling)
    parts = np.log(np.asarray(drive.rate)), np.ravel(np.asarray(drive.gain)), np.asarray(dead_zone), coupling
    return np.concatenate(parts)


def natural(nominal: Array) -> np.ndarray:
    """The nominal coordinates with rates in 1/s."""
    return np.concatenate([np.exp(nominal[:2]), nominal[2:10]])


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
        values = from_catalogue(name, {key: float(v) / factors[key] for key, v in whole[name].items()})
        for key, value in values.items():
            vector[PLACES[name, key]] = value
    return vector

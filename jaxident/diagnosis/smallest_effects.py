"""How small an effect this input could still have shown."""

from collections.abc import Mapping

import numpy as np

from jaxident.diagnosis.causes.finding import CLAIMED
from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.coordinates import COORDINATES, SEARCHED, SHAPES, from_catalogue, to_catalogue

ALL_OR_NOTHING = {name for name, search in SEARCHED.items() if search.all_or_nothing}
"""Effects whose gain does not grow with their size: a level above every command does nothing at all."""


def smallest_sizes(visible: Mapping[str, float]) -> dict[str, dict[str, float] | None]:
    """The parameters at which each effect's gain would just be CLAIMED, {effect: {parameter: value}}, from its gain at
    typical size: gains grow with the square of what is linear in the path, which for a limit is its inverse.

    None for effects that show nothing at any size, or whose gain has no such law.
    """
    return {name: _smallest(name, gain) for name, gain in visible.items()}


def _smallest(name: str, gain: float) -> dict[str, float] | None:
    if gain <= 0.0 or name in ALL_OR_NOTHING:
        return None
    ratio = float(np.sqrt(CLAIMED / gain))
    typical = from_catalogue(name, CATALOGUE[name].typical())
    scaled = {
        c.name: typical[c.name] if (name, c.name) in SHAPES else c.neutral + ratio * (typical[c.name] - c.neutral)
        for c in COORDINATES[name]
    }
    if any(not scaled[c.name] < c.below for c in COORDINATES[name]):
        return None  # no payload takes away more than all
    shapes = [parameter.name for parameter in CATALOGUE[name].parameters if parameter.shape]
    return {key: value for key, value in to_catalogue(name, scaled).items() if key not in shapes}

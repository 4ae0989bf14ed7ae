"""All effects under their names, and their parameters as one vector."""

from collections.abc import Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array
from jaxident.effects import actuation, camera, contact, drive, session
from jaxident.effects.effect import EffectRecord
from jaxident.robot.model import Effect

SITES = ("actuation", "drive", "contact", "time", "camera")
"""What an effect is a property of, from the command to the reported pose; `time` for what changes in a session."""

CATALOGUE: dict[str, EffectRecord] = {
    record.name: record for site in (actuation, drive, contact, session, camera) for record in site.RECORDS
}
"""Every effect by its name, site by site."""

BY_CHANCE: dict[str, str] = {
    record.chance.kind: record.name for record in CATALOGUE.values() if record.chance is not None
}
"""The name of the effect that each kind of chance has (`effect.Chance`)."""

ORDER = tuple((record.name, parameter.name) for record in CATALOGUE.values() for parameter in record.parameters)
"""Effect and parameter of each entry of the vector that the full simulator takes."""

BY_KIND: dict[tuple[str, ...], tuple[str, ...]] = {
    kind: tuple(name for name, record in CATALOGUE.items() if kind in record.kinds)
    for record in CATALOGUE.values()
    for kind in record.kinds
}
"""For each kind of discovered law in whose place effects act, their names."""
NEUTRAL = np.array([parameter.neutral for record in CATALOGUE.values() for parameter in record.parameters])
"""The vector (parameters,) at which no effect does anything."""

_PLACE = {names: place for place, names in enumerate(ORDER)}


def to_vector(effects: Sequence[Effect]) -> Array:
    """The vector (parameters,) in ORDER for a set of effects; what they do not give is neutral. KeyError for unknown
    names (`checks.check_effects` says more)."""
    given = {(effect.name, key): value for effect in effects for key, value in effect.parameters.items()}
    values, places = list(given.values()), [_PLACE[names] for names in given]
    if any(isinstance(value, jax.Array) for value in values):  # they may be traced; else nothing is compiled
        return jnp.asarray(NEUTRAL).at[jnp.asarray(places)].set(jnp.stack([jnp.asarray(v, float) for v in values]))
    vector = NEUTRAL.copy()
    vector[places] = values
    return jnp.asarray(vector)


def by_name(vector: Array) -> Mapping[str, dict[str, Any]]:
    """The entries of a vector (parameters,) by effect, then parameter."""
    found: dict[str, dict[str, Any]] = {name: {} for name in CATALOGUE}
    for place, (name, parameter) in enumerate(ORDER):
        found[name][parameter] = vector[place]
    return found

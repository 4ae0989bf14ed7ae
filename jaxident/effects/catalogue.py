"""All effects under their names, and their parameters as one vector."""

from collections.abc import Mapping, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array
from jaxident.effects import actuation, camera, contact, drive, time
from jaxident.effects.entry import Entry
from jaxident.robot.model import Effect

SITES = ("actuation", "drive", "contact", "time", "camera")
"""Where an effect acts, from the command to the reported pose."""

CATALOGUE: dict[str, Entry] = {
    entry.name: entry for site in (actuation, drive, contact, time, camera) for entry in site.ENTRIES
}
"""Every effect by its name, site by site."""

ORDER = tuple((entry.name, parameter.name) for entry in CATALOGUE.values() for parameter in entry.parameters)
"""Effect and parameter of each entry of the vector that the full simulator takes."""

NEUTRAL = np.array([parameter.neutral for entry in CATALOGUE.values() for parameter in entry.parameters])
"""The vector (parameters,) at which no effect does anything."""

_PLACE = {names: place for place, names in enumerate(ORDER)}


def to_vector(effects: Sequence[Effect]) -> Array:
    """The vector (parameters,) in ORDER for a set of effects; what they do not give is neutral. KeyError for unknown
    names (`checks.check_effects` says more)."""
    given = {(effect.name, key): value for effect in effects for key, value in effect.parameters.items()}
    if not given:
        return jnp.asarray(NEUTRAL)
    places = jnp.asarray([_PLACE[names] for names in given])
    return jnp.asarray(NEUTRAL).at[places].set(jnp.stack([jnp.asarray(value, float) for value in given.values()]))


def by_name(vector: Array) -> Mapping[str, dict[str, Any]]:
    """The entries of a vector (parameters,) by effect, then parameter."""
    found: dict[str, dict[str, Any]] = {name: {} for name in CATALOGUE}
    for place, (name, parameter) in enumerate(ORDER):
        found[name][parameter] = vector[place]
    return found

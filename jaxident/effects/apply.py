"""Effects put into a model, and their sizes."""

import dataclasses
import math
from collections.abc import Iterable
from typing import Any

from jaxident.effects.checks import check_effects
from jaxident.effects.effect import EffectRecord
from jaxident.robot.model import Effect, Model


def with_effects(model: Model, effects: Iterable[tuple[str, dict[str, Any]]]) -> Model:
    """The model with effects, each a name and its parameters, in place of its own of the same name or after them.

    Parameters that are not given are neutral. InputError for effects that `check_effects` refuses.
    """
    new = tuple(Effect(name, dict(parameters)) for name, parameters in effects)
    names = {effect.name for effect in new}
    kept = tuple(effect for effect in model.effects if effect.name not in names)
    check_effects((*kept, *new))
    return dataclasses.replace(model, effects=(*kept, *new))


def sized(effect: EffectRecord, strength: float) -> dict[str, float]:
    """An effect's parameters at `strength` times its typical distance from neutral; where neutral is infinite, typical
    over strength. Parameters that only shape it stay typical."""
    values = {}
    for parameter in effect.parameters:
        distance = parameter.typical - parameter.neutral
        size = parameter.typical / strength if math.isinf(distance) else parameter.neutral + strength * distance
        values[parameter.name] = parameter.typical if parameter.shape else size
    return values

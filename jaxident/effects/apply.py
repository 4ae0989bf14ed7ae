"""Effects put into a model."""

import dataclasses
from collections.abc import Iterable
from typing import Any

from jaxident.effects.checks import check_effects
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

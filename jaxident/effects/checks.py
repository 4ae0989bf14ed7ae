"""What the catalogue refuses, in its own words."""

import math
from collections.abc import Sequence
from typing import Any

import jax
import numpy as np

from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.effect import EffectRecord, Parameter
from jaxident.errors import InputError
from jaxident.robot.model import Effect


def check_effects(effects: Sequence[Effect]) -> None:
    """InputError for an unknown effect, one that stands twice, an unknown parameter or a value that is not allowed.

    Traced values pass.
    """
    names = [effect.name for effect in effects]
    for effect in effects:
        if effect.name not in CATALOGUE:
            raise InputError(f"unknown effect {effect.name!r}; the catalogue has {', '.join(CATALOGUE)}")
        if names.count(effect.name) > 1:
            raise InputError(f"effect {effect.name!r} stands twice; keep one")
        check_parameters(CATALOGUE[effect.name], effect.parameters)


def check_parameters(record: EffectRecord, values: dict[str, Any]) -> None:
    """InputError for a name that the effect does not have or a value that it cannot take."""
    known = {parameter.name: parameter for parameter in record.parameters}
    for name, value in values.items():
        if name not in known:
            listed = ", ".join(f"{p.name} [{p.unit}]" if p.unit else p.name for p in record.parameters)
            raise InputError(f"effect {record.name!r}: unknown parameter {name!r}; it has {listed}")
        if not isinstance(value, jax.core.Tracer):
            _check_value(record, known[name], value)


def check_delay(effects: Sequence[Effect], duration: float) -> None:
    """InputError for a command that comes later than the log is long [s]; the first parameter of every effect by which
    commands arrive late is a time."""
    for effect in effects:
        record = CATALOGUE[effect.name]
        first = record.parameters[0]
        late = effect.parameters.get(first.name, 0.0) if record.stage == "arrival" else 0.0
        if not isinstance(late, jax.core.Tracer) and np.any(np.asarray(late) > duration):
            raise InputError(
                f"effect {effect.name!r}: {first.name} is {np.max(late):g} s, longer than the log of {duration:g} s: "
                f"nothing would arrive; {first.allowed}"
            )


def _check_value(record: EffectRecord, parameter: Parameter, value: Any) -> None:
    found = np.asarray(value, float)
    bad = np.isnan(found) | (found < parameter.least) | (found > parameter.most)
    if parameter.above:
        bad |= found == parameter.least
    if math.isfinite(parameter.neutral):
        bad |= np.isinf(found)
    if bad.any():
        shown = f"{found[bad].flat[0]:g}" if found.ndim else f"{float(found):g}"
        what = f"{parameter.name} is {shown}; {parameter.allowed} ({record.equation})"
        raise InputError(f"effect {record.name!r}: {what}")

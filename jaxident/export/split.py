"""Which part of a model a target carries in a field, which the wrapper around the commands carries, and which neither.

What can be carried is read from the records of effects: their stage, their quantity and their statements. A target says
which quantities it has a field for, and at which stages its wrapper works.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.stages import INPUT, MOTION, STAGES
from jaxident.robot.model import Effect, Model

FIELD, WRAPPER, LOST = "field", "wrapper", "not carried"

GAIN, RATE, COUPLING, DEAD_ZONE = "gain", "rate", "coupling", "dead zone"
CAMERA, SLIP, DISCOVERED = "camera noise", "random slip", "discovered"

ANY = "*"
"""Quantity of a target's field that takes every effect."""

COMMANDS = frozenset(INPUT)
"""Stages of a wrapper that hands on the pushes of the wheels."""
DRIVE = COMMANDS | frozenset(MOTION)
"""Stages of a wrapper that hands on the robot's speeds, the whole drive within it."""
EVERY = frozenset(STAGES)


class Target(NamedTuple):
    """What a target can hold. fields: {quantity: the field that carries it}. stages: those at which its wrapper works,
    or for a program that holds the laws themselves (`inside`) those of its own code. needs_wheels: whether it describes
    the robot by wheels and masses. wraps: nominal quantities that the wrapper carries.
    uses: options that it needs (`ask.Ask`)."""

    name: str
    title: str
    fields: Mapping[str, str]
    stages: frozenset[str] = frozenset()
    inside: bool = False
    needs_wheels: bool = False
    wraps: frozenset[str] = frozenset()
    uses: tuple[str, ...] = ()


class Part(NamedTuple):
    """One part of a model: its name, how it is carried and by what, and if not, the root mean square error of position
    [mm] 1 s ahead that stays, None where that is not known; source: where the number comes from."""

    name: str
    how: str
    where: str
    gap: float | None = None
    source: str = ""
    effect: bool = False


def values_of(effect: Effect) -> dict[str, float]:
    """All parameters of an effect, those not given at neutral."""
    return CATALOGUE[effect.name].neutral() | {key: float(value) for key, value in effect.parameters.items()}


def acts(effect: Effect) -> bool:
    """Whether the effect does anything at its parameters."""
    values = values_of(effect)
    return any(values[p.name] != p.neutral for p in CATALOGUE[effect.name].parameters if not p.shape)


def split(model: Model, target: Target, coupled: bool = True) -> list[Part]:
    """Every part of the model with how the target carries it; `gap.measured` adds the millimetres. coupled: whether
    there are masses that give the model's coupling."""
    nominal = [_nominal(name, model, target) for name in _quantities(model)]
    if not coupled and COUPLING in target.fields:
        lost = Part(COUPLING, LOST, "no masses give it")
        nominal = [lost if part.name == COUPLING else part for part in nominal]
    laws = [_discovered(target)] if model.discovered else []
    return nominal + [_effect(effect, model, target) for effect in model.effects if acts(effect)] + laws


def _quantities(model: Model) -> list[str]:
    """The nominal quantities that the model has."""
    drive, noise = model.physical, model.noise
    found = [GAIN, RATE]
    if drive is not None and drive.coupling is not None and np.any(np.asarray(drive.coupling)):
        found.append(COUPLING)
    if np.any(np.asarray(model.dead_zone)):
        found.append(DEAD_ZONE)
    if noise is not None and (noise.position or noise.heading):
        found.append(CAMERA)
    if noise is not None and (noise.slip_along or noise.slip_heading):
        found.append(SLIP)
    return found


def _nominal(name: str, model: Model, target: Target) -> Part:
    if name in target.fields:
        return Part(name, FIELD, target.fields[name])
    if name in target.wraps:
        return Part(name, WRAPPER, "the commands' wrapper")
    size = ""
    if model.noise is not None and name in (CAMERA, SLIP):
        along, heading = (("position", "m"), ("heading", "rad")) if name == CAMERA else (
            ("slip_along", "m/s^1.5"), ("slip_heading", "rad/s^1.5"))  # fmt: skip
        size = ", of " + " and ".join(f"{getattr(model.noise, key):.3g} {unit}" for key, unit in (along, heading))
    return Part(name, LOST, f"{target.title} has no word for it{size}")


def _effect(effect: Effect, model: Model, target: Target) -> Part:
    record, values = CATALOGUE[effect.name], values_of(effect)
    if ANY in target.fields:
        return Part(effect.name, FIELD, target.fields[ANY], effect=True)
    if record.quantity in target.fields and _alone(effect, model) and _in_first_form(effect):
        return Part(effect.name, FIELD, target.fields[record.quantity], effect=True)
    if record.chance is not None:
        return Part(effect.name, LOST, "it acts by chance", effect=True)
    if record.poses_only and not target.inside:
        return Part(effect.name, LOST, "it is the camera's: the robot itself is not late", effect=True)
    if record.stage in target.stages and record.step is not None:
        if record.step.holds(values):
            where = "the law itself" if target.inside else "the commands' wrapper"
            return Part(effect.name, FIELD if target.inside else WRAPPER, where, effect=True)
        return Part(effect.name, LOST, f"its law is carried only without {', '.join(record.step.neutral)}", effect=True)
    return Part(effect.name, LOST, f"{target.title} has no word for it, and no command can do it", effect=True)


def _discovered(target: Target) -> Part:
    """The discovered laws together."""
    if ANY in target.fields:
        return Part(DISCOVERED, FIELD, target.fields[ANY])
    return Part(DISCOVERED, LOST, f"{target.title} has no word for the curve of a signal")


def _in_first_form(effect: Effect) -> bool:
    """Whether what acts before the wheels has the first of its forms, as fields of simulators have it: those that limit
    commands cut them off, and those that lag have one pole."""
    record, values = CATALOGUE[effect.name], values_of(effect)
    return record.stage not in INPUT or all(values[p.name] == p.neutral for p in record.parameters if p.shape)


def _alone(effect: Effect, model: Model) -> bool:
    """Whether a field may stand for the effect although the wrapper acts before it. A limit or a delay can change
    places with what is the same for each wheel at any time; it cannot with what mixes wheels or goes by the clock."""
    record = CATALOGUE[effect.name]
    if record.stage not in ("command", "arrival"):
        return True
    others = [CATALOGUE[one.name] for one in model.effects if one.name != effect.name and acts(one)]
    after = ("slew", "zone", "motor", "gear")
    if record.stage == "command":
        return not any(one.stage in ("command", *after) for one in others)
    return not any(one.timed and one.stage in ("arrival", *after) for one in others)


def inside_wrapper(model: Model, parts: list[Part]) -> tuple[Effect, ...]:
    """The effects that the wrapper carries."""
    names = {part.name for part in parts if part.effect and part.how == WRAPPER}
    return tuple(effect for effect in model.effects if effect.name in names)

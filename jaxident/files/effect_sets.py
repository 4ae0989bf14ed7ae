"""Sets of effects as a study file gives them: by name, in typical sizes, by parameters."""

import itertools
import math
from typing import Any, NamedTuple

from jaxident.effects.apply import sized
from jaxident.effects.catalogue import CATALOGUE
from jaxident.errors import InputError
from jaxident.files.schema import take_list, take_number, take_object, take_text
from jaxident.robot.model import Effect
from jaxident.study.design import EffectSet

NONE = "none"
"""Name of the empty set."""

MOST_SETS = 10_000
"""Sets that one entry may make."""


class Sized(NamedTuple):
    """An effect, and how its size is written in the name of its set."""

    effect: Effect
    label: str


def take_axis(value: Any, where: str) -> tuple[EffectSet, ...]:
    """The entries of a study's axis of effects: `none`, names of effects (typical size), or sets as in `take_sets`,
    which may have a `name`. InputError names the entry at fault."""
    entries = list(value) if isinstance(value, tuple) else take_list(value, where)
    if not entries:
        raise InputError(f'{where}: is empty; it needs at least one entry, as ["none"]')
    return tuple(one for k, entry in enumerate(entries) for one in _named(entry, f"{where}[{k}]"))


def take_sets(value: Any, where: str) -> list[tuple[Sized, ...]]:
    """The sets of one entry {effect: size, ...}. A size is a strength above 0, in typical sizes, or an object of
    parameters; a list of sizes makes a set of each (every combination where there are several lists)."""
    choices: list[list[Sized]] = []
    for name, sizes in take_object(value, where).items():
        check_name(name, where)
        each = sizes if isinstance(sizes, list) else [sizes]
        if not each:
            raise InputError(f"{where}: {name}: is empty; it needs at least one size")
        if len(each) * math.prod(map(len, choices)) > MOST_SETS:
            raise InputError(f"{where}: makes more than {MOST_SETS} sets; give fewer sizes")
        choices.append([_sized(name, size, f"{where}: {name}") for size in each])
    return list(itertools.product(*choices))


def check_name(name: str, where: str) -> None:
    """InputError for a name that no effect of the catalogue has."""
    if name not in CATALOGUE:
        raise InputError(f"{where}: unknown effect {name!r}; the catalogue has {', '.join(CATALOGUE)}")


def _named(entry: Any, where: str) -> list[EffectSet]:
    """The sets of an entry of the axis."""
    if isinstance(entry, str):
        if entry == NONE:
            return [EffectSet(NONE)]
        check_name(entry, where)
        return [EffectSet(entry, (Effect(entry, sized(CATALOGUE[entry], 1.0)),))]
    given = dict(take_object(entry, where))
    title = take_text(given.pop("name"), f"{where}: name") if "name" in given else ""
    sets = take_sets(given, where)
    if title and len(sets) > 1:
        raise InputError(f"{where}: name: {title!r} would name {len(sets)} sets; leave it out, or give one size each")
    return [
        EffectSet(title or " + ".join(one.label for one in found) or NONE, tuple(one.effect for one in found))
        for found in sets
    ]


def _sized(name: str, size: Any, where: str) -> Sized:
    if isinstance(size, dict):
        if not size:
            raise InputError(f"{where}: has no parameter; give one, or a strength in typical sizes")
        values = {key: take_number(value, f"{where}.{key}") for key, value in size.items()}
        return Sized(Effect(name, values), f"{name} " + " ".join(f"{key}={value:g}" for key, value in values.items()))
    strength = take_number(size, where)
    if strength <= 0.0:
        raise InputError(f"{where}: is {strength:g}; a strength is above 0, in typical sizes")
    return Sized(Effect(name, sized(CATALOGUE[name], strength)), f"{name} x{strength:g}")

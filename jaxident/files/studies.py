"""Study files: TOML, one key per axis. `study_example` has one, with every key explained."""

import itertools
import math
import os
import re
import tomllib
from collections.abc import Callable
from typing import Any

import numpy as np

from jaxident.effects.apply import with_effects
from jaxident.errors import InputError
from jaxident.files.effect_sets import take_axis, take_sets
from jaxident.files.models import load_model
from jaxident.files.schema import take_keys, take_list, take_number, take_object, take_text
from jaxident.files.source import Source, read_text
from jaxident.robot.drive import Physical
from jaxident.robot.model import Model, require_physical
from jaxident.study.design import PARTS, Candidate, Study, check_study
from jaxident.study.sight import Choice

LARGEST_STUDY = 1 << 20
"""Bytes of a study file."""
DEEPEST_KEY = 8
"""Dots in a key; a study needs two. The time that a key takes to read grows with the square of their number."""
MOST_ROBOTS = 10_000
"""Robots that one entry of a study may make: points of its grid times sets of effects."""

_PART = r"(?:[\w-]++|\"[^\"\n]*+\"|'[^'\n]*+')"
_DEEP_KEY = re.compile(rf"(?<![\w-])(?:{_PART}[ \t]*+\.[ \t]*+){{{DEEPEST_KEY + 1}}}")
_NEEDED = ("seeds", "noise", "robots", "estimators")
_FREE = ("name", "excitations", "amplitude", "samples", "period", "effects", "hold", "heading_per_position",
         "correlation_time", "chunk", "runs")  # fmt: skip


def read_study(path: Source, *, seed: int = 0) -> Study:
    r"""Read a study from a TOML file; models in it are found beside it.

    Args:
        path: the file.
        seed: the number that all random draws follow from.

    Returns:
        Study: what `jaxident.study` runs.

    Raises:
        InputError: one line that names the file and the key at fault.

    Examples:
        >>> import pathlib, jaxident as ji
        >>> text = 'seeds = 8\nnoise = [1e-5]\nestimators = ["batch"]\n[[robots]]\nmodel = "published"\n'
        >>> _ = pathlib.Path("study.toml").write_text(text)
        >>> ji.read_study("study.toml").seeds
        8
    """
    return parse_study(read_text(path, "TOML", LARGEST_STUDY), os.fspath(path), seed=seed)


def parse_study(text: str, name: str, *, seed: int = 0) -> Study:
    """The study in a TOML text; `name` is what error lines call it, and models are found beside."""
    deep = _DEEP_KEY.search(text)
    if deep:
        line = text.count("\n", 0, deep.start()) + 1
        raise InputError(f"{name}, line {line}: a key of more than {DEEPEST_KEY} dots; no key of a study has as many")
    try:
        content = tomllib.loads(text)
    except RecursionError:
        raise InputError(f"{name}: lists or tables are nested too deeply") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{name}: not TOML: {error}") from None
    except ValueError as error:  # an integer of thousands of digits
        raise InputError(f"{name}: a number cannot be read: {error}") from None
    return study_from_dict(content, name, seed=seed)


def study_from_dict(content: Any, name: str = "study", *, seed: int = 0) -> Study:
    """The study that the content of a study file describes."""
    found = take_keys(content, name, _NEEDED, _FREE)
    robots = [
        candidate
        for k, entry in enumerate(take_list(found["robots"], f"{name}: robots"))
        for candidate in _candidates(entry, f"{name}: robots[{k}]", os.path.dirname(name))
    ]
    estimators = take_list(found["estimators"], f"{name}: estimators")
    given = {
        "name": _if_given(found["name"], take_text, f"{name}: name"),
        "excitations": _axis(found["excitations"], take_text, f"{name}: excitations"),
        "effects": _if_given(found["effects"], take_axis, f"{name}: effects"),
        "samples": _axis(found["samples"], _whole, f"{name}: samples"),
        **{key: _axis(found[key], take_number, f"{name}: {key}") for key in ("amplitude", "period")},
        **{key: _if_given(found[key], _whole, f"{name}: {key}") for key in ("hold", "chunk", "runs")},
        **{
            key: _if_given(found[key], take_number, f"{name}: {key}")
            for key in ("heading_per_position", "correlation_time")
        },
    }
    if given["period"] is None and robots:
        given["period"] = (float(robots[0].model.sample_period),)
    study = Study(
        robots=tuple(robots),
        estimators=tuple(_choice(entry, f"{name}: estimators[{k}]") for k, entry in enumerate(estimators)),
        seeds=_whole(found["seeds"], f"{name}: seeds"),
        noise=_axis(found["noise"], take_number, f"{name}: noise") or (),
        seed=seed,
        **{key: value for key, value in given.items() if value is not None},
    )
    check_study(study, name)
    return study


def _candidates(entry: Any, where: str, folder: str) -> list[Candidate]:
    """The robots of one entry, one for each point of its grid."""
    found = take_keys(entry, where, ("model",), ("name", "scale", "spread", "effects"))
    model, title = _model(found["model"], f"{where}: model", folder)
    title = _if_given(found["name"], take_text, f"{where}: name") or title
    scale = take_keys(found["scale"] or {}, f"{where}: scale", (), PARTS)
    spread = take_keys(found["spread"] or {}, f"{where}: spread", (), PARTS)
    widths = tuple(0.0 if v is None else take_number(v, f"{where}: spread.{key}") for key, v in spread.items())
    grid = {
        key: _axis(value if isinstance(value, list) else [value], take_number, f"{where}: scale.{key}") or ()
        for key, value in scale.items()
        if value is not None
    }
    empty = next((key for key, factors in grid.items() if not factors), None)
    if empty is not None:
        raise InputError(f"{where}: scale.{empty}: is empty; it needs at least one entry")
    if math.prod(map(len, grid.values())) > MOST_ROBOTS:
        raise InputError(f"{where}: scale: makes more than {MOST_ROBOTS} robots; give fewer factors")
    points = [dict(zip(grid, point, strict=True)) for point in itertools.product(*grid.values())]
    sets = [("", model)]
    if found["effects"] is not None:
        given = take_list(found["effects"], f"{where}: effects")
        sets = [each for k, one in enumerate(given) for each in _with_sets(model, one, f"{where}: effects[{k}]")]
        if not sets:
            raise InputError(f"{where}: effects: is empty; it needs at least one set, as [{{}}]")
    if len(sets) * len(points) > MOST_ROBOTS:
        raise InputError(f"{where}: effects: makes more than {MOST_ROBOTS} robots; give fewer sets or factors")
    return [
        Candidate(_label(title, point) + more, _scaled(each, point), widths) for more, each in sets for point in points
    ]


def _with_sets(model: Model, entry: Any, where: str) -> list[tuple[str, Model]]:
    """The model with each set of effects of an entry, and what that adds to its name."""
    found = []
    for one in take_sets(entry, where):
        try:
            full = with_effects(model, [(each.effect.name, each.effect.parameters) for each in one])
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
        found.append(("".join(f" + {each.label}" for each in one), full))
    return found


def _model(value: Any, where: str, folder: str) -> tuple[Model, str]:
    """A model, or one by its name or file, and how it is called."""
    if isinstance(value, Model):
        return value, "robot"
    name = take_text(value, where)
    beside = os.path.join(folder, name)
    try:
        found = load_model(beside if os.path.exists(beside) else name)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    return found, name


def _label(title: str, point: dict[str, float]) -> str:
    return " ".join([title, *(f"{key}x{factor:g}" for key, factor in point.items())])


def _scaled(model: Model, point: dict[str, float]) -> Model:
    if not point:
        return model
    drive = require_physical(model)
    parts = drive._asdict() | {"dead_zone": model.dead_zone}
    moved = {key: None if v is None else point.get(key, 1.0) * np.asarray(v, float) for key, v in parts.items()}
    width = moved.pop("dead_zone")
    return Model(model.sample_period, Physical(**moved), width, model.noise, model.effects, discovered=model.discovered,
                 wheels=model.wheels)  # fmt: skip


def _choice(entry: Any, where: str) -> Choice:
    found = take_keys({"method": entry} if isinstance(entry, str) else entry, where, ("method",), ("name", "settings"))
    method = take_text(found["method"], f"{where}: method")
    settings = take_object(found["settings"] or {}, f"{where}: settings")
    return Choice(_if_given(found["name"], take_text, f"{where}: name") or method, method, tuple(settings.items()))


def _axis(value: Any, take: Callable[[Any, str], Any], where: str) -> tuple[Any, ...] | None:
    """The entries of an axis, or None where it is left out."""
    if value is None:
        return None
    entries = value if isinstance(value, tuple) else take_list(value, where)
    return tuple(take(entry, f"{where}[{k}]") for k, entry in enumerate(entries))


def _whole(value: Any, where: str) -> int:
    number = take_number(value, where)
    if not number.is_integer():
        raise InputError(f"{where}: is {number:g}; it should be a whole number")
    return int(number)


def _if_given(value: Any, take: Callable[[Any, str], Any], where: str) -> Any:
    return None if value is None else take(value, where)

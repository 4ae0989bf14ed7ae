"""Checks of what a JSON file holds, value by value; `where` names file and key in every error line."""

import math
from collections.abc import Collection
from typing import Any

import numpy as np

from jaxident.errors import InputError

Shape = tuple[int, ...]


def take_keys(value: Any, where: str, required: Collection[str], optional: Collection[str] = ()) -> dict[str, Any]:
    """An object with the required keys and no unknown ones; optional keys that are not there come as None."""
    if not isinstance(value, dict):
        raise InputError(f"{where}: should be an object with the keys {', '.join([*required, *optional])}")
    known = [*required, *optional]
    unknown = next((key for key in value if key not in known), None)
    if unknown is not None:
        raise InputError(f"{where}: unknown key {unknown!r}; known are {', '.join(known)}")
    missing = next((key for key in required if key not in value), None)
    if missing is not None:
        raise InputError(f"{where}: no key {missing!r}; needed are {', '.join(required)}")
    return {key: value.get(key) for key in known}


def take_number(value: Any, where: str, *, least: float = -math.inf) -> float:
    """A finite number not below `least`."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{where}: should be a number, is {_kind(value)}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise InputError(f"{where}: is not a finite number in double precision")
    if number < least:
        raise InputError(f"{where}: is {number:.10g}; it should be at least {least:g}")
    return number


def take_array(value: Any, where: str, shape: Shape, *, least: float = -math.inf, gaps: bool = False) -> np.ndarray:
    """A float64 array of the given shape from nested lists of numbers; with `gaps`, null stands for NaN."""
    if not shape:
        return np.array(math.nan if gaps and value is None else take_number(value, where, least=least))
    if not isinstance(value, list) or len(value) != shape[0]:
        found = f"{len(value)} entries" if isinstance(value, list) else _kind(value)
        raise InputError(f"{where}: should be a list of shape {' x '.join(map(str, shape))}, is {found}")
    rows = [take_array(v, f"{where}[{k}]", shape[1:], least=least, gaps=gaps) for k, v in enumerate(value)]
    return np.array(rows, float).reshape(shape)


def take_text(value: Any, where: str) -> str:
    """A string."""
    if not isinstance(value, str):
        raise InputError(f"{where}: should be a text, is {_kind(value)}")
    return value


def take_list(value: Any, where: str) -> list[Any]:
    """A list of anything."""
    if not isinstance(value, list):
        raise InputError(f"{where}: should be a list, is {_kind(value)}")
    return value


def take_object(value: Any, where: str) -> dict[str, Any]:
    """An object with any keys."""
    if not isinstance(value, dict):
        raise InputError(f"{where}: should be an object, is {_kind(value)}")
    return value


def _kind(value: Any) -> str:
    """What JSON calls it."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    names = {dict: "an object", list: "a list", str: "a text", int: "a number", float: "a number"}
    return names.get(type(value), type(value).__name__)

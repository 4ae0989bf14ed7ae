"""JSON as this program reads and writes it: strict, and laid out to be read."""

import json
import os
from typing import Any

from jaxident.errors import InputError
from jaxident.files.source import Source, read_text

LINE_LENGTH = 120


def read_json(path: Source) -> Any:
    """The content of a JSON file in UTF-8; InputError names the line where it is not JSON.

    Stricter than Python's own reader: a key given twice is refused, and so are NaN and Infinity, which JSON lacks.
    Numbers become int or float.
    """
    return parse_json(read_text(path, "JSON"), os.fspath(path))


def parse_json(text: str, name: str) -> Any:
    """The content of a JSON text; `name` is what error lines call it."""

    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        content: dict[str, Any] = {}
        for key, value in pairs:
            if key in content:
                raise InputError(f"{name}: key {key!r} is given twice; keep one")
            content[key] = value
        return content

    def refuse(word: str) -> None:
        raise InputError(f"{name}: {word} is not a JSON number; write a finite number, or null where one is allowed")

    try:
        return json.loads(text, object_pairs_hook=unique, parse_constant=refuse)
    except json.JSONDecodeError as error:
        raise InputError(f"{name}, line {error.lineno}, column {error.colno}: not JSON: {error.msg}") from None
    except RecursionError:
        raise InputError(f"{name}: lists or objects are nested too deeply") from None
    except InputError:
        raise
    except ValueError as error:  # an integer of thousands of digits
        raise InputError(f"{name}: a number cannot be read: {error}") from None


def format_json(value: Any) -> str:
    """The JSON text of dicts, lists, strings, numbers, booleans and None, ended by a line feed.

    Indented by two blanks; what fits on one line and holds no object is put on one. Floats read back as they are;
    ValueError for NaN and infinity.
    """
    return _format(value, "") + "\n"


def _format(value: Any, indent: str) -> str:
    flat = json.dumps(value, ensure_ascii=False, allow_nan=False)
    if not isinstance(value, dict | list | tuple) or not value:
        return flat
    if not isinstance(value, dict) and "{" not in flat and len(indent) + len(flat) <= LINE_LENGTH:
        return flat
    inner = indent + "  "
    if isinstance(value, dict):
        opening, closing = "{", "}"
        parts = [f"{json.dumps(key, ensure_ascii=False)}: {_format(entry, inner)}" for key, entry in value.items()]
    else:
        opening, closing = "[", "]"
        parts = [_format(entry, inner) for entry in value]
    return f"{opening}\n{inner}" + f",\n{inner}".join(parts) + f"\n{indent}{closing}"

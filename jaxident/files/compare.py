"""Two outputs of one command, value by value: in what they differ, and by how much."""

import csv
import gzip
import io
import json
import math
import os
import pathlib
from collections.abc import Iterator
from typing import Any, NamedTuple

from jaxident.errors import InputError
from jaxident.files.json_text import parse_json
from jaxident.files.source import Source, explained

NOTHING = "nothing"
"""Stands for a value that only the other output has."""
VERSIONS = ("versions", "version")
"""Keys of a provenance that may differ where nothing else does: they are told apart."""


class Difference(NamedTuple):
    """One value that differs: where it stands, and what it was and is: numbers or text."""

    place: str
    then: Any
    now: Any

    @property
    def size(self) -> float:
        """The difference over the larger of two numbers; infinite for what are no two numbers."""
        if not all(isinstance(one, int | float) and not isinstance(one, bool) for one in (self.then, self.now)):
            return math.inf
        return abs(self.now - self.then) / max(abs(self.then), abs(self.now))


class Comparison(NamedTuple):
    """same: to the bit. values: how many were compared. differences: in the order of the output."""

    same: bool
    values: int
    differences: list[Difference]


def compare(then: Source, now: Source) -> Comparison:
    """Two files of one kind (JSON, CSV or any text, plain or gzipped) against each other. InputError for what cannot be
    read. The versions in a provenance do not count."""
    first, second = _content(then), _content(now)
    if first == second:
        return Comparison(True, sum(1 for _ in _values(then, first)), [])
    before, after = dict(_values(then, first)), dict(_values(now, second))
    places = [*before, *(place for place in after if place not in before)]
    pairs = ((place, before.get(place, NOTHING), after.get(place, NOTHING)) for place in places)
    return Comparison(False, len(places), [Difference(*pair) for pair in pairs if pair[1] != pair[2]])


def _content(path: Source) -> str:
    name = os.fspath(path)
    with explained(name, "text"), open(path, "rb") as stream:
        content = stream.read()
        return (gzip.decompress(content) if name.endswith(".gz") else content).decode("utf-8")


def _values(path: Source, text: str) -> Iterator[tuple[str, Any]]:
    """Each value with its place."""
    name = pathlib.Path(path).name.removesuffix(".gz")
    if name.endswith(".json"):
        yield from _leaves(parse_json(text, os.fspath(path)), "")
    elif name.endswith(".csv"):
        yield from _cells(text, name)
    else:
        yield from ((f"line {number}", line) for number, line in enumerate(text.splitlines(), start=1))


def _leaves(content: Any, place: str) -> Iterator[tuple[str, Any]]:
    if isinstance(content, dict) and content:
        for key, value in content.items():
            if not (key in VERSIONS and place.rpartition(".")[2] == "provenance"):
                yield from _leaves(value, f"{place}.{key}" if place else key)
    elif isinstance(content, list) and content:
        for k, value in enumerate(content):
            yield from _leaves(value, f"{place}[{k}]")
    else:
        yield place, content if isinstance(content, int | float | str) else json.dumps(content)


def _cells(text: str, name: str) -> Iterator[tuple[str, Any]]:
    rows = csv.reader(io.StringIO(text))
    try:
        header = next(rows, [])
        for number, row in enumerate(rows, start=2):
            for column, cell in zip(header, row, strict=True):
                yield f"{column}, line {number}", _number(cell)
    except (csv.Error, ValueError) as error:
        raise InputError(f"{name}: is no table: {error}") from None


def _number(cell: str) -> float | str:
    try:
        return float(cell)
    except ValueError:
        return cell

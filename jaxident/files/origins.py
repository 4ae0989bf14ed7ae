"""The origin of a result in files: as the key `provenance` of JSON, and in a file beside what is no JSON.

{"command": [word, ...], "output": name, "inputs": [{"option", "name", "sha256"}, ...],
 "versions": {package: version, ...}, "seed": integer or null}
"""

import hashlib
import os
import pathlib
import re
from collections.abc import Sequence
from typing import Any

from jaxident.errors import InputError
from jaxident.files.atomic import Target, check_target, write_text
from jaxident.files.json_text import format_json, read_json
from jaxident.files.schema import take_keys, take_list, take_object, take_text
from jaxident.files.source import Source, explained
from jaxident.origin import Input, Origin
from jaxident.robot.model import Provenance

SCHEMA = "jaxident.provenance/1"
ENDING = ".provenance.json"
"""What the name of the file beside an output ends in, after the output's own name."""
KEYS = ("command", "output", "inputs", "versions")
"""Keys of an origin; a seed stands beside them."""
BAG_INDEX = "metadata.yaml"
"""The file that makes a folder a ROS 2 bag."""
BLOCK = 1 << 20


def checksum(path: Source) -> str | None:
    """SHA-256 of a file in hexadecimal. Of a folder of logs or a ROS 2 bag: of the names and checksums of its files in
    order. None for what is neither, as a pipe. InputError where it cannot be read."""
    place = pathlib.Path(path)
    if place.is_dir():
        lines = "".join(f"{checksum(file)} {file.name}\n" for file in _parts(place))
        return hashlib.sha256(lines.encode("utf-8", "surrogateescape")).hexdigest()
    if not place.is_file():
        return None
    found = hashlib.sha256()
    with explained(os.fspath(path), "regular"), open(place, "rb") as stream:
        while block := stream.read(BLOCK):
            found.update(block)
    return found.hexdigest()


def _parts(folder: pathlib.Path) -> list[pathlib.Path]:
    """The files that a folder stands for: all of a bag's, or its tables."""
    with explained(os.fspath(folder), "regular"):
        there = sorted(entry for entry in folder.iterdir() if entry.is_file() and not entry.name.startswith("."))
    bag = folder / BAG_INDEX in there
    return [entry for entry in there if bag or entry.name.endswith((".csv", ".csv.gz"))]


def origin_to_dict(origin: Origin) -> dict[str, Any]:
    """The content of the key `provenance`."""
    return {
        "command": list(origin.command),
        "output": origin.output,
        "inputs": [one._asdict() for one in origin.inputs],
        "versions": dict(origin.versions),
        "seed": origin.seed,
    }


def origin_from_dict(content: Any, where: str) -> Origin:
    """The origin that an object tells, which may have further keys; InputError names the key at fault."""
    found = take_object(content, where)
    missing = next((key for key in KEYS if found.get(key) is None), None)
    if missing is not None:
        raise InputError(f"{where}: no key {missing!r}; it was written by an older version, or not by a command")
    words = take_list(found["command"], f"{where}.command")
    inputs = take_list(found["inputs"], f"{where}.inputs")
    packages = take_object(found["versions"], f"{where}.versions")
    seed = found.get("seed")
    if seed is not None and type(seed) is not int:
        raise InputError(f"{where}.seed: should be an integer or null")
    return Origin(
        tuple(take_text(word, f"{where}.command[{k}]") for k, word in enumerate(words)),
        take_text(found["output"], f"{where}.output"),
        tuple(_read_input(one, f"{where}.inputs[{k}]") for k, one in enumerate(inputs)),
        tuple((name, take_text(value, f"{where}.versions.{name}")) for name, value in packages.items()),
        seed,
    )


def _read_input(content: Any, where: str) -> Input:
    found = take_keys(content, where, ("option", "name", "sha256"))
    option, name = (take_text(found[key], f"{where}.{key}") for key in ("option", "name"))
    if name in ("", ".", "..") or re.search(r"[/\\\0]", name):
        raise InputError(f"{where}.name: {name!r} is no name of a file without its folder")
    if found["sha256"] is None:
        return Input(option, name, None)
    if not re.fullmatch("[0-9a-f]{64}", take_text(found["sha256"], f"{where}.sha256")):
        raise InputError(f"{where}.sha256: should be 64 hexadecimal digits")
    return Input(option, name, found["sha256"])


def with_origin(told: Provenance, origin: Origin) -> Provenance:
    """The provenance of a model with its origin, which tells its version, its logs and its seed."""
    logs = tuple(one.name for one in origin.inputs if one.option == "LOG")
    return told._replace(version=dict(origin.versions)["jaxident"], logs=logs, seed=origin.seed, origin=origin)


def beside(path: Target) -> pathlib.Path:
    """The file that tells the origin of an output."""
    place = pathlib.Path(path)
    return place.with_name(place.name + ENDING)


def check_beside(path: Target) -> None:
    """InputError unless `write_beside` can write."""
    if not _is_stream(path):
        check_target(beside(path))


def write_beside(path: Target, origin: Origin) -> pathlib.Path | None:
    """Write the origin of an output and its checksum into the file beside it, which is returned; a pipe or a device has
    none."""
    if _is_stream(path):
        return None
    told = {"schema": SCHEMA, "file": {"name": pathlib.Path(path).name, "sha256": checksum(path)}}
    write_text(beside(path), format_json(told | {"provenance": origin_to_dict(origin)}))
    return beside(path)


def _is_stream(path: Target) -> bool:
    return os.path.exists(path) and not os.path.isfile(path)


def read_origin(path: Source) -> tuple[pathlib.Path, Origin]:
    """An output, and its origin, which stands in it or beside it; the file beside may be given in its place.

    InputError where it has none, or where the output is no longer the one that the file beside tells of."""
    place = pathlib.Path(path)
    if place.name.endswith(ENDING):
        place = place.with_name(place.name.removesuffix(ENDING))
    if beside(place).is_file():
        return place, _read_beside(place)
    if not place.exists():
        raise InputError(f"{place}: no such file")
    if place.suffix != ".json":
        raise InputError(f"{place}: no file {beside(place).name} beside it tells how it was made")
    content = read_json(place)
    told = content.get("provenance") if isinstance(content, dict) else None
    if told is None:
        raise InputError(f"{place}: has no key 'provenance'; it was written by an older version, or not by a command")
    return place, origin_from_dict(told, f"{place}: provenance")


def _read_beside(place: pathlib.Path) -> Origin:
    name = os.fspath(beside(place))
    found = take_keys(read_json(name), name, ("schema", "file", "provenance"))
    if found["schema"] != SCHEMA:
        raise InputError(f"{name}: schema: is {found['schema']!r}; this program reads {SCHEMA!r}")
    if checksum(place) != take_keys(found["file"], f"{name}: file", ("name", "sha256"))["sha256"]:
        raise InputError(f"{place}: is missing, or has changed since {name} told of it; make it again")
    return origin_from_dict(found["provenance"], f"{name}: provenance")


def find_input(one: Input, folders: Sequence[Source]) -> str:
    """The path of the file or folder with the name and content of an input in one of the folders; InputError where none
    has that name, or none that content."""
    if one.sha256 is None:
        raise InputError(f"{one.name} ({one.option}): was read from a pipe, which is gone; give a file instead")
    there = [path for folder in folders if (path := os.path.join(folder, one.name)) and os.path.exists(path)]
    same = next((path for path in there if checksum(path) == one.sha256), None)
    if same is not None:
        return same
    if there:
        raise InputError(f"{there[0]} ({one.option}): has changed: its SHA-256 is {checksum(there[0])}, it was "
                         f"{one.sha256}; --data FOLDER says where the unchanged one lies")  # fmt: skip
    raise InputError(f"{one.name} ({one.option}): no such file in {', '.join(map(str, folders))}; --data FOLDER says "
                     "where it now lies")  # fmt: skip

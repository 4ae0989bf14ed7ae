"""The topics of a bag: which there are, which look right, and the one that was asked for."""

import contextlib
import os
import pathlib
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from jaxident.errors import InputError
from jaxident.files.bag_transforms import STATIC
from jaxident.files.messages import COMMANDS, POSES, TRANSFORMS, WHEEL_SPEEDS

UNREADABLE = "is no bag that can be read"


READERS = {"commands": COMMANDS, "poses": POSES, "wheel speeds": WHEEL_SPEEDS}
OPTIONS = {"commands": "--command-topic", "poses": "--pose-topic"}
"""What a topic may be asked for, with the readers of its messages and the option that names it."""


class Topic(NamedTuple):
    """A topic of a bag: messages, their mean rate [1/s] (NaN below two), and what it could be: "commands", "poses" or
    "" for a type that has no reader."""

    name: str
    type: str
    messages: int
    rate: float
    suits: str


def list_topics(path: str | os.PathLike) -> list[Topic]:
    """The topics of a bag, by name. InputError for what is no bag."""
    with open_bag(path) as reader:
        return topics_of(reader)


@contextlib.contextmanager
def open_bag(path: str | os.PathLike) -> Iterator[Any]:
    """A reader of the bag; whatever goes wrong in it is one InputError that names the bag."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise InputError("bags are read by rosbags, which is not installed: pip install 'jaxident[ros]'") from None
    if not os.path.exists(path):
        raise InputError(f"{path}: no such file or folder")
    try:
        with AnyReader([pathlib.Path(path)], default_typestore=get_typestore(Stores.LATEST)) as reader:
            yield reader
    except (InputError, GeneratorExit):
        raise
    except Exception as error:  # a damaged bag fails in the reader, in YAML, in SQLite, in a decompressor ...
        told = " ".join(str(error).split()) or type(error).__name__
        again = "record or copy it again, or try `ros2 bag reindex`"
        mend = "decrypt it with the program that wrote it" if "encrypt" in told else again
        raise InputError(f"{path}: {UNREADABLE} ({told[:200]}); {mend}") from error


def topics_of(reader: Any) -> list[Topic]:
    """The topics of an open bag, by name."""
    spans = [(max(one.end_time - one.start_time, 0)) / 1e9 for one in reader.readers if one.message_count]
    length = max(spans, default=0.0)
    found = []
    for name, info in sorted(reader.topics.items()):
        kind = info.msgtype or "several types"
        suits = "commands" if kind in COMMANDS else "poses" if kind in POSES else ""
        rate = (info.msgcount - 1) / length if info.msgcount > 1 and length > 0.0 else np.nan
        found.append(Topic(name, kind, info.msgcount, rate, suits))
    return found


def choose_topic(path: Any, topics: list[Topic], wanted: str | None, what: str) -> tuple[Topic, tuple[str, ...]]:
    """The topic of that name, or the only one with messages that looks right, which is then told."""
    there = ", ".join(f"{topic.name} ({topic.type})" for topic in topics) or "none at all"
    if wanted is not None:
        found = next((topic for topic in topics if topic.name == wanted), None)
        if found is None:
            raise InputError(f"{path}: no topic {wanted!r}; there are {there}")
        readers = READERS[what]
        if found.type not in readers:
            raise InputError(f"{path}: {wanted} has the type {found.type}, of which no {what} are read; "
                             f"readable are {', '.join(readers)}")  # fmt: skip
        if not found.messages:
            raise InputError(f"{path}: {wanted} has no messages; topics are {there}")
        return found, ()
    fitting = [topic for topic in topics if topic.suits == what and topic.messages]
    option = OPTIONS[what]
    if len(fitting) != 1:
        listed = ", ".join(topic.name for topic in fitting) or "none"
        raise InputError(f"{path}: {option} is needed; topics that could be {what}: {listed}; there are {there}")
    return fitting[0], (f"{option} {fitting[0].name}: the only one that could be {what}",)


def transform_topics(path: Any, topics: list[Topic], wanted: str | None) -> list[str]:
    """Names of the topics that hold transforms: those that are wanted and the static ones; InputError for none."""
    there = [topic.name for topic in topics if topic.type in TRANSFORMS and topic.messages]
    chosen = [name for name in there if wanted in (None, name) or name.endswith(STATIC)]
    if not there or (wanted is not None and wanted not in there):
        listed = ", ".join(f"{topic.name} ({topic.type})" for topic in topics) or "none at all"
        told = "no topic holds transforms" if wanted is None else f"{wanted} holds no transforms"
        raise InputError(f"{path}: {told}; there are {listed}")
    return chosen

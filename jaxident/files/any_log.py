"""Whatever may stand for a log, as a log: a path, a folder, a data frame, a dict of arrays, or a list of these."""

import os
from collections.abc import Iterable
from typing import Any

from jaxident.errors import InputError
from jaxident.files.logs import read_logs
from jaxident.log import Log, from_frame, join

KINDS = "a Log, a path, a folder, a data frame, a dict of arrays, or a list of these"


def as_logs(given: Any) -> list[Log]:
    """The logs that were given, in their order. InputError where something else was."""
    if isinstance(given, Log):
        return [given]
    if isinstance(given, str | os.PathLike):
        return read_logs(given)
    if hasattr(given, "keys") and hasattr(given, "__getitem__"):  # a dict and any library's data frame
        return [from_frame(given)]
    if isinstance(given, Iterable):
        given = list(given)
        if given and all(isinstance(one, str | os.PathLike) for one in given):
            return read_logs(given)
        logs = [log for one in given for log in as_logs(one)]
        if logs:
            return logs
        raise InputError(f"logs: none was given; it should be {KINDS}")
    raise InputError(f"logs: a {type(given).__name__} was given; it should be {KINDS}")


def as_log(given: Any) -> Log:
    """What was given as one log: a `Log` as it is, several joined."""
    return given if isinstance(given, Log) else join(as_logs(given))

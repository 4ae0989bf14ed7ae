"""The program run inside this process, as `python -m jaxident` runs it: a hundred runs cost what one process costs."""

import io
import os
import warnings
from typing import NamedTuple
from unittest import mock

from jaxident.cli import main


class Ended(NamedTuple):
    """Exit code, and what was printed."""

    code: int
    out: str
    err: str


def jaxident(*words, cwd) -> Ended:
    """Run a command in a folder; words are texts, or bytes where a file's name is no text."""
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True) for _ in range(2))
    words = [os.fsdecode(word) for word in words]
    before = os.getcwd()
    os.chdir(cwd)
    try:
        with (
            mock.patch("sys.argv", ["jaxident", *words]),
            mock.patch("sys.stdout", out),
            mock.patch("sys.stderr", err),
            warnings.catch_warnings(),
        ):
            warnings.simplefilter("default")
            code = _exit_code()
    finally:
        os.chdir(before)
    return Ended(code, *(stream.buffer.getvalue().decode() for stream in (out, err)))


def _exit_code() -> int:
    try:
        main.run()
    except SystemExit as ended:
        return int(ended.code or 0)
    raise AssertionError("the program did not end")

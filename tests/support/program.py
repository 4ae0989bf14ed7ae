"""The program run inside this process, as `python -m jaxident` runs it: a hundred runs cost what one process costs."""

import io
import os
import warnings
from typing import NamedTuple
from unittest import mock

from jaxident.cli import main


class Ended(NamedTuple):
    """Exit code, and what was printed."""

    returncode: int
    stdout: str
    stderr: str


def jaxident(*words, cwd=".") -> Ended:
    """Run a command in a folder; words are bytes where a file's name is no text."""
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True) for _ in range(2))
    words = [os.fsdecode(word) if isinstance(word, bytes) else str(word) for word in words]
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


def refused(result, *words):
    """Exit code 2 and one line on stderr that holds the words."""
    assert result.returncode == 2, result
    assert result.stdout == ""
    assert len(result.stderr.splitlines()) == 1, result.stderr
    for word in words:
        assert word in result.stderr

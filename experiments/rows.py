"""Rows of an experiment as a file."""

import csv
import io
import pathlib
from collections.abc import Iterable, Sequence

from jaxident.files.atomic import write_text


def write_rows(path: pathlib.Path, rows: Iterable[Sequence[str]]) -> None:
    """A CSV file, whole or not at all; the first row is its header."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    write_text(path, text.getvalue())

"""Tables of numbers in CSV: what logs and streams have in common.

Blocks of lines go through NumPy's C parser. Whatever it refuses is read again line by line, which either succeeds
(quoted cells, text in a column that nobody asked for) or names the line and the column at fault.
"""

import contextlib
import csv
import gzip
import io
import math
import os
import re
import stat
import sys
import warnings
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, TextIO

import numpy as np

from jaxident.columns import QUATERNION, Column, Columns, heading_of, iso_seconds, rename, split_heading
from jaxident.errors import InputError
from jaxident.files.source import Source, explained

BLOCK_BYTES = 1 << 23
LONGEST_HEADER = 1 << 16
LONGEST_LINE = 1 << 20
"""Characters of a line; a row of a log has some hundreds."""
MOST_LINES = 20_000_000
"""Lines of a file, the blank ones too: more than two days at 100 Hz."""
LARGEST_RATIO, SMALL_TEXT = 100, 1 << 26
"""A gzipped table unpacks to at most this many times its size, or to this many bytes. Numbers shrink to a tenth; what
shrinks to less than a hundredth was packed to fill the memory of who unpacks it."""
GZIP_MAGIC = b"\x1f\x8b"
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)

Layout = tuple[str, ...]


class Table(NamedTuple):
    """Columns of a CSV file by name, each (rows,) float64, NaN where a cell is empty; line (rows,) in the file."""

    name: str
    columns: dict[str, np.ndarray]
    line: np.ndarray

    def place(self, row: int) -> str:
        """Where a row stands, for an error line."""
        return f"{self.name}, line {self.line[row]}"


def read_table(path: Source, layouts: Sequence[Layout], optional: Layout = (), columns: Columns | None = None) -> Table:
    """The columns of the one layout that the file's header holds, and the optional ones that it has.

    UTF-8, with or without byte-order mark, plain or gzipped (told by content), any line ends, columns in any order,
    blank lines ignored; "-" is the standard input. Cells are finite decimal numbers or empty. Further columns are
    ignored with a UserWarning. InputError names the line and the column at fault.

    columns: those that have other names or units in the file. Four columns qx,qy,qz,qw stand for a theta that is not
    there. Semicolons or tabs may part the cells, decimal commas beside them; t may be an ISO date (then Unix time).
    """
    name = "standard input" if os.fspath(path) == "-" else os.fspath(path)
    with explained(name, "CSV"), _open_text(path) as (stream, most):
        header, lines_read, separator = _read_header(stream, name, layouts)
        columns, change = split_heading(header, columns or {})
        header = rename(header, columns, f"{name}, line {lines_read}")
        layouts = [_with_quaternion(layout, header) for layout in layouts]
        wanted = _choose(header, f"{name}, line {lines_read}", layouts, optional)
        ignored = [column for column in header if column not in wanted]
        if ignored:
            warnings.warn(f"{name}: columns ignored: {', '.join(map(repr, ignored))}", stacklevel=2)
        values, line = [np.empty((0, len(wanted)))], [np.empty(0, int)]
        for block in _blocks(stream, name, most):
            lines = [_with_commas(text, separator) for text in block]
            filled = np.array([k for k, text in enumerate(lines) if not text.isspace()], int)
            number = lines_read + 1 + filled
            values.append(_read_block([lines[k] for k in filled], header, wanted, name, number))
            line.append(number)
            lines_read += len(lines)
    found = dict(zip(wanted, np.concatenate(values).T.copy(), strict=True))
    return Table(name, _in_si(found, columns, change), np.concatenate(line))


def _in_si(found: dict[str, np.ndarray], columns: Columns, change: Column | None) -> dict[str, np.ndarray]:
    """The columns in SI, a quaternion as the heading that it stands for."""
    found = {name: columns[name].convert(values) if name in columns else values for name, values in found.items()}
    if QUATERNION[0] in found:
        found["theta"] = heading_of(*(found.pop(name) for name in QUATERNION))
        found["theta"] = change.convert(found["theta"]) if change else found["theta"]
    return found


def _with_quaternion(layout: Layout, header: list[str]) -> Layout:
    """The layout with a quaternion in place of a theta that the header lacks."""
    if "theta" not in layout or "theta" in header or not set(QUATERNION) <= set(header):
        return layout
    return (*(name for name in layout if name != "theta"), *QUATERNION)


def _with_commas(line: str, separator: str) -> str:
    """A line whose cells commas part; where another sign parted them, commas in it were decimal points."""
    return line if separator == "," else line.replace(",", ".").replace(separator, ",")


def _blocks(stream: TextIO, name: str, most: float) -> Iterator[list[str]]:
    """The lines that are left, some megabytes at a time, each with its line feed but perhaps the last; InputError for
    more than `most` characters or MOST_LINES lines."""
    rest, read, lines = "", 0, 0
    while text := stream.read(BLOCK_BYTES):
        read, lines = read + len(text), lines + text.count("\n")
        if read > most:
            raise InputError(f"{name}: unpacks to more than {LARGEST_RATIO} times its size; no log does, so it is "
                             "refused before it fills the memory")  # fmt: skip
        if lines > MOST_LINES:
            raise InputError(f"{name}: has more than {MOST_LINES} lines; cut it into several logs")
        whole, feed, rest = (rest + text).rpartition("\n")
        if len(rest) > LONGEST_LINE:
            raise InputError(f"{name}: has a line of more than {LONGEST_LINE} characters; is it CSV?")
        if feed:
            yield [line + feed for line in whole.split(feed)]
    if rest:
        yield [rest]


def _read_block(lines: list[str], header: list[str], wanted: Layout, name: str, number: np.ndarray) -> np.ndarray:
    """Values (lines, wanted columns) of the filled lines of a block."""
    chosen = [header.index(column) for column in wanted]
    values = _parse_fast("".join(lines), len(header)) if lines else np.empty((0, len(header)))
    if values is not None and len(values) == len(lines):
        return values[:, chosen]
    return np.array([_parse_line(*row, header, wanted, name) for row in zip(lines, number, strict=True)])


def _parse_fast(text: str, width: int) -> np.ndarray | None:
    """The block's values, or None where anything in it needs a closer look."""
    lowered = text.lower()
    if "nan" in lowered or "inf" in lowered:
        return None
    text = f"\n{text}\n".replace(",,", ",nan,").replace(",,", ",nan,").replace(",\n", ",nan\n").replace("\n,", "\nnan,")
    try:
        values = np.loadtxt(io.StringIO(text), delimiter=",", comments=None, ndmin=2)
    except ValueError:
        return None
    return values if values.shape[1] == width and not np.isinf(values).any() else None


def _parse_line(line: str, number: int, header: list[str], wanted: Layout, name: str) -> list[float]:
    place = f"{name}, line {number}"
    try:
        cells = _split(line)
    except csv.Error as error:
        raise InputError(f"{place}: {error}") from error
    if len(cells) != len(header):
        raise InputError(
            f"{place}: {len(cells)} cells, the header has {len(header)} columns ({_shortened(','.join(header))})"
        )
    return [_parse_cell(cells[header.index(column)], column, place) for column in wanted]


def _parse_cell(cell: str, column: str, place: str) -> float:
    if not cell:
        return np.nan
    if column == "t" and (stamp := iso_seconds(cell)) is not None:
        return stamp
    if not _NUMBER.fullmatch(cell):
        raise InputError(f"{place}, column {column}: {_quoted(cell)} is not a finite decimal number")
    value = float(cell)
    if np.isinf(value):
        raise InputError(f"{place}, column {column}: {_quoted(cell)} is beyond double precision")
    return value


def _split(line: str) -> list[str]:
    """The cells of one line, without the blanks around them."""
    return [cell.strip() for cell in next(csv.reader([line.strip()], skipinitialspace=True), [])]


def _shortened(text: str, longest: int = 40) -> str:
    return text if len(text) <= longest else text[:longest] + "..."


def _quoted(text: str) -> str:
    return repr(_shortened(text))


def _read_header(stream: TextIO, name: str, layouts: Sequence[Layout]) -> tuple[list[str], int, str]:
    """The first line that is not blank, cut into its names, its number, and the sign that parts its cells."""
    expected = " or ".join(map(",".join, layouts))
    for number, line in enumerate(iter(lambda: stream.readline(LONGEST_HEADER), ""), 1):
        if "\0" in line or "\ufffd" in line or len(line) == LONGEST_HEADER:
            raise InputError(f"{name}: is not a text file in UTF-8; it should be CSV with the header {expected}")
        if not line.isspace():
            separator = max(",;\t", key=line.count)  # a comma where none is there
            return _split(_with_commas(line, separator)), number, separator
    raise InputError(f"{name}: is empty; it should begin with the header {expected}")


def _choose(header: list[str], place: str, layouts: Sequence[Layout], optional: Layout) -> Layout:
    """The columns to read: the one layout that the header holds, and the optional ones."""
    expected = " or ".join(map(",".join, layouts))
    fitting = [layout for layout in layouts if set(layout) <= set(header)]
    if not fitting:
        missing = min(([c for c in layout if c not in header] for layout in layouts), key=len)
        found = _quoted(",".join(header))
        raise InputError(f"{place}: no column {missing[0]} in the header {found}; it should be {expected}")
    if len(fitting) > 1:
        raise InputError(f"{place}: the header holds {' and '.join(map(','.join, fitting))}; keep one of them")
    wanted = fitting[0] + tuple(column for column in optional if column in header)
    for column in wanted:
        if header.count(column) > 1:
            raise InputError(f"{place}: column {column} appears {header.count(column)} times; keep one")
    return wanted


@contextlib.contextmanager
def _open_text(path: Source) -> Iterator[tuple[TextIO, float]]:
    """Lines with plain line feeds, bytes that are not UTF-8 as U+FFFD, so that their cell can be named; and how many
    characters they may have together."""
    with contextlib.ExitStack() as stack:
        raw: Any = sys.stdin.buffer
        if os.fspath(path) != "-":
            raw = stack.enter_context(open(path, "rb", buffering=0))
        buffered = io.BufferedReader(raw)
        stack.callback(buffered.detach)
        packed = buffered.peek(2)[:2] == GZIP_MAGIC
        content: Any = stack.enter_context(gzip.GzipFile(fileobj=buffered, mode="rb")) if packed else buffered
        text = io.TextIOWrapper(content, encoding="utf-8-sig", errors="replace")
        stack.callback(text.detach)
        yield text, _most(raw) if packed else math.inf


def _most(raw: Any) -> float:
    """Characters that a gzipped file may unpack to; of a pipe nobody knows the size."""
    try:
        status = os.fstat(raw.fileno())
    except OSError:  # a stream that is no file
        return math.inf
    return max(LARGEST_RATIO * status.st_size, SMALL_TEXT) if stat.S_ISREG(status.st_mode) else math.inf

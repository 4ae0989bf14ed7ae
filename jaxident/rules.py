"""Rules that the rows of a table keep, and the one error line for the first row that does not."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from jaxident.array_types import Pose
from jaxident.errors import InputError


class Rule(NamedTuple):
    """A rule of one column: the rows (rows,) that break it, and what would be right."""

    column: str
    broken: np.ndarray
    right: str


def enforce(rules: Iterable[Rule], columns: Mapping[str, np.ndarray], place: Callable[[int], str]) -> None:
    """InputError for the first row that breaks the first broken rule; `place` names a row."""
    for rule in rules:
        rows = np.flatnonzero(rule.broken)
        if rows.size:
            cell = columns[rule.column][rows[0]]
            found = "empty" if np.isnan(cell) else f"{float(cell):.10g}"
            raise InputError(f"{place(rows[0])}, column {rule.column}: is {found}; {rule.right}")


def rising_time(t: np.ndarray, first: np.ndarray) -> Iterator[Rule]:
    """Every row has a time t (rows,), later than that of the row before except where a run begins: `first` (rows,)."""
    yield Rule("t", ~np.isfinite(t), "every row needs a time")
    yield Rule("t", ~first & (np.diff(t, prepend=t[:1]) <= 0.0), "time must rise from each row to the next")


def ordered_time(t: np.ndarray) -> Iterator[Rule]:
    """Every row has a time t (rows,), not earlier than that of the row before."""
    yield Rule("t", ~np.isfinite(t), "every row needs a time")
    yield Rule("t", np.diff(t, prepend=t[:1]) < 0.0, "time must not go back from one row to the next")


def pose_rules(pose: Pose) -> Iterator[Rule]:
    """All three of a pose's columns (rows,) are finite or, where nothing was measured, NaN."""
    blind = np.isnan(np.stack(pose)).all(axis=0)
    for name, column in pose._asdict().items():
        yield Rule(name, ~np.isfinite(column) & ~blind, "a pose has three cells, or none where nothing was measured")

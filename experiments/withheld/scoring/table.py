"""From marks of cases to the table: every row with its count and a 95 % interval."""

from typing import Any

import numpy as np

from .intervals import bootstrap, wilson
from .rows import ROWS, Row


def table(marks: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """All rows for one method. marks: `marks.mark` of each case, with `strength`, `inputs`, `seconds`, `claims`, and
    where there is one `shrink` (`fresh.true_shrink`'s shrink), `interval` (the diagnosis's own, 90 %), `shares` and
    `promise` (`judge.added`)."""
    return [measured(row, marks) for row in ROWS]


def measured(row: Row, marks: list[dict]) -> dict[str, Any]:
    """One row; a value of null where no case bears on it."""
    values = features(row, [m for m in marks if row.bears(m)])
    told: dict[str, Any] = {"row": row.label, "value": None, "interval": None, "cases": len(values), "goal": row.goal}
    if not len(values):
        return told
    drawn = wilson(round(float(values.sum())), len(values)) if row.counted else bootstrap(values, row.statistic)
    return told | {"value": float(row.statistic(values)), "interval": list(drawn)}


def features(row: Row, marks: list[dict]) -> np.ndarray:
    """What counts of each case (cases, ...)."""
    return np.array([row.feature(m) for m in marks], float)

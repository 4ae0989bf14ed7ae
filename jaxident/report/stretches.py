"""Stretches of the logs on a diagnosis's page: the worst ones as small multiples, and which run served what."""

from typing import Any

import numpy as np

from jaxident import plot
from jaxident.array_types import Array
from jaxident.diagnosis.diagnose import Diagnosis
from jaxident.log import run_begins
from jaxident.plot.motion import COLUMNS
from jaxident.report.page import Figure, Section, Table
from jaxident.report.words import length

SHOWN = 6
"""Stretches in the picture."""


def worst_stretches(found: Diagnosis) -> list[Section]:
    """Where the nominal model errs most: the measured path and the predicted ones. No section where no stretch was left
    to judge by."""
    worst = worst_starts(found)
    if not len(worst):
        return []
    lines, columns = -(-len(worst) // COLUMNS), min(COLUMNS, len(worst))
    figure, axes = plot.figure(lines, columns, size=(6.3, 0.6 + 2.2 * lines))
    draw_stretches(found, worst, axes)
    picture = Figure(plot.image(figure), "Measured and predicted paths", PICTURE)
    return [Section("The worst stretches", [TEXT.format(horizon=found.gap.horizon), picture])]


def worst_starts(found: Diagnosis) -> np.ndarray:
    """Numbers of the judging starts from which the nominal model errs most, worst first; SHOWN at most."""
    errors = np.asarray(found.gap.errors)[[1, -1]]
    known = np.flatnonzero(np.isfinite(errors).all(axis=(0, 2)))
    return known[np.argsort(-errors[0, known].sum(axis=1))][:SHOWN]


def draw_stretches(found: Diagnosis, numbers: Array, axes: Any = None) -> Any:
    """Some judging stretches as small multiples; returns the axes."""
    log, starts, errors = found.prepared.log, found.prepared.judging, np.asarray(found.gap.errors)
    models = {"nominal model": errors[1]}
    nominal, corrected = found.gap.paths
    if not np.array_equal(nominal, corrected, equal_nan=True):
        models["corrected model"] = errors[-1]
    begins = (run_begins(log)[starts.run] + starts.row)[numbers]
    rows = begins[:, None] + np.arange(1, 1 + found.prepared.rows)
    measured = np.stack([np.asarray(log.x)[rows], np.asarray(log.y)[rows]], axis=-1)
    paths = dict(zip(models, found.gap.paths[:, numbers, :, :2], strict=False))
    titles = [_title(found, k, float(log.t[row]), models) for k, row in zip(numbers, begins, strict=True)]
    return plot.stretches(measured, paths, titles=titles, axes=axes)


TEXT = (
    "On these stretches the nominal model errs most. They took no part in any fit. Up to the beginning of a stretch a "
    "prediction knows what the camera saw, then for {horizon:.3g} s the commands alone."
)
PICTURE = (
    "Each path begins at (0, 0); a dot marks where a prediction ends. The numbers above say how far that is from the "
    "measured position. Camera noise is in them."
)


def _title(found: Diagnosis, number: int, begin: float, models: dict[str, Array]) -> str:
    """Run and time of a stretch, and how far each model ends from the measured position."""
    own = [length(np.sqrt(np.sum((errors[number] * found.gap.unit)[:2]))) for errors in models.values()]
    return f"run {found.prepared.judging.run[number] + 1}, {begin:,.1f} s\n{', corrected '.join(own)}"


def served(found: Diagnosis) -> Section:
    """Which run served what: naming and fitting, or judging alone."""
    naming, judging = found.prepared.naming.run, found.prepared.judging.run
    rows = [
        (k + 1, len(run.t), float(run.t[-1] - run.t[0]), _stretches(naming == k), _stretches(judging == k))
        for k, run in enumerate(found.prepared.log.runs())
    ]
    table = Table(("run", "rows", "seconds", "fits and names", "judges"), rows, f"{SERVED} {left_out(found)}".strip())
    return Section("Which run served what", [table], folded=True)


def left_out(found: Diagnosis) -> str:
    """How much of a long log was used, in a sentence; nothing where that is all of it."""
    if found.prepared.whole:
        return ""
    rows, (fit, judge) = len(found.prepared.log.t), found.prepared.served
    return f"Of {rows:,} rows {fit:,} fit and {judge:,} judge: those whose commands tell most."


SERVED = (
    "Stretches of one horizon each. Those that judge took no part in any fit. They choose no effect; they may refuse "
    "one."
)


def _stretches(those: Array) -> str:
    return str(count) if (count := int(np.sum(those))) else "–"

"""One trial of a study, as a table and as a picture."""

from typing import Any

import numpy as np

from jaxident import plot
from jaxident.array_types import Increment
from jaxident.plot.names import plain
from jaxident.robot.model import DIFFERENCE_ORDER
from jaxident.robot.path_length import path_length
from jaxident.study.dataset import coordinates
from jaxident.study.design import Study
from jaxident.study.sight import REASONS
from jaxident.study.trial import Outcome, Recording

SHOWN_ROWS = 300
"""Of a run, whose commands and increments are drawn."""


def trial_rows(study: Study, number: int, outcome: Outcome) -> list[tuple[str, ...]]:
    """A trial as rows of text: the truth and every estimate with its standard deviation, then how each one ended."""
    head = ("parameter", "true", *(word for one in study.estimators for word in (one.name, "sd")))
    rows = [head]
    for k, name in enumerate(DIFFERENCE_ORDER):
        pairs = [(outcome.estimate[e, k], outcome.deviation[e, k]) for e in range(len(study.estimators))]
        rows.append((name, *(f"{value:.5g}" for value in (outcome.truth[k], *(v for pair in pairs for v in pair)))))
    endings = [word for code in outcome.reason for word in (REASONS[int(code)], "")]
    return [*rows, ("ended", "", *endings)]


def draw_trial(study: Study, number: int, recording: Recording, outcome: Outcome) -> Any:
    """A figure of one trial: path, commands and increments of the first rows of its first run, errors of its
    estimates."""
    exact, measured = (recording.log(exact).runs()[0] for exact in (True, False))
    figure, axes = plot.figure(4, 1, size=(6.9, 10.5), heights=(2.2, 1.0, 1.0, 1.4))
    plot.path(measured, ax=axes[0])
    axes[0].plot(exact.x, exact.y, color="black", linewidth=0.6, linestyle="--")
    plot.commands(measured.rows(0, SHOWN_ROWS), ax=axes[1], dead_zone=np.asarray(recording.robot.dead_zone))
    seen, true = (Increment(*(np.asarray(c)[:SHOWN_ROWS] for c in path_length(log.pose))) for log in (measured, exact))
    plot.increments(exact.t[1 : len(seen.turn) + 1], seen, true, ax=axes[2], channel="turn")
    axes[2].lines[1].set_label("without noise")
    plot.legend_above(axes[2])
    pairs = zip(outcome.estimate, outcome.deviation, strict=True)
    found = {plain(choice.name): pair for choice, pair in zip(study.estimators, pairs, strict=True)}
    plot.estimate_errors(found, truth=outcome.truth, names=DIFFERENCE_ORDER, ax=axes[3])
    figure.suptitle(plain(_title(study, number)), x=0.01, ha="left", fontsize=9)
    return figure


def _title(study: Study, number: int) -> str:
    index, entries = np.unravel_index(number, study.shape), coordinates(study)
    at = {axis: entries[axis].values[k] for axis, k in zip(study.axes, index, strict=True)}
    rows = f"{at['samples']} rows" + (f", first of {study.runs} runs" if study.runs > 1 else "")
    effect = f"effects {at['effect']}, " if "effect" in at else ""
    return (
        f"trial {number}: {at['excitation']}, {rows}, {at['robot']}, {at['period']:.4g} s, "
        f"amplitude {at['amplitude']:g},\n{effect}camera noise {1e3 * at['noise']:.4g} mm, seed {at['seed']}"
    )

"""The pictures and the page of `jaxident reproduce`."""

import os
from importlib.metadata import version

import numpy as np

from jaxident import plot
from jaxident.array_types import Increment
from jaxident.files.atomic import write_bytes
from jaxident.plot.names import DIMENSIONLESS, written
from jaxident.report.glossary import glossary
from jaxident.report.page import PHONE, Figure, Page, Section, Table, write_page
from jaxident.robot.model import DIFFERENCE_ORDER, difference_vector
from jaxident.robot.path_length import path_length
from jaxident.study.reproduction import ESTIMATORS, TABLE_NOISE, Reproduction, Row, count_closer, table_rows

SHOWN_AGAINST_NOISE = ("alpha_1", "alpha_2", "delta_21", "dead_zone_r")
SHOWN_SAMPLES = slice(0, 300)


def write_reproduction(result: Reproduction, folder: str) -> list[str]:
    """Write all pictures and index.html into the folder; returns their paths."""
    figures = _figures(result)
    paths = []
    for name, figure in figures.items():
        path = os.path.join(folder, f"{name}.png")
        write_bytes(path, figure.png)
        paths.append(path)
    page = os.path.join(folder, "index.html")
    write_page(_page(result, table_rows(result), figures), page)
    return [*paths, page]


def _figures(result: Reproduction) -> dict[str, Figure]:
    """Every picture of the page by its file name."""
    figures = {
        "errors": _errors(table_rows(result)),
        "figure_4": _figure_4(result),
        "figure_7": _figure_7(result),
        "figure_8": _increments(result, "length", "8"),
        "figure_9": _increments(result, "turn", "9"),
        "convergence": _convergence(result),
        "path": _path(result),
    }
    for name in SHOWN_AGAINST_NOISE:
        figures[f"noise_{name}"] = _against_noise(result, name)
    for drift in result.drifts:
        figures[f"drift_{drift.name}"] = _drift(drift)
    return figures


def _errors(rows: list[Row]) -> Figure:
    """How far the paper's numbers and ours lie from the truth."""
    figure, ax = plot.figure(size=(PHONE, 3.6))
    errors = {
        "the paper's": [row.paper / row.true - 1.0 for row in rows],
        "ours": [row.ours / row.true - 1.0 for row in rows],
    }
    plot.error_sizes(errors, names=[row.parameter for row in rows], ax=ax)
    return _done(figure, "Errors of the paper's numbers and of ours", "Size of the error without camera noise, in per "
                 "cent of the true number. Further left is better.")  # fmt: skip


def _figure_4(result: Reproduction) -> Figure:
    figure, ax = plot.figure(size=(4.5, 3.2))
    plot.dead_zone(np.asarray(result.robot.dead_zone), ax=ax, label=["right wheel", "left wheel"])
    return _done(figure, "Dead zones", "Figure 4 of the paper: what passes the dead zone at each wheel's input.")


def _figure_7(result: Reproduction) -> Figure:
    figure, ax = plot.figure(size=(6.3, 3.0))
    shown = result.log.rows(SHOWN_SAMPLES.start, SHOWN_SAMPLES.stop)
    plot.commands(shown, ax=ax, dead_zone=np.asarray(result.robot.dead_zone))
    return _done(figure, "Input", "Figure 7: the input, a staircase with levels inside and outside the dead zones.")


def _increments(result: Reproduction, channel: str, number: str) -> Figure:
    """Figure 8 or 9: measured increments against the free run of the identified model."""
    measured = Increment(*(np.asarray(c)[SHOWN_SAMPLES] for c in path_length(result.log.pose)))
    modelled = Increment(*(np.asarray(c)[SHOWN_SAMPLES] for c in path_length(result.modelled.pose)))
    figure, (ax, residual_ax) = plot.figure(2, 1, heights=(3, 1), share_x=True, size=(6.3, 3.6))
    time = np.asarray(result.log.t)[1:][SHOWN_SAMPLES]
    plot.increments(time, measured, modelled, ax=ax, residual_ax=residual_ax, channel=channel)
    word = {"length": "path length", "turn": "turn"}[channel]
    return _done(
        figure,
        f"Measured and modelled {word}",
        f"Figure {number}: the {word} of each sample, measured and as "
        "the identified model runs on its own, without noise.",
    )


def _convergence(result: Reproduction) -> Figure:
    history, log = result.found.history, result.log
    late = np.asarray(log.t)[-len(history.parameters) :]
    figure, axes = plot.figure(6, 2, size=(6.9, 9.5), share_x=True)
    plot.convergence(
        late,
        history.parameters,
        history.standard_deviation,
        names=DIFFERENCE_ORDER,
        truth=_truth(result),
        axes=axes,
    )
    return _done(
        figure,
        "Parameter convergence",
        "The recursion after the setup time: estimates with 95 % bands, and the "
        "simplified robot's values as dashed lines.",
    )


def _path(result: Reproduction) -> Figure:
    figure, ax = plot.figure(size=(5.2, 4.6))
    plot.path(result.log, result.prediction, ax=ax)
    return _done(
        figure,
        "Path and predictions",
        "The path of the robot with free runs of the identified model over two "
        "seconds each, started from what came before.",
    )


def _against_noise(result: Reproduction, name: str) -> Figure:
    column = DIFFERENCE_ORDER.index(name)
    study = result.noise
    found, ok = np.asarray(study.estimates)[..., column], np.asarray(study.ok)
    estimates = {name: np.where(ok[:, :, k], found[:, :, k], np.nan) for k, name in enumerate(ESTIMATORS)}
    figure, ax = plot.figure(size=(PHONE, 3.4))
    plot.error_against_noise(study.levels, estimates, truth=_truth(result)[column], label=name, ax=ax)
    return _done(
        figure,
        f"Error of {name} against camera noise",
        f"Error of {name} against camera noise (10 mrad for each millimetre), {ok.shape[1]} seeds; "
        f"{np.count_nonzero(~ok)} of {ok.size} runs failed.",
    )


def _truth(result: Reproduction) -> np.ndarray:
    return np.asarray(difference_vector(result.reference.difference, result.reference.dead_zone))


def _drift(drift) -> Figure:
    figure, ax = plot.figure(size=(PHONE, 3.0))
    plot.tracking(drift.t, drift.truth, drift.estimate, drift.deviation, label=drift.name, ax=ax)
    return _done(
        figure, f"Tracking of {drift.name}", f"An ageing robot: {drift.name} and the recursion's estimate of it."
    )


def _done(figure, alt: str, caption: str) -> Figure:
    return Figure(plot.image(figure), alt, caption)


def _page(result: Reproduction, rows: list[Row], figures: dict[str, Figure]) -> Page:
    """The page: table first, then the paper's figures, then what noise and age do."""
    closer = count_closer(rows)
    lead = (
        f"Without noise, {closer} of {len(rows)} numbers lie closer to the truth than the paper's printed "
        "estimates; camera noise biases the method, as the curves below show."
    )
    cells = [_cells(row) for row in rows]
    table = Table(("parameter", "true", "the paper's", "ours", "standard error"), cells, TABLE_CAPTION)
    noise = [figures[f"noise_{name}"] for name in SHOWN_AGAINST_NOISE]
    return Page(
        "The paper's experiment, run again",
        lead,
        [
            Section("Twelve numbers", [table, WHY_NOT_ALL]),
            Section("The paper's figures", [figures[f"figure_{k}"] for k in (4, 7, 8, 9)]),
            Section("The recursion", [figures["convergence"], figures["path"]]),
            Section("What camera noise does", [NOISE_TEXT, *noise]),
            Section("A robot that ages", [figures[f"drift_{drift.name}"] for drift in result.drifts]),
            glossary("bias", "dead zone", "interval", "residual"),
        ],
        f"jaxident {version('jaxident')}",
        NEXT,
        figures["errors"],
    )


def _cells(row: Row) -> tuple[str, float, float, float, float]:
    """A row of the table in units that keep its numbers short."""
    how = written(row.parameter)
    name = row.parameter if how.unit == DIMENSIONLESS else f"{row.parameter} [{how.unit}]"
    true, paper, ours, deviation = (how.scale * value for value in row[1:])
    return name, true, paper, ours, float(f"{deviation:.2g}")


NEXT = (
    "`jaxident identify LOG` finds the model behind a log of your own; without one, `jaxident example --out logs` "
    "makes six."
)
TABLE_CAPTION = (
    "True: the paper's simplified robot. Ours: third-order robot without noise, batch on the setup time, then "
    f"recursive least squares. Standard error: of one run at {1e3 * TABLE_NOISE:g} mm of camera noise."
)
WHY_NOT_ALL = (
    "The data come from the paper's third-order robot, in which a little of each motion leaks into the other; the "
    "numbers are scored against its simplified form, which leaves that out. No second-order model of these data can "
    "reach all twelve."
)
NOISE_TEXT = (
    "Equation-error estimates regress a noisy increment on its own noisy past, so that their poles shrink towards zero "
    "as the camera's noise grows; no amount of data cures that. `jaxident identify --reading free-run` starts from a "
    "cost that does not regress on measurements and is far less biased."
)

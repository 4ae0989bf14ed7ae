"""One look for every picture: colours that colour-blind readers and grey printers tell apart, thin lines, 9 pt text.

The look belongs to the axes made here and to what the pictures draw; the user's own matplotlib settings stay as they
are, and so does the text of axes that the user passes in.
"""

from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.figure import Figure

# Okabe and Ito (2008).
BLUE, VERMILLION, GREEN, PURPLE, ORANGE = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00"
BLACK, GREY, PALE = "#000000", "#999999", "#DDDDDD"

RIGHT, LEFT = BLUE, ORANGE
MEASURED, MODELLED, PREDICTED, TRUE = GREY, BLUE, VERMILLION, BLACK
SERIES = tuple(zip((BLUE, VERMILLION, GREEN, PURPLE, ORANGE), "os^Dv", strict=True))
"""Colour and marker of one curve of several."""
MODELS = {
    "as given": SERIES[3],
    "nominal model": SERIES[0],
    "parameters refitted": SERIES[0],
    "corrected model": SERIES[1],
    "with named effects": SERIES[1],
    "with discovered laws": SERIES[2],
}
"""The same of the models of a diagnosis, alike in all its pictures."""

TEXT = 9.0
THIN, LINE = 0.6, 1.0
WIDTH = 6.3
"""Of a figure [inch]: the text width of an A4 page."""

HEAVY = 5000
"""Curves of more points are drawn as pixels inside vector files, which would otherwise hold every point."""

LEGEND: Any = {
    "frameon": False,
    "fontsize": TEXT,
    "borderaxespad": 0.2,
    "handlelength": 1.6,
    "columnspacing": 1.4,
}

STYLE: Any = {
    "font.size": TEXT,
    "axes.labelsize": TEXT,
    "axes.titlesize": TEXT,
    "axes.linewidth": THIN,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.facecolor": "white",
    "axes.edgecolor": BLACK,
    "axes.labelcolor": BLACK,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "axes.formatter.use_mathtext": True,
    "grid.color": PALE,
    "grid.linewidth": 0.5,
    "text.color": BLACK,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "pdf.fonttype": 42,
    "svg.hashsalt": "jaxident",
}


def figure(
    rows: int = 1,
    columns: int = 1,
    *,
    size: tuple[float, float] = (WIDTH, 3.0),
    heights: Sequence[float] | None = None,
    share_x: bool = False,
) -> tuple[Figure, Any]:
    """A figure for a file and its axes, as `matplotlib.pyplot.subplots` but off screen; size in inches.

    heights: relative heights of the rows. share_x: one time axis for all rows of a column.
    """
    with matplotlib.rc_context(STYLE):
        made = Figure(figsize=size, layout="constrained")
        axes = made.subplots(rows, columns, height_ratios=heights, sharex="col" if share_x else False)
    for ax in np.ravel(axes):
        _dress(ax)
    return made, axes


def axes_or_new(ax: Axes | None, size: tuple[float, float] = (WIDTH, 3.0)) -> Axes:
    """The axes given, or new ones that pyplot shows."""
    return ax if ax is not None else new_axes(1, 1, size)


def new_axes(rows: int, columns: int, size: tuple[float, float], share_x: bool = False) -> Any:
    """New axes that pyplot shows, an array of them for several rows or columns; size in inches."""
    # Outside the style: pyplot may load its backend here, and what a notebook's backend sets has to stay.
    made = pyplot.figure(figsize=size, layout="constrained", facecolor=STYLE["figure.facecolor"])
    with matplotlib.rc_context(STYLE):
        axes = made.subplots(rows, columns, sharex="col" if share_x else False)
    for ax in np.ravel(axes):
        _dress(ax)
    return axes


def look_of(name: str, number: int) -> tuple[str, str]:
    """Colour and marker of a curve: that of a model of a diagnosis, or that of the curve's number."""
    return MODELS.get(name, SERIES[number % len(SERIES)])


def legend_above(ax: Axes) -> None:
    """A legend in rows above the axes, where it hides nothing."""
    _legend(ax, ax, loc="lower left", bbox_to_anchor=(0.0, 1.0))


def legend_above_all(axes: Any) -> None:
    """One legend above several axes of a figure, which all draw what the first one draws."""
    _legend(axes[0].figure, axes[0], loc="outside upper left")


def name_rows(ax: Axes, names: Sequence[str]) -> None:
    """Rows from the top down under their names."""
    ax.set_yticks(range(len(names)), list(names))
    ax.set_ylim(len(names) - 0.5, -0.5)
    ax.grid(visible=False, axis="y")
    ax.tick_params(axis="y", length=0)


def heavy(points: Any) -> bool:
    """Whether a curve through these points should be drawn as pixels."""
    return np.size(points) > HEAVY


def _dress(ax: Axes) -> None:
    """Ticks are made when they are drawn, long after the settings of `figure` are gone: they are told here."""
    ax.tick_params(which="both", labelsize=TEXT, width=THIN, color=BLACK, labelcolor=BLACK)


def _legend(place: Any, ax: Axes, **where: Any) -> None:
    """What the axes draw, told at `place`, a figure or axes, in the colour of the axes' own text."""
    handles, labels = ax.get_legend_handles_labels()
    columns = _columns(labels, place.bbox.width / ax.figure.dpi)
    place.legend(handles, labels, ncols=columns, labelcolor=ax.xaxis.label.get_color(), **where, **LEGEND)


def _columns(labels: Sequence[str], room: float) -> int:
    """The most columns, evenly filled, that fit into `room` [inch]."""
    letters = [len(label) for label in labels]
    for rows in range(1, len(labels)):
        columns = -(-len(labels) // rows)
        widest = [max(column) for column in np.array_split(letters, columns)]
        if sum(0.4 + 0.06 * count for count in widest) < room:
            return columns
    return 1

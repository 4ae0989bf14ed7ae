"""The driven path, and how far a prediction strays from it."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from jaxident.files.any_log import as_log
from jaxident.log import Log
from jaxident.plot import style
from jaxident.plot.names import LENGTH, TURN

if TYPE_CHECKING:
    from jaxident.estimation.predict import Prediction

COLUMNS = 3
"""Stretches in a row of a picture of several."""
BANDS = ((0.05, 0.95, 0.15), (0.25, 0.75, 0.3))
"""Lower and upper quantile of a band, and how dark it is."""


def path(log: Log, prediction: "Prediction | None" = None, *, ax: Axes | None = None) -> Axes:
    """The poses that the camera saw [m], one curve per run from a triangle that points along the first heading, and
    free-run predictions over them, one curve per start.

    The thin line joins the rows that were seen, across those that were not. Equal scales in x and y.
    """
    log = as_log(log)
    ax = style.axes_or_new(ax, (style.WIDTH, 4.5))
    for number, run in enumerate(log.runs()):
        x, y, theta = (np.asarray(column, float) for column in run.pose)
        seen = np.isfinite(x) & np.isfinite(y)
        text = "measured" if number == 0 else None
        look: dict[str, Any] = {"color": style.MEASURED, "linewidth": 0.5, "marker": ".", "markersize": 1.8}
        ax.plot(x[seen], y[seen], label=text, rasterized=style.heavy(x), **look)
        if seen.any():
            _mark_start(ax, x[seen][0], y[seen][0], theta[seen][0], "start" if number == 0 else None)
    if prediction is not None and np.size(prediction.t):
        _draw_predictions(ax, prediction)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set(xlabel="$x$ [m]", ylabel="$y$ [m]")
    style.legend_above(ax)
    return ax


def prediction_error(step_time: Any, position_error: Any, heading_error: Any, *, axes: Any = None) -> Any:
    """Error of free-run predictions against their horizon [s]: median and the middle half and nine tenths of all
    starts.

    step_time (steps,), errors (starts, steps) in [m] and [rad], NaN where a prediction has ended; their size counts.
    axes: two, for position and heading. Returns them.
    """
    axes = style.new_axes(1, 2, (style.WIDTH, 2.8)) if axes is None else axes
    step_time = np.asarray(step_time, float)
    for ax, what, error, (unit, scale) in zip(
        np.ravel(axes), ("position", "heading"), (position_error, heading_error), (LENGTH, TURN), strict=True
    ):
        size = scale * np.abs(np.asarray(error, float)).reshape(-1, len(step_time))
        known = np.isfinite(size).any(axis=0)
        if known.any():
            _draw_quantiles(ax, step_time[known], size[:, known])
        ax.set_xlim(left=0.0)
        ax.set_ylim(bottom=0.0)
        ax.set(xlabel="horizon [s]", ylabel=f"{what} error [{unit}]")
    style.legend_above_all(np.ravel(axes))
    return axes


def stretches(measured: Any, predicted: Mapping[str, Any], *, titles: Sequence[str], axes: Any = None) -> Any:
    """Small multiples: measured positions (stretches, rows, 2) [m] and those that some models predict, {model:
    (stretches, rows, 2)}, each from where the first model begins [mm], scales equal in x and y; NaN where the camera
    saw nothing. axes: COLUMNS in a row, or fewer if there are fewer stretches. Returns them."""
    measured = np.asarray(measured, float)
    columns = min(COLUMNS, len(measured))
    rows = -(-len(measured) // columns)
    axes = style.new_axes(rows, columns, (style.WIDTH, 0.4 + 2.1 * rows)) if axes is None else axes
    unit, scale = LENGTH
    for number, ax in enumerate(np.ravel(axes)):
        if number >= len(measured):
            ax.set_visible(False)
            continue
        begin = np.asarray(next(iter(predicted.values())))[number, 0]
        ax.plot(*scale * (measured[number] - begin).T, color=style.MEASURED, linestyle="none", marker=".",
                markersize=4.0, label="measured")  # fmt: skip
        for order, (name, paths) in enumerate(predicted.items()):
            colour, _ = style.look_of(name, order)
            ax.plot(*scale * (np.asarray(paths[number]) - begin).T, color=colour, linewidth=style.LINE, label=name)
            ax.plot(*scale * (np.asarray(paths[number][-1:]) - begin).T, color=colour, marker="o", markersize=3.5)
        ax.set_aspect("equal", adjustable="datalim")
        ax.set_title(titles[number], loc="left", fontsize=style.TEXT - 1)
    shown = np.ravel(axes)[: len(measured)]
    for ax in shown[-columns:]:
        ax.set_xlabel(f"$x$ [{unit}]")
    for ax in shown[::columns]:
        ax.set_ylabel(f"$y$ [{unit}]")
    style.legend_above_all(shown)
    return axes


def _mark_start(ax: Axes, x: float, y: float, theta: float, text: str | None) -> None:
    """A triangle along the heading, a circle where the heading is unknown."""
    marker: Any = (3, 0, np.degrees(theta) - 90.0) if np.isfinite(theta) else "o"
    look: dict[str, Any] = {
        "markersize": 7,
        "markerfacecolor": "white",
        "markeredgecolor": style.TRUE,
        "linestyle": "none",
    }
    ax.plot([x], [y], marker=marker, zorder=4, label=text, **look)


def _draw_predictions(ax: Axes, prediction: "Prediction") -> None:
    run, start = np.asarray(prediction.run), np.asarray(prediction.start)
    points = np.column_stack([np.asarray(prediction.x, float), np.asarray(prediction.y, float)])
    cuts = np.flatnonzero((run[1:] != run[:-1]) | (start[1:] != start[:-1])) + 1
    curves = LineCollection(np.split(points, cuts), colors=style.PREDICTED, linewidths=1.5 * style.LINE, zorder=3)
    curves.set_label("free-run prediction")
    curves.set_rasterized(style.heavy(run))
    ax.add_collection(curves)
    first = np.concatenate([[0], cuts])
    ax.plot(*points[first].T, color=style.PREDICTED, linestyle="none", marker=".", markersize=5, zorder=3)
    ax.autoscale_view()


def _draw_quantiles(ax: Axes, step_time: np.ndarray, size: np.ndarray) -> None:
    for low, high, alpha in BANDS:
        edges = np.nanquantile(size, [low, high], axis=0)
        text = f"middle {100 * (high - low):.0f} %"
        ax.fill_between(step_time, *edges, color=style.PREDICTED, alpha=alpha, linewidth=0, label=text)
    ax.plot(step_time, np.nanmedian(size, axis=0), color=style.PREDICTED, linewidth=1.5 * style.LINE, label="median")

"""What a Monte-Carlo study found: error against noise, maps over two axes, distributions of errors."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm

from jaxident.plot import style
from jaxident.plot.estimates import BAND, HOLLOW, scale_for_levels
from jaxident.plot.names import LENGTH, written

BINS = 40
SHOWN_SHARE = 0.99
"""Share of the errors that a histogram's width takes in; the few beyond count in its outer bins."""

BRIGHT = 0.5
"""From here on a map's colour is bright enough for black text."""

DEEPEST = 30.0
"""The axis of errors goes down to this part of the lowest curve: a bias below it is none that anyone needs."""

MAP = "cividis"
"""Colours of a map: even in brightness, and alike for colour-blind readers."""


class Curve(NamedTuple):
    """Statistics of one estimator at each noise level (levels,), in SI units."""

    rmse: Any
    rmse_se: Any
    bias: Any
    bias_se: Any


def error_curves(
    noise: Any, curves: Mapping[str, Curve], *, label: str, ax: Axes | None = None, bound: Any = None
) -> Axes:
    """Root-mean-square error of one parameter against the camera's position noise [m] (levels,), each estimator with
    the 95 % band of its Monte-Carlo error, both axes logarithmic; hollow marks are the size of the bias.

    bound: smallest standard deviation possible (levels,). label: the parameter's name.
    """
    ax = style.axes_or_new(ax, (style.WIDTH, 3.6))
    unit, scale = LENGTH
    level, how = scale * np.asarray(noise, float), written(label)
    scale_for_levels(ax, level)
    for number, (name, curve) in enumerate(curves.items()):
        colour, marker = style.SERIES[number % len(style.SERIES)]
        shift = level * (1.0 + 0.04 * (number - 0.5 * (len(curves) - 1)))
        rmse, rmse_se, bias, bias_se = (how.scale * np.asarray(part, float) for part in curve)
        low = np.maximum(rmse - BAND * rmse_se, 1e-3 * rmse)
        ax.fill_between(shift, low, rmse + BAND * rmse_se, color=colour, alpha=0.25, linewidth=0)
        ax.plot(shift, rmse, color=colour, linewidth=style.LINE, marker=marker, markersize=3.5, zorder=3, label=name)
        hollow: dict[str, Any] = HOLLOW | {"marker": marker, "zorder": 2.5}
        ax.errorbar(shift, np.abs(bias), bias_se, color=colour, elinewidth=style.THIN, capsize=2, **hollow)
    ax.plot([], [], color=style.GREY, linewidth=style.LINE, marker="o", markersize=3.5, label="root mean square")
    ax.plot([], [], color=style.GREY, marker="o", **HOLLOW, label="bias with standard error")
    if bound is not None:
        lowest = how.scale * np.asarray(bound, float)
        ax.plot(level, lowest, color=style.TRUE, linestyle="--", linewidth=style.LINE, label="Cramér-Rao bound")
    lowest_curve = min((how.scale * np.nanmin(c.rmse) for c in curves.values() if np.any(c.rmse > 0.0)), default=0.0)
    if lowest_curve > 0.0:
        ax.set_ylim(bottom=max(ax.get_ylim()[0], lowest_curve / DEEPEST))
    ax.set(xlabel=f"camera noise in position [{unit}]", ylabel=f"error of {how.label}")
    style.legend_above(ax)
    return ax


def heat_map(
    values: Any,
    *,
    rows: Sequence[str],
    columns: Sequence[str],
    label: str,
    ax: Axes | None = None,
    limits: tuple[float, float] | None = None,
) -> Axes:
    """Positive values (rows, columns) as colours on a logarithmic scale, each written into its field; NaN is empty.

    label: what the values are, with their unit, above the map. limits: ends of the colours, by default of the values.
    """
    ax = style.axes_or_new(ax)
    values = np.asarray(values, float)
    known = values[np.isfinite(values) & (values > 0.0)]
    low, high = (np.min(known), np.max(known)) if known.size else (1.0, 10.0)
    norm = LogNorm(*limits, clip=True) if limits else LogNorm(low, max(high, 1.01 * low))
    ax.imshow(np.where(values > 0.0, values, np.nan), cmap=MAP, norm=norm, aspect="auto")
    for (row, column), value in np.ndenumerate(values):
        if np.isfinite(value):
            colour = style.BLACK if value > 0.0 and norm(value) > BRIGHT else "white"
            text = f"{value:.0f}" if 1e2 <= value < 1e6 else f"{value:.3g}"
            ax.text(column, row, text, ha="center", va="center", color=colour, fontsize=style.TEXT - 1)
    ax.set_xticks(range(len(columns)), columns, fontsize=style.TEXT - 1)
    ax.set_yticks(range(len(rows)), rows)
    ax.set_title(label, loc="left", fontsize=style.TEXT)
    ax.grid(visible=False)
    ax.tick_params(length=0)
    for side in ax.spines.values():
        side.set_visible(False)
    return ax


def error_histogram(
    errors: Mapping[str, Any], *, label: str, ax: Axes | None = None, bound: float | None = None
) -> Axes:
    """Distribution of the error of one parameter, {estimator: (trials,)} in SI units with NaN for failures.

    bound: smallest standard deviation possible, drawn as the normal density of that width around zero. Where it is far
    narrower than the errors, its top is cut off: the histograms set the height.
    """
    ax = style.axes_or_new(ax, (style.WIDTH, 2.8))
    how = written(label)
    kept = {name: how.scale * np.asarray(v, float)[np.isfinite(v)] for name, v in errors.items()}
    edges = _edges([v for v in kept.values() if v.size])
    low, high, top = edges[0], edges[-1], 0.0
    for number, (name, values) in enumerate(kept.items()):
        if values.size:
            heights = np.histogram(np.clip(values, low, high), edges)[0] / (values.size * (edges[1] - edges[0]))
            top = max(top, float(heights.max()))
            colour = style.SERIES[number % len(style.SERIES)][0]
            ax.stairs(heights, edges, color=colour, fill=True, alpha=0.25)
            ax.stairs(heights, edges, color=colour, linewidth=style.LINE, label=name)
    ax.axvline(0.0, color=style.TRUE, linewidth=style.THIN, linestyle="--")
    if bound is not None:
        spread = how.scale * bound
        x = np.linspace(low, high, 400)
        density = np.exp(-0.5 * (x / spread) ** 2) / (spread * np.sqrt(2.0 * np.pi))
        ax.plot(x, density, color=style.TRUE, linewidth=style.LINE, label="Cramér-Rao bound")
    ax.set(xlabel=f"error of {how.label}", yticks=[], xlim=(low, high), ylim=(0.0, 1.2 * top or 1.0))
    style.legend_above(ax)
    return ax


def estimate_errors(
    estimates: Mapping[str, tuple[Any, Any]], *, truth: Any, names: Sequence[str], ax: Axes | None = None
) -> Axes:
    """Errors of one trial's estimates in per cent of the truth (parameters,), {estimator: (estimate, deviation)}, with
    their 95 % intervals; beyond 1 % the axis is logarithmic. names: as in the model file."""
    ax = style.axes_or_new(ax)
    true = np.asarray(truth, float)
    for number, (name, (estimate, deviation)) in enumerate(estimates.items()):
        colour, marker = style.SERIES[number % len(style.SERIES)]
        error, half = 100.0 * (np.asarray(estimate) / true - 1.0), np.abs(100.0 * BAND * np.asarray(deviation) / true)
        place = np.arange(len(true)) + 0.2 * (number - 0.5 * (len(estimates) - 1))
        look: dict[str, Any] = {"linestyle": "none", "marker": marker, "markersize": 3.5, "color": colour}
        ax.errorbar(place, error, half, elinewidth=style.LINE, label=name, **look)
    ax.axhline(0.0, color=style.TRUE, linewidth=style.THIN, linestyle="--")
    ax.set_xticks(range(len(names)), [written(name).symbol for name in names])
    ax.set(yscale="symlog", ylabel="error [%] with 95 % interval")
    style.legend_above(ax)
    return ax


def error_sizes(errors: Mapping[str, Any], *, names: Sequence[str], ax: Axes | None = None) -> Axes:
    """Sizes of relative errors (parameters,), 1 for all, of several sources in per cent, a row per parameter, the axis
    logarithmic. names: as in the model file."""
    ax = style.axes_or_new(ax, (style.WIDTH, 0.8 + 0.24 * max(len(names), 2)))
    for number, (name, values) in enumerate(errors.items()):
        colour, marker = style.SERIES[number % len(style.SERIES)]
        look: dict[str, Any] = {"linestyle": "none", "marker": marker, "markersize": 5.0, "color": colour}
        ax.plot(100.0 * np.abs(np.asarray(values, float)), range(len(names)), label=name, **look)
    ax.set(xscale="log", xlabel="size of the error [%]")
    ax.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    style.name_rows(ax, [written(name).symbol for name in names])
    style.legend_above(ax)
    return ax


def break_down(noise: Any, errors: Mapping[str, Any], *, broken: float, ax: Axes | None = None) -> Axes:
    """Relative error, 1 for all, of each estimator's median parameter against the camera's position noise [m], the
    middle and the range over all cells (cells, levels), both axes logarithmic; from the level `broken` on an estimator
    is called broken."""
    ax = style.axes_or_new(ax, (style.WIDTH, 3.0))
    unit, scale = LENGTH
    level = scale * np.asarray(noise, float)
    scale_for_levels(ax, level)
    for number, (name, values) in enumerate(errors.items()):
        colour, marker = style.SERIES[number % len(style.SERIES)]
        percent = 100.0 * np.asarray(values, float)
        known = np.isfinite(percent).any(axis=0)
        low, middle, high = (np.nanquantile(percent[:, known], at, axis=0) for at in (0.0, 0.5, 1.0))
        ax.fill_between(level[known], low, high, color=colour, alpha=0.2, linewidth=0)
        ax.plot(level[known], middle, color=colour, marker=marker, markersize=4.0, linewidth=style.LINE, label=name)
    ax.axhline(100.0 * broken, color=style.TRUE, linewidth=style.LINE, linestyle="--", label="broken above")
    ax.set(yscale="log", xlabel=f"camera noise in position [{unit}]", ylabel="error of the median parameter [%]")
    ax.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    style.legend_above(ax)
    return ax


def _edges(errors: Sequence[np.ndarray]) -> np.ndarray:
    """Edges of the bins: all of the errors but the few outermost, and zero."""
    tail = 0.5 * (1.0 - SHOWN_SHARE)
    ends = [0.0, *(end for values in errors for end in np.quantile(values, (tail, 1.0 - tail)))]
    low, high = min(ends), max(ends)
    margin = 0.05 * (high - low) or 1.0
    return np.linspace(low - margin, high + margin, BINS + 1)

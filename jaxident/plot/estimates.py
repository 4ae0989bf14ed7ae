"""Estimated parameters: over time, and against the camera's noise."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator, NullLocator

from jaxident.plot import style
from jaxident.plot.names import LENGTH, written

BAND = 1.96
"""Half width of a 95 % band in standard deviations."""

HOLLOW: Any = {"markersize": 6.5, "markerfacecolor": "white", "linestyle": "none"}


def convergence(
    t: Any, values: Any, deviations: Any, *, names: Sequence[str], truth: Any = None, axes: Any = None
) -> Any:
    """Every parameter's estimate over time with its 95 % band, one small picture each.

    t [s] (samples,), values and deviations (samples, parameters) in SI units, names as in the model file (alpha_1,
    delta_11, dead_zone_r), truth (parameters,). axes: as many as names, two columns if left out. Each vertical scale
    is that of the second half, so that a wide first guess does not flatten the rest. Returns the axes.
    """
    rows = -(-len(names) // 2)
    if axes is None:
        axes = style.new_axes(rows, 2, (style.WIDTH, 0.5 + 1.15 * rows), share_x=True)
    flat, columns = np.ravel(axes), np.shape(np.atleast_1d(axes))[-1]
    values, deviations = (np.asarray(signal, float) for signal in (values, deviations))
    for number, (ax, name) in enumerate(zip(flat, names, strict=False)):
        how = written(name)
        scaled = how.scale * values[:, number], how.scale * deviations[:, number]
        true = None if truth is None else np.full(len(values), how.scale * float(truth[number]))
        _draw_band(ax, t, true, *scaled)
        _frame_second_half(ax, true, *scaled)
        ax.set_ylabel(how.label)
        if number >= len(names) - columns:
            ax.set_xlabel("time [s]")
            ax.tick_params(labelbottom=True)
    for spare in flat[len(names) :]:
        spare.set_visible(False)
    flat[0].figure.align_ylabels(flat)
    style.legend_above_all(flat)
    return axes


def tracking(t: Any, truth: Any, estimate: Any, deviation: Any, *, label: str, ax: Axes | None = None) -> Axes:
    """A drifting parameter, its recursive estimate and the estimate's 95 % band over time.

    t [s], truth (None if unknown), estimate and deviation (samples,) in SI units; label: the parameter's name.
    """
    ax = style.axes_or_new(ax)
    how = written(label)
    true = None if truth is None else how.scale * np.broadcast_to(np.asarray(truth, float), np.shape(t))
    scaled = [how.scale * np.asarray(signal, float) for signal in (estimate, deviation)]
    _draw_band(ax, t, true, *scaled)
    _frame_second_half(ax, true, *scaled)
    ax.set(xlabel="time [s]", ylabel=how.label)
    style.legend_above(ax)
    return ax


def error_against_noise(
    noise: Any,
    estimates: Mapping[str, Any],
    *,
    truth: float,
    label: str,
    ax: Axes | None = None,
    bound: Any = None,
) -> Axes:
    """Error of one parameter against the camera's position noise, for several estimators, both axes logarithmic.

    noise [m] (levels,), estimates {estimator: (levels, seeds)} with NaN for a failure, counted in the legend. Curves:
    root mean square error over the seeds. Hollow marks: size of the mean error (bias) with its standard error; one
    that reaches the bottom is no bias that these seeds can show. bound: smallest standard deviation possible, such
    as Cramer and Rao's (levels,). label: the parameter's name.
    """
    ax = style.axes_or_new(ax, (style.WIDTH, 3.6))
    unit, scale = LENGTH
    level = scale * np.asarray(noise, float)
    how = written(label)
    scale_for_levels(ax, level)
    for number, (name, values) in enumerate(estimates.items()):
        error = how.scale * (np.asarray(values, float) - truth)
        shift = 1.0 + 0.04 * (number - 0.5 * (len(estimates) - 1))
        _draw_estimator(ax, level * shift, error, name, style.SERIES[number % len(style.SERIES)])
    ax.plot([], [], color=style.GREY, linewidth=style.LINE, marker="o", markersize=3.5, label="root mean square")
    ax.plot([], [], color=style.GREY, marker="o", **HOLLOW, label="bias with standard error")
    if bound is not None:
        lowest = how.scale * np.asarray(bound, float)
        ax.plot(level, lowest, color=style.TRUE, linestyle="--", linewidth=style.LINE, label="Cramér-Rao bound")
    ax.set(xlabel=f"camera noise in position [{unit}]", ylabel=f"error of {how.label}")
    style.legend_above(ax)
    return ax


def _draw_estimator(ax: Axes, level: np.ndarray, error: np.ndarray, name: str, look: tuple[str, str]) -> None:
    colour, marker = look
    failed = int(np.sum(~np.isfinite(error)))
    text = f"{name} ({failed} of {error.size} failed)" if failed else name
    kept = [row[np.isfinite(row)] for row in error]
    square = np.array([np.sqrt(np.mean(row**2)) if row.size else np.nan for row in kept])
    bias = np.array([abs(np.mean(row)) if row.size else np.nan for row in kept])
    unsure = np.array([np.std(row, ddof=1) / np.sqrt(row.size) if row.size > 1 else np.nan for row in kept])
    ax.plot(level, square, color=colour, linewidth=style.LINE, marker=marker, markersize=3.5, zorder=3, label=text)
    hollow: dict[str, Any] = HOLLOW | {"marker": marker, "zorder": 2.5}
    ax.errorbar(level, bias, unsure, color=colour, elinewidth=style.THIN, capsize=2, **hollow)


def scale_for_levels(ax: Axes, level: np.ndarray) -> None:
    """Both axes logarithmic, with room for a level of zero, and ticks at eight of the levels or fewer."""
    ax.set_yscale("log", nonpositive="clip")
    if np.any(level == 0.0):
        ax.set_xscale("symlog", linthresh=min(level[level > 0.0], default=1.0))
    else:
        ax.set_xscale("log")
    ticks = np.unique(level)
    ticks = ticks[:: -(-len(ticks) // 8)]
    ax.set_xticks(ticks, [f"{tick:.3g}" for tick in ticks])
    ax.xaxis.set_minor_locator(NullLocator())


def _draw_band(ax: Axes, t: Any, true: np.ndarray | None, value: np.ndarray, deviation: np.ndarray) -> None:
    raster = style.heavy(t)
    low, high = value - BAND * deviation, value + BAND * deviation
    ax.fill_between(t, low, high, color=style.MODELLED, alpha=0.25, linewidth=0, label="95 % band", rasterized=raster)
    ax.plot(t, value, color=style.MODELLED, linewidth=style.LINE, label="estimate", rasterized=raster)
    if true is not None:
        ax.plot(t, true, color=style.TRUE, linewidth=style.LINE, linestyle="--", label="true value", rasterized=raster)


def _frame_second_half(ax: Axes, true: np.ndarray | None, value: np.ndarray, deviation: np.ndarray) -> None:
    """Vertical limits from the band's second half, the middle nine tenths of the estimate and the truth."""
    half = len(value) // 2
    parts = [value[half:] - BAND * deviation[half:], value[half:] + BAND * deviation[half:]]
    parts += [np.quantile(value[np.isfinite(value)], [0.05, 0.95])] if np.isfinite(value).any() else []
    parts += [] if true is None else [true]
    shown = np.concatenate(parts)
    shown = shown[np.isfinite(shown)]
    if shown.size:
        low, high = np.min(shown), np.max(shown)
        margin = 0.08 * (high - low) or 0.01 * abs(high) or 1.0
        ax.set_ylim(low - margin, high + margin)
    ax.margins(x=0.01)
    ax.yaxis.set_major_locator(MaxNLocator(4))

"""What a diagnosis found: sizes of the gap, the map of where it lies, the ranking of effects, how far it shrinks."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import PowerNorm
from matplotlib.patches import Rectangle
from matplotlib.ticker import LogLocator

from jaxident.plot import style
from jaxident.plot.studies import BRIGHT, MAP

DECADES = 20.0
"""Gains whose largest is beyond this many times the smallest are drawn on a logarithmic axis."""
FRAME: Any = {"fill": False, "edgecolor": style.VERMILLION, "linewidth": 1.8}
"""Of a bin that stands out."""
MORE_DECIMALS = 4
"""Decimals that the edges of a map's bins get at most, beyond two digits, where they would look alike."""
WEAKEST = 0.5
"""Where a logarithmic axis of gains begins at the latest: a smaller gain says nothing."""


def gap_levels(
    levels: Mapping[str, Any], floor: Any, *, rows: Sequence[str], intervals: Mapping[str, Any] | None = None,
    floor_interval: tuple[float, float] | None = None, ax: Axes | None = None,
) -> Axes:  # fmt: skip
    """Mean squared errors of several models in each row (all channels, then each), on a logarithmic axis.

    levels: by model, in units of the camera's variance (rows,); intervals: by model (rows, 2); floor: (rows,), a black
    bar; floor_interval: that of the first row, a grey field.
    """
    ax = style.axes_or_new(ax, (style.WIDTH, 2.6))
    places = np.arange(len(rows), dtype=float)
    if floor_interval is not None:
        ax.fill_betweenx([-0.42, 0.42], *floor_interval, color=style.PALE, linewidth=0, zorder=1)
    ax.vlines(np.asarray(floor, float), places - 0.42, places + 0.42, color=style.TRUE, linewidth=1.4, label="floor")
    for number, (name, values) in enumerate(levels.items()):
        colour, marker = style.look_of(name, number)
        shift = places + 0.22 * (number - 0.5 * (len(levels) - 1))
        middle = np.asarray(values, float)
        spread = None if intervals is None else np.abs(np.asarray(intervals[name], float).T - middle)
        look: dict[str, Any] = {"linestyle": "none", "marker": marker, "markersize": 5.0, "color": colour}
        ax.errorbar(middle, shift, xerr=spread, elinewidth=1.4, label=name, **look)
    style.name_rows(ax, rows)
    _spread_out(ax)
    ax.set_xlabel("mean squared error at the horizon [camera variances]")
    style.legend_above(ax)
    return ax


def gap_map(
    table: Mapping[str, tuple[Any, Any]],
    *,
    marked: Collection[tuple[str, int]] = (),
    label: str,
    ax: Axes | None = None,
) -> Axes:
    """The mean excess in each bin of each variable, a row per variable, written with the range that the bin spans.

    table: by variable the edges (bins + 1,) and the means (bins,). marked: (variable, bin) with a frame. label: what
    the colours are; they go by the root, so that small excesses are told apart too, and none or less is darkest.
    """
    ax = style.axes_or_new(ax, (style.WIDTH, 0.8 + 0.27 * max(len(table), 1)))
    widest = max((len(means) for _, means in table.values()), default=1)
    values = np.full((max(len(table), 1), widest), np.nan)
    for row, (_, means) in enumerate(table.values()):
        values[row, : len(means)] = means
    top = float(np.nanmax(values, initial=0.0))
    low = min(max(float(np.nanmin(values, initial=top)), 0.0), 0.9 * top)
    norm = PowerNorm(0.5, low, top if top > 0.0 else 1.0, clip=True)
    shown = ax.imshow(values, cmap=MAP, norm=norm, aspect="auto")
    for row, (variable, (edges, means)) in enumerate(table.items()):
        ends = _ends(edges)
        for column, mean in enumerate(means):
            colour = style.BLACK if norm(mean) > BRIGHT else "white"
            text = f"{ends[column]} … {ends[column + 1]}"
            ax.text(column, row, text, ha="center", va="center", color=colour, fontsize=style.TEXT - 1.5)
            if (variable, column) in marked:
                ax.add_patch(Rectangle((column - 0.475, row - 0.42), 0.95, 0.84, **FRAME))
    ax.set_yticks(range(len(table)), list(table))
    ax.set_xticks([])
    ax.grid(visible=False)
    ax.tick_params(length=0)
    for side in ax.spines.values():
        side.set_visible(False)
    _colour_bar(ax, shown, label)
    return ax


def ranking(
    gains: Mapping[str, float], needed: Mapping[str, float], *, notes: Mapping[str, str] | None = None,
    groups: Mapping[str, str] | None = None, ax: Axes | None = None,
) -> Axes:  # fmt: skip
    """Candidates as points at their gain (fall of -log p from the nominal fit), best on top.

    needed: the gain from which each is claimed, a black tick. notes: text behind a point. groups: what a candidate is,
    one colour each; those left out are grey. The axis is logarithmic where gains span decades; the length of a bar
    would mislead there.
    """
    ax = style.axes_or_new(ax, (style.WIDTH, 0.8 + 0.25 * max(len(gains), 2)))
    places, groups = np.arange(len(gains)), groups or {}
    told = list(dict.fromkeys(groups.values()))
    values = np.maximum(np.array(list(gains.values()), float), 0.0)
    logarithmic = values.size > 0 and values.max() > DECADES * max(values.min(), WEAKEST)
    ticks = np.array([needed[name] for name in gains])
    ax.vlines(ticks, places - 0.42, places + 0.42, color=style.TRUE, linewidth=1.4, label="needed")
    least = min(1.0, max(values.min(initial=WEAKEST), WEAKEST)) if logarithmic else 0.0
    for group in [*told, None]:
        here = [k for k, name in enumerate(gains) if groups.get(name) == group]
        colour, marker = (style.GREY, "o") if group is None else style.look_of(group, told.index(group))
        ax.plot(np.maximum(values[here], least), places[here], linestyle="none", marker=marker, markersize=6.0,
                color=colour, clip_on=False, label=group or "others" if here else "_")  # fmt: skip
    if logarithmic:
        ax.set_xscale("log")
    ax.set_xlim(left=0.8 * least)  # names stay clear of the points
    for place, (name, value, tick) in enumerate(zip(gains, values, ticks, strict=True)):
        text, end = (notes or {}).get(name, ""), max(value, least)
        if 0.5 * tick < end < tick:  # clear of the tick
            end = tick
        ax.annotate(text, (end, place), (7, 0), textcoords="offset points", va="center", fontsize=style.TEXT - 1)
    low, high = ax.get_xlim()
    ax.set_xlim(low, high**1.15 if logarithmic else 1.15 * high)
    style.name_rows(ax, list(gains))
    ax.set_xlabel("gain: fall of $-\\log p$ against the nominal model")
    style.legend_above(ax)
    return ax


def shrinks(
    values: Mapping[str, float], intervals: Mapping[str, tuple[float, float]], *, groups: Mapping[str, str],
    ax: Axes | None = None,
) -> Axes:  # fmt: skip
    """How far the gap shrinks with each set of effects, with intervals, in per cent: 0 leaves it, 100 closes it.

    values, intervals: shares by name, 1 for all. groups: by name what it is, one colour and marker each.
    """
    ax = style.axes_or_new(ax, (style.WIDTH, 0.9 + 0.25 * max(len(values), 2)))
    for line in (0.0, 100.0):
        ax.axvline(line, color=style.TRUE, linewidth=style.THIN, linestyle="--", zorder=1)
    for number, group in enumerate(dict.fromkeys(groups.values())):
        here = [k for k, name in enumerate(values) if groups[name] == group]
        colour, marker = style.look_of(group, number)
        names = [list(values)[k] for k in here]
        middle = 100.0 * np.array([values[name] for name in names])
        spread = np.abs(100.0 * np.array([intervals[name] for name in names]).T - middle)
        look: dict[str, Any] = {"linestyle": "none", "marker": marker, "markersize": 5.0, "color": colour}
        ax.errorbar(middle, here, xerr=spread, elinewidth=1.4, label=group, **look)
    low, high = ax.get_xlim()
    ax.set_xlim(min(low, -8.0), max(high, 108.0))
    style.name_rows(ax, list(values))
    ax.set_xlabel("shrink of the gap [%] with 90 % interval")
    style.legend_above(ax)
    return ax


def confusion(named: Any, rows: Sequence[str], columns: Sequence[str], *, ax: Axes | None = None) -> Axes:
    """Shares (rows, columns) of what was hidden (rows) that came out as what (columns), in per cent; below one none is
    written."""
    shares = 100.0 * np.asarray(named, float)
    ax = style.axes_or_new(ax, (style.WIDTH, 1.4 + 0.2 * len(rows)))
    ax.imshow(shares, cmap=MAP, norm=PowerNorm(0.5, 0.0, 100.0), aspect="auto")
    for row, column in zip(*np.nonzero(shares >= 1.0), strict=True):
        share = shares[row, column]
        colour = style.BLACK if PowerNorm(0.5, 0.0, 100.0)(share) > BRIGHT else "white"
        ax.text(column, row, f"{share:.0f}", ha="center", va="center", color=colour, fontsize=style.TEXT - 2)
    ax.set_yticks(range(len(rows)), list(rows))
    ax.set_xticks(range(len(columns)), list(columns), rotation=90)
    ax.grid(visible=False)
    ax.tick_params(length=0)
    ax.set_ylabel("hidden")
    ax.set_xlabel("named")
    return ax


def _colour_bar(ax: Axes, shown: Any, label: str) -> None:
    """What the colours mean, above the map, told at five evenly spread ones."""
    bar = ax.figure.colorbar(shown, ax=ax, location="top", aspect=45, pad=0.02)
    bar.set_label(label, fontsize=style.TEXT, loc="left")
    ends = shown.norm.inverse(np.linspace(0.0, 1.0, 5)).tolist()
    bar.set_ticks(ends, labels=[_short(end) for end in ends])
    bar.ax.tick_params(labelsize=style.TEXT, width=style.THIN)
    bar.outline.set_linewidth(style.THIN)  # type: ignore[operator]


def _spread_out(ax: Axes) -> None:
    """A logarithmic axis with plain numbers and at least a decade."""
    ax.set_xscale("log")
    low, high = ax.get_xlim()
    ax.set_xlim(min(low, 0.5 * (low * high) ** 0.5), max(high, 5.0 * (low * high) ** 0.5))
    decades = np.log10(ax.get_xlim()[1] / ax.get_xlim()[0])
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if decades < 2.0 else (1.0,)))
    ax.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    ax.xaxis.set_minor_formatter(lambda value, _: "")


def _ends(edges: Any) -> list[str]:
    """Edges of a row's bins: two digits of a bin's mean width, more where two of them would look alike."""
    edges = np.asarray(edges, float)
    width = float(edges[-1] - edges[0]) / (len(edges) - 1)
    decimals = 1 - int(np.floor(np.log10(width))) if width > 0.0 else 2
    apart, most = len(np.unique(edges)), decimals + MORE_DECIMALS
    while decimals < most and len(np.unique(np.round(edges, decimals))) < apart:
        decimals += 1
    return [f"{round(edge, decimals) + 0.0:.5g}".replace("-", "\N{MINUS SIGN}") for edge in edges.tolist()]


def _short(value: float) -> str:
    whole = abs(value) >= 100.0
    return f"{0.0 if abs(value) < 1e-9 else value:{'.0f' if whole else '.2g'}}".replace("-", "\N{MINUS SIGN}")

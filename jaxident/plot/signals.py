"""Commands, dead zones and increments."""

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes

from jaxident.array_types import Increment
from jaxident.files.any_log import as_log
from jaxident.log import Log
from jaxident.plot import style
from jaxident.plot.names import LENGTH, TURN

_CHANNELS = {"length": ("path length", *LENGTH), "turn": ("turn", *TURN)}


def dead_zone(
    width: Any, *, limit: float = 1.0, ax: Axes | None = None, label: str | Sequence[str] | None = None
) -> Axes:
    """Output m of a dead zone against the command u, PAPER figure 4; both in the unit of the command.

    width: one D or several, each marked at plus and minus D; label: one text per width, D itself without.
    The command runs from -limit to limit. A width of NaN draws nothing.
    """
    ax = style.axes_or_new(ax, (3.6, 3.2))
    widths = np.ravel(np.asarray(width, float))
    given = [label] if isinstance(label, str) else label
    labels = [f"D = {w:.3g}" for w in widths] if given is None else given
    ax.axhline(0.0, color=style.GREY, linewidth=style.THIN)
    ax.axvline(0.0, color=style.GREY, linewidth=style.THIN)
    for number, (w, text) in enumerate(zip(widths, labels, strict=True)):
        colour, marker = style.SERIES[number % len(style.SERIES)]
        u = np.array([-max(limit, w), -w, w, max(limit, w)])
        m = np.sign(u) * np.maximum(np.abs(u) - w, 0.0)
        dash = "-" if number == 0 else (0, (4, 1 + number))
        edges: dict[str, Any] = {"marker": marker, "markevery": [1, 2], "markersize": 5, "markerfacecolor": "white"}
        ax.plot(u, m, color=colour, linewidth=1.5 * style.LINE, linestyle=dash, label=text, **edges)
    ax.set(xlabel="command $u$ [unit]", ylabel="output of the dead zone $m$ [unit]")
    style.legend_above(ax)
    return ax


def commands(log: Log, *, ax: Axes | None = None, dead_zone: Sequence[float] | None = None) -> Axes:
    """Both wheels' commands as steps against time [s], PAPER figure 7; dead_zone: [D_r, D_l], shaded.

    Several runs follow one another, divided by thin lines, on the session time: the sum of the durations before.
    """
    log = as_log(log)
    ax = style.axes_or_new(ax)
    runs = log.runs()
    wheels = (("right wheel", style.RIGHT, "u_r"), ("left wheel", style.LEFT, "u_l"))
    for number, (name, colour, column) in enumerate(wheels):
        begin = 0.0 if len(runs) > 1 else float(np.ravel(log.t)[0])
        for run in runs:
            t = begin + np.asarray(run.t) - run.t[0]
            u = np.asarray(getattr(run, column), float)
            text = name if run is runs[0] else None
            raster = style.heavy(t)
            ax.step(t, u, where="post", color=colour, linewidth=style.LINE, label=text, rasterized=raster)
            begin = float(t[-1])
            if number == 0 and run is not runs[-1]:
                ax.axvline(begin, color=style.GREY, linewidth=style.THIN, linestyle=":")
        if dead_zone is not None:
            width = float(dead_zone[number])
            ax.axhspan(-width, width, color=colour, alpha=0.15, linewidth=0, label=f"its dead zone ±{width:.3g}")
    ax.margins(x=0.01)
    ax.set(xlabel="session time [s]" if len(runs) > 1 else "time [s]", ylabel="command $u$ [unit]")
    style.legend_above(ax)
    return ax


def increments(
    t: Any,
    measured: Increment,
    modelled: Increment,
    *,
    ax: Axes | None = None,
    channel: Literal["length", "turn"] = "length",
    residual_ax: Axes | None = None,
) -> Axes:
    """Measured path length or turn of each sample against the model's, PAPER figures 8 and 9.

    t [s] and both increments [m], [rad] are (samples,); NaN where there is none. residual_ax, meant for a strip
    below, takes measured minus modelled and the time axis.
    """
    ax = style.axes_or_new(ax)
    what, unit, scale = _CHANNELS[channel]
    seen, model = (scale * np.asarray(getattr(signal, channel), float) for signal in (measured, modelled))
    dots: dict[str, Any] = {"linestyle": "none", "marker": ".", "markersize": 1.8, "rasterized": style.heavy(t)}
    ax.plot(t, seen, color=style.MEASURED, label="measured", **dots)
    ax.plot(t, model, color=style.MODELLED, linewidth=style.LINE, label="model", rasterized=style.heavy(t))
    ax.set_ylabel(f"{what} per sample [{unit}]")
    last = ax
    if residual_ax is not None:
        residual_ax.plot(t, seen - model, color=style.MEASURED, **dots)
        residual_ax.axhline(0.0, color=style.MODELLED, linewidth=style.LINE)
        residual_ax.set_ylabel(f"residual [{unit}]")
        last = residual_ax
        residual_ax.figure.align_ylabels([ax, residual_ax])
    for each in {ax, last}:
        each.margins(x=0.01)
    last.set_xlabel("time [s]")
    style.legend_above(ax)
    return ax

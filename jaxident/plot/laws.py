"""Discovered laws: a curve with its band, or a surface as a map, and how often the robot was there."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from jaxident.array_types import Array
from jaxident.effects.law_kinds import SIGNAL_WORDS, SIGNALS, value_unit
from jaxident.plot import style
from jaxident.robot.model import Discovered

FINE = 8
"""Points of a map from one knot to the next."""
SIGNED = "PuOr"
"""Colours of values of either sign, white at 0."""


def discovered(law: Discovered, density: Sequence[int] | None = None, *, ax: Axes | None = None) -> Axes:
    """A discovered law; density (knots,): how many rows of the logs lie nearest to each knot, row by row for a surface.

    A curve has a band of two standard deviations, and grey bars for the density. A surface is a map: dots are knots,
    larger where the robot was more often, and hollow where the value is less than two deviations from 0.
    """
    ax = style.axes_or_new(ax, (style.WIDTH, 4.0 if law.second_signal else 2.2))
    counts = None if density is None or max(density, default=0) <= 0 else np.asarray(density, float) / max(density)
    (_map if law.second_signal else _curve)(law, counts, f"{law.acts_on}\n[{value_unit(law)}]", ax)
    ax.set_xlabel(_label(law.signal))
    return ax


def _curve(law: Discovered, counts: Array | None, label: str, ax: Axes) -> None:
    at, value = np.asarray(law.at, float), np.asarray(law.value, float)
    ax.axhline(0.0, color=style.GREY, linewidth=style.THIN)
    if law.standard_deviation is not None:
        spread = 2.0 * np.asarray(law.standard_deviation, float)
        ax.fill_between(at, value - spread, value + spread, color=style.BLUE, alpha=0.2, linewidth=0.0)
    ax.plot(at, value, color=style.BLUE, linewidth=1.5 * style.LINE, marker="o", markersize=3.0)
    if counts is not None:
        low, high = ax.get_ylim()
        ax.bar(at, 0.15 * (high - low) * counts, width=0.8 * np.diff(at).mean(), bottom=low, color=style.PALE, zorder=0)
        ax.set_ylim(low, high)
    ax.set_ylabel(label)


def _map(law: Discovered, counts: Array | None, label: str, ax: Axes) -> None:
    at, second_at, value = (np.asarray(part, float) for part in (law.at, law.second_at, law.value))
    fine, second_fine = (np.interp(np.arange(0, len(k) - 1 + 0.5 / FINE, 1 / FINE), np.arange(len(k)), k)
                         for k in (at, second_at))  # fmt: skip
    along = np.stack([np.interp(fine, at, column) for column in value.T], axis=1)
    whole = np.stack([np.interp(second_fine, second_at, row) for row in along])
    most = float(np.abs(value).max()) or 1.0
    shown = ax.pcolormesh(fine, second_fine, whole.T, cmap=SIGNED, vmin=-most, vmax=most, shading="gouraud")
    places = np.meshgrid(at, second_at, indexing="ij")
    size = 12.0 if counts is None else 3.0 + 45.0 * counts
    clear = np.ones(value.size, bool)
    if law.standard_deviation is not None:
        clear = np.abs(value).ravel() > 2.0 * np.asarray(law.standard_deviation, float).ravel()
    look: dict[str, Any] = {"edgecolors": style.TRUE, "linewidths": style.THIN, "zorder": 3}
    colours = [style.TRUE if one else "none" for one in clear]
    ax.scatter(places[0].ravel(), places[1].ravel(), s=size, c=colours, **look)
    bar = ax.figure.colorbar(shown, ax=ax, aspect=30, pad=0.02)
    bar.set_label(label)
    if {law.signal, law.second_signal} == {"x", "y"}:
        ax.set_aspect("equal", adjustable="box")
    ax.set_ylabel(_label(law.second_signal))


def _label(signal: str) -> str:
    return f"{SIGNAL_WORDS[signal]} [{SIGNALS[signal]}]"

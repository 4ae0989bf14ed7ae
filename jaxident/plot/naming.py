"""What the diagnoses of a study name: shares of trials, by effect and along an axis of the study."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from jaxident.plot import style
from jaxident.plot.estimates import scale_for_levels

MAP = "Blues"
DARK = 0.6
"""Share from which a field is so dark that its text is white."""


def name_matrix(
    shares: Any, in_force: Any, *, rows: Sequence[str], columns: Sequence[str], ax: Axes | None = None
) -> Axes:
    """Shares (rows, columns), 0 to 1, of trials in which a diagnosis names an effect, by what acts and what is named:
    per cent in each field, a frame where an effect is in_force (rows, columns). An empty field is zero, or no trial."""
    ax = style.axes_or_new(ax)
    shares = np.asarray(shares, float)
    ax.imshow(shares, cmap=MAP, vmin=0.0, vmax=1.0, aspect="auto")
    for (row, column), share in np.ndenumerate(shares):
        if share > 0.0:
            colour = "white" if share > DARK else style.BLACK
            ax.text(column, row, f"{100 * share:.0f}", ha="center", va="center", color=colour, fontsize=style.TEXT - 1)
        if in_force[row][column]:
            frame = Rectangle((column - 0.5, row - 0.5), 1, 1, fill=False, edgecolor=style.VERMILLION, linewidth=1.6)
            ax.add_patch(frame)
    ax.set_xticks(range(len(columns)), columns, rotation=40, ha="right", fontsize=style.TEXT - 1)
    ax.set_yticks(range(len(rows)), rows)
    ax.grid(visible=False)
    ax.tick_params(length=0)
    return ax


def share_curves(
    levels: Any, curves: Mapping[str, tuple[Any, Any]], *, xlabel: str, ylabel: str, ax: Axes | None = None
) -> Axes:
    """Shares of trials, 0 to 1, with their standard errors (levels,), by name, against an axis's levels (levels,)."""
    ax = style.axes_or_new(ax)
    levels = np.asarray(levels, float)
    scale_for_levels(ax, levels)
    ax.set_yscale("linear")
    for number, (name, (share, error)) in enumerate(curves.items()):
        colour, marker = style.look_of(name, number)
        shift = levels * (1.0 + 0.02 * (number - 0.5 * (len(curves) - 1)))  # lines that agree would hide each other
        ax.errorbar(shift, 100.0 * np.asarray(share), 100.0 * np.asarray(error), color=colour, marker=marker,
                    markersize=4, linewidth=style.LINE, elinewidth=style.THIN, capsize=2, label=name)  # fmt: skip
    ax.set(xlabel=xlabel, ylabel=ylabel, ylim=(-4.0, 104.0))
    style.legend_above(ax)
    return ax

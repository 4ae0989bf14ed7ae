"""Who causes how much of an error: a waterfall of parts that add up to all of it."""

from collections.abc import Collection, Mapping

import numpy as np
from matplotlib.axes import Axes

from jaxident.plot import style

NOTE = 1.35
"""Room to the right of the bars [inch]: what "104 mm, −65.1 mrad" takes."""


def waterfall(
    shares: Mapping[str, float],
    intervals: Mapping[str, tuple[float, float]],
    *,
    notes: Mapping[str, str] | None = None,
    noise: Collection[str] = (),
    rest: str = "rest",
    ax: Axes | None = None,
) -> Axes:
    """Parts of a mean square as bars, each beginning where the one above ends; together they are 100 %.

    shares, intervals: by part, 1 for all; a line shows each interval about its bar's end. notes: text to the right of a
    bar, such as the part in millimetres. noise: parts that no model can take away, grey; rest: what is left, black;
    others are the named effects. A negative share goes back to the left.
    """
    ax = style.axes_or_new(ax, (style.WIDTH, 0.9 + 0.26 * max(len(shares), 2)))
    values = 100.0 * np.array(list(shares.values()), float)
    begins = np.concatenate([[0.0], np.cumsum(values)[:-1]])
    colours = [style.GREY if n in noise else style.BLACK if n == rest else style.BLUE for n in shares]
    ax.barh(np.arange(len(values)), values, 0.62, left=begins, color=colours)
    ends = begins + values
    for place, (name, end) in enumerate(zip(shares, ends, strict=True)):
        low, high = (begins[place] + 100.0 * bound for bound in intervals[name])
        ax.plot([low, high], [place, place], color=style.VERMILLION, linewidth=1.4, solid_capstyle="butt")
        if place + 1 < len(ends):
            ax.plot([end, end], [place, place + 1], color=style.GREY, linewidth=style.THIN)
        text = (notes or {}).get(name, "")
        ax.annotate(text, (max(end, begins[place], high), place), (5, 0), textcoords="offset points", va="center",
                    fontsize=style.TEXT - 1, bbox={"color": "white", "pad": 0.8})  # fmt: skip
    low, high = ax.get_xlim()
    wide = ax.bbox.width / ax.figure.dpi
    ax.set_xlim(low, max(high, 100.0) * wide / max(wide - NOTE, 0.5 * wide))
    ax.axvline(100.0, color=style.BLACK, linewidth=style.THIN, linestyle="--")
    ax.set_xticks([tick for tick in ax.get_xticks() if low <= tick <= 100.0])
    style.name_rows(ax, list(shares))
    ax.set_xlabel("share of the mean squared error [%]")
    return ax

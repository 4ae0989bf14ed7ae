"""What a fit leaves of the measured poses."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from jaxident.plot import style

NAMES = ("$x$", "$y$", r"$\theta$")
SURE = 2.58
"""Standard deviations that 99 of 100 correlations of white residuals stay within."""


def residuals(t: Any, normalised: Any, *, axes: Any = None) -> Any:
    """Residuals of x, y and heading over their standard deviations, each (rows,), NaN where no pose was, against time
    [s]; three axes, returned. Lines at plus and minus 2 standard deviations."""
    axes = style.new_axes(3, 1, (style.WIDTH, 4.2), share_x=True) if axes is None else axes
    for ax, name, value in zip(np.ravel(axes), NAMES, normalised, strict=True):
        look: dict[str, Any] = {"linestyle": "none", "marker": ".", "markersize": 1.8, "rasterized": style.heavy(t)}
        ax.plot(t, value, color=style.MEASURED, **look)
        for level in (-2.0, 2.0):
            ax.axhline(level, color=style.MODELLED, linewidth=style.THIN)
        ax.set_ylabel(f"{name} [sd]")
        ax.margins(x=0.01)
    np.ravel(axes)[-1].set_xlabel("session time [s]")
    return axes


def correlation(values: Any, count: int, *, ax: Axes | None = None) -> Axes:
    """Correlation of residuals (3, lags) with themselves 1, 2, ... rows earlier; the band holds 99 of 100 white ones of
    `count` rows."""
    ax = style.axes_or_new(ax, (style.WIDTH, 2.8))
    lags = np.arange(1, np.shape(values)[1] + 1)
    band = SURE / np.sqrt(count)
    ax.axhspan(-band, band, color=style.GREY, alpha=0.25, linewidth=0, label="99 % if white")
    for k, (name, row) in enumerate(zip(NAMES, np.asarray(values), strict=True)):
        colour, marker = style.SERIES[k]
        ax.plot(lags, row, color=colour, marker=marker, markersize=3.5, linewidth=style.LINE, label=name)
    ax.set(xlabel="rows between", ylabel="correlation")
    style.legend_above(ax)
    return ax

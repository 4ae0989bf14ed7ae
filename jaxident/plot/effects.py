"""What an effect does: its departure from the nominal robot against five things it could depend on."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from jaxident.plot import style

_DOTS: dict[str, Any] = {"linestyle": "none", "marker": ".", "markersize": 1.6, "alpha": 0.7, "markeredgewidth": 0.0}


def effect_signature(
    title: str,
    departure: Mapping[str, Any],
    regressors: Mapping[str, Mapping[str, Any]],
    *,
    axes: Sequence[Axes] | None = None,
) -> Sequence[Axes]:
    """One row of panels: how much further a sample takes the robot with the effect than without.

    departure: by channel (along [mm], lateral [mm], heading [mrad]) arrays (samples,). regressors: by label, in the
    order of the panels, by channel too, arrays (samples,): turns depend on other things than path lengths. Every
    channel is drawn over its own largest size, which the legend tells, so that shapes are compared; those that do not
    move are left out. axes: as many as regressors. Returns them.
    """
    axes = style.new_axes(1, len(regressors), (style.WIDTH * 1.6, 1.8)) if axes is None else axes
    looks = zip(departure.items(), (style.BLUE, style.GREEN, style.VERMILLION), strict=True)
    drawn = [(name, np.asarray(values, float), colour) for (name, values), colour in looks]
    sizes = {name: float(np.nanmax(np.abs(values), initial=0.0)) for name, values, _ in drawn}
    for ax, (label, regressor) in zip(axes, regressors.items(), strict=True):
        for name, values, colour in drawn:
            if sizes[name] > 1e-6:
                unit = "mrad" if name == "heading" else "mm"
                text = f"{name}, ±{sizes[name]:.3g} {unit}"
                ax.plot(regressor[name], values / sizes[name], color=colour, label=text, rasterized=True, **_DOTS)
        ax.set(ylim=(-1.15, 1.15))
        ax.set_yticks([-1.0, 0.0, 1.0], labels=["−1", "0", "1"] if ax is axes[0] else [])
        ax.set_xlabel(label, labelpad=1.0)
    axes[0].set_ylabel("over its largest", labelpad=1.0)
    axes[0].set_title(title.replace("_", " "), loc="left", fontsize=style.TEXT, fontweight="bold", pad=3.0)
    handles, labels = axes[0].get_legend_handles_labels()
    place: Any = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "ncols": 3, "markerscale": 4.0, "borderpad": 0.0}
    axes[-1].legend(handles, labels, **place, **{**style.LEGEND, "handlelength": 0.8}).set_in_layout(False)
    return axes

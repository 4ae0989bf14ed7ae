"""What was commanded, how the wheels turned, and how the robot moved."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from jaxident.plot import style

SPEEDS = (("speed", "m/s"), ("turn rate", "rad/s"))
"""What the upper two strips show, and its unit."""


def wheel_speeds(
    ground: tuple[Any, Any] | None, rims: tuple[Any, Any], command: tuple[Any, Any], *,
    modelled: Mapping[str, tuple[Any, Any]] | None = None, axes: Any = None,
) -> Any:  # fmt: skip
    """One stretch of a log in three strips: speed [m/s], turn rate [rad/s] and commands [unit] against time [s].

    ground, rims, command, and each model: times (n,) and two rows of values (2, n), which are speed and turn rate by
    the poses, by measured wheel speeds and of the model, and the right and left command. NaN where nothing is known;
    without poses `ground` is None. Returns the three axes.
    """
    axes = style.new_axes(3, 1, (style.WIDTH, 5.0)) if axes is None else axes
    dots: Any = {"color": style.MEASURED, "linestyle": "none", "marker": ".", "markersize": 4.0}
    raster = style.heavy(rims[0])
    for k, (ax, (name, unit)) in enumerate(zip(axes, SPEEDS, strict=False)):
        if ground is not None:
            ax.plot(ground[0], ground[1][k], label="robot (poses)", rasterized=raster, **dots)
        ax.plot(rims[0], rims[1][k], color=style.BLACK, linewidth=style.LINE, label="wheels", rasterized=raster)
        for order, (model, (times, speeds)) in enumerate((modelled or {}).items()):
            colour, _ = style.look_of(model, order)
            ax.plot(times, speeds[k], color=colour, linewidth=style.LINE, label=model)
        ax.set_ylabel(f"{name} [{unit}]")
        ax.margins(x=0.01)
    for u, colour, side in zip(command[1], (style.RIGHT, style.LEFT), ("right", "left"), strict=True):
        axes[2].step(command[0], u, where="post", color=colour, linewidth=style.LINE, label=side)
    axes[2].set_ylabel("command [unit]")
    axes[2].set_xlabel("time [s]")
    axes[2].margins(x=0.01)
    axes[0].figure.align_ylabels(list(np.ravel(axes)))
    style.legend_above(axes[0])
    style.legend_above(axes[2])
    return axes

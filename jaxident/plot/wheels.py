"""What was commanded, how the wheels turned, and how the robot moved."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from jaxident.plot import style

SPEEDS = (("speed", "m/s"), ("turn rate", "rad/s"))


def wheel_speeds(
    t: Any, ground: Any, rims: Any, command: Any, *, modelled: Mapping[str, tuple[Any, Any]] | None = None,
    axes: Any = None,
) -> Any:  # fmt: skip
    """One stretch of a log in three strips: speed [m/s], turn rate [rad/s] and commands [unit] against time [s].

    t, ground (2, n) by the poses, rims (2, n) by measured wheel speeds, command (2, n) right and left: alike in length,
    NaN where nothing is known. modelled: {model: (times (m,), speeds (2, m))}. Returns the three axes.
    """
    axes = style.new_axes(3, 1, (style.WIDTH, 5.0)) if axes is None else axes
    raster = style.heavy(t)
    for k, (ax, (name, unit)) in enumerate(zip(axes, SPEEDS, strict=False)):
        ax.plot(t, ground[k], color=style.MEASURED, linestyle="none", marker=".", markersize=4.0, label="robot (poses)",
                rasterized=raster)  # fmt: skip
        ax.plot(t, rims[k], color=style.BLACK, linewidth=style.LINE, label="wheels", rasterized=raster)
        for order, (model, (times, speeds)) in enumerate((modelled or {}).items()):
            colour, _ = style.look_of(model, order)
            ax.plot(times, speeds[k], color=colour, linewidth=style.LINE, label=model)
        ax.set_ylabel(f"{name} [{unit}]")
        ax.margins(x=0.01)
    for u, colour, side in zip(command, (style.RIGHT, style.LEFT), ("right", "left"), strict=True):
        axes[2].step(t, u, where="post", color=colour, linewidth=style.LINE, label=side)
    axes[2].set_ylabel("command [unit]")
    axes[2].set_xlabel("time [s]")
    axes[2].margins(x=0.01)
    axes[0].figure.align_ylabels(list(np.ravel(axes)))
    style.legend_above(axes[0])
    style.legend_above(axes[2])
    return axes

"""Maps of a study's errors: parameters and axes against camera noise."""

from typing import Any

import numpy as np
import xarray

from jaxident import plot
from jaxident.plot.names import plain, written
from jaxident.report.page import Figure
from jaxident.robot.model import DIFFERENCE_ORDER

MAP_TEXT = (
    "Root-mean-square error in per cent of the parameter's true value; numbers below a map are camera noise [mm]."
)


def entry(summary: xarray.Dataset, axis: str, index: int) -> str:
    """An entry of an axis as text."""
    value = summary[axis].values[index]
    return value if isinstance(value, str) else f"{value:.4g}"


def maps(summary: xarray.Dataset, base: dict[str, int]) -> list[Figure]:
    """For each estimator parameters over noise, and each further axis over noise for the median parameter."""
    share = 100.0 * summary["rmse"] / np.abs(summary["truth"])
    noise = [f"{1e3 * level:.3g}" for level in summary["noise"].values]
    made = []
    for one in map(str, summary["estimator"].values):
        cell = share.sel(estimator=one)
        names = [written(name).symbol for name in DIFFERENCE_ORDER]
        made.append(_map(cell.isel(base).transpose("parameter", "noise").values, names, noise, f"{one}: error [%]"))
        for axis in (axis for axis in base if summary.sizes[axis] > 1):
            rest = {key: k for key, k in base.items() if key != axis}
            middle = cell.isel(rest).median("parameter", skipna=False).transpose(axis, "noise").values
            labels = [plain(entry(summary, axis, k)) for k in range(summary.sizes[axis])]
            made.append(_map(middle, labels, noise, f"{one}: error of the median parameter [%], by {axis}"))
        if "effect" in base:
            made.append(_effect_map(cell, base, one))
    return made


def _effect_map(share: xarray.DataArray, base: dict[str, int], estimator: str) -> Figure:
    """Errors [%] of an estimator by set of effects and parameter, at the middle noise level."""
    middle = share.sizes["noise"] // 2
    rest = {key: k for key, k in (base | {"noise": middle}).items() if key != "effect"}
    values = share.isel(rest).transpose("effect", "parameter").values
    symbols = [written(name).symbol for name in DIFFERENCE_ORDER]
    level = f"{1e3 * float(share['noise'][middle]):.3g} mm of camera noise"
    sets = list(map(plain, share["effect"].values))
    return _map(values, sets, symbols, f"{estimator}: error [%] by effect, at {level}")


def _map(values: Any, rows: list[str], columns: list[str], label: str) -> Figure:
    figure, ax = plot.figure(size=(6.3, 0.6 + 0.27 * max(len(rows), 2)))
    plot.heat_map(values, rows=rows, columns=columns, label=plain(label), ax=ax)
    return Figure(plot.image(figure), label)

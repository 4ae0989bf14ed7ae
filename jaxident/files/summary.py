"""A study's statistics as a table: one row for each cell, estimator and parameter."""

import csv
import itertools
import os
from typing import Any

import numpy as np
import xarray

from jaxident.files.atomic import Target, writing_text
from jaxident.study.statistics import cell_axes

NUMBERS = ("truth", "trials", "failed", "bias", "bias_se", "sd", "sd_se", "rmse", "rmse_se", "coverage", "coverage_se")
"""Columns after the axes of the cells (`effect` where the study has it), estimator and parameter; then come q05 and so
on, the quantiles of the error, and rmse_over_bound where there is a bound."""
OF_CELL, OF_EFFECT = ("all_named", "right", "right_or_alike", "claimed", "false_names"), ("share_named", "takes_part")
"""Numbers of `study.naming`, each followed by its standard error."""


def write_summary(summary: xarray.Dataset, path: Target) -> str:
    """Write the table as CSV, whole or not at all; an empty cell is a number that the trials do not give. Returns the
    path. SI units; _se is the Monte-Carlo standard error of the number before it."""
    bounded = ["rmse_over_bound"] if "rmse_over_bound" in summary else []
    summary = summary.assign(failed=summary["failures"].sum("reason").broadcast_like(summary["rmse"]))
    keys = (*cell_axes(summary), "estimator", "parameter")
    order = {name: summary[name].transpose(*keys).values.ravel() for name in (*NUMBERS, *bounded)}
    shares = summary["quantiles"].transpose(*keys, "quantile").values.reshape(-1, summary.sizes["quantile"])
    titles = [f"q{round(100 * level):02d}" for level in summary["quantile"].values]
    with writing_text(path) as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow([*keys, *NUMBERS, *titles, *bounded])
        for row, key in enumerate(itertools.product(*(summary[key].values for key in keys))):
            numbers = [order[name][row] for name in NUMBERS]
            rest = [*shares[row], *(order[name][row] for name in bounded)]
            table.writerow([*map(_text, key), *map(_text, numbers), *map(_text, rest)])
    return os.fspath(path)


def write_naming(named: xarray.Dataset, cells: Target, effects: Target) -> list[str]:
    """Write what diagnoses name as two tables: one row for each cell and diagnosis, and one for each effect of the
    catalogue that acts or is named there. Returns the paths."""
    keys = (*cell_axes(named), "estimator")
    whole = ("diagnosed", *_with_errors(OF_CELL))
    of_effect = ("in_force", "diagnosed", *_with_errors(OF_EFFECT))
    every = named.assign({name: named[name].broadcast_like(named["share_named"]) for name in ("in_force", "diagnosed")})
    worth = every["in_force"] | (every["share_named"] > 0.0)
    _write_rows(named, keys, whole, cells, xarray.ones_like(named["right"], bool))
    _write_rows(every, (*keys, "catalogue"), of_effect, effects, worth)
    return [os.fspath(cells), os.fspath(effects)]


def _with_errors(names: tuple[str, ...]) -> list[str]:
    return [each for name in names for each in (name, f"{name}_se")]


def _write_rows(table: xarray.Dataset, keys, columns, path: Target, kept: xarray.DataArray) -> None:
    """Rows of a dataset by the entries of some axes, those that are kept."""
    chosen = kept.transpose(*keys).values.ravel()
    values = {name: table[name].transpose(*keys).values.ravel() for name in columns}
    with writing_text(path) as stream:
        out = csv.writer(stream, lineterminator="\n")
        out.writerow(["named_effect" if key == "catalogue" else key for key in keys] + list(columns))
        for row, key in enumerate(itertools.product(*(table[key].values for key in keys))):
            if chosen[row]:
                out.writerow([*map(_text, key), *(_text(values[name][row]) for name in columns)])


def _text(value: Any) -> str:
    if isinstance(value, str):
        return value
    return f"{value:.9g}" if np.isfinite(value) else ""

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


def _text(value: Any) -> str:
    if isinstance(value, str):
        return value
    return f"{value:.9g}" if np.isfinite(value) else ""

"""What a study's trials say: errors with their Monte-Carlo standard errors, coverage, failures, break-down.

With errors e_1 .. e_n of the n trials of a cell that did not fail, their mean m and central moments m2, m4:

    bias = m                        standard error  sqrt(m2 / n)
    sd   = sqrt(n m2 / (n - 1))     standard error  sqrt((m4 - m2^2) / n) / (2 sd)
    rmse = sqrt(mean e^2)           standard error  sqrt(var(e^2) / n) / (2 rmse)
    coverage: share of |e| <= 1.96 deviation        sqrt(c (1 - c) / n)

A failed trial is in none of them; failures are counted by reason.
"""

import warnings
from typing import Any, NamedTuple

import numpy as np
import xarray

from jaxident.array_types import Array
from jaxident.study.design import AXES
from jaxident.study.engine import pieces
from jaxident.study.sight import FOUND, REASONS

LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Quantiles of the error."""

INTERVAL = 1.959963984540054
"""Half width of a 95 % interval in standard deviations."""

BROKEN_ERROR, BROKEN_SHARE = 0.1, 0.1
"""An estimator is broken where the median parameter's error exceeds this part of its value, or as many trials fail."""

NUMBERS = 2_000_000
"""Numbers of a variable read at once."""


class Errors(NamedTuple):
    """Statistics over the trials of cells, each (..., parameters); quantiles (..., parameters, LEVELS)."""

    trials: Any
    bias: Any
    bias_se: Any
    sd: Any
    sd_se: Any
    rmse: Any
    rmse_se: Any
    coverage: Any
    coverage_se: Any
    truth: Any
    quantiles: Any


def cell_axes(arrays: xarray.Dataset) -> tuple[str, ...]:
    """The axes of a study's cells, all but its seeds, in their order: those that its trials or its summary have."""
    return tuple(axis for axis in AXES[:-1] if axis in arrays.dims)


def error_statistics(estimate: Array, deviation: Array, truth: Array) -> Errors:
    """Statistics over the second last axis of arrays (..., trials, parameters); NaN estimates are failures, NaN
    deviations are no interval. What too few trials cannot tell is NaN."""
    error = np.asarray(estimate) - truth
    count = np.sum(np.isfinite(error), axis=-2)
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore", RuntimeWarning)  # means over no trials: NaN is right
        bias = np.nanmean(error, axis=-2)
        centred = error - bias[..., None, :]
        second, fourth = (np.nanmean(centred**power, axis=-2) for power in (2, 4))
        sd = np.where(count > 1, np.sqrt(second * count / (count - 1.0)), np.nan)
        rmse = np.sqrt(np.nanmean(error**2, axis=-2))
        known = np.isfinite(error) & np.isfinite(deviation)
        covered = np.where(known, np.abs(error) <= INTERVAL * deviation, np.nan)
        coverage, intervals = np.nanmean(covered, axis=-2), np.sum(known, axis=-2)
        return Errors(
            count,
            bias,
            sd / np.sqrt(count),
            sd,
            np.where(count > 1, np.sqrt((fourth - second**2) / count) / (2.0 * sd), np.nan),
            rmse,
            np.where(count > 1, np.nanstd(error**2, axis=-2, ddof=1) / np.sqrt(count) / (2.0 * rmse), np.nan),
            coverage,
            np.sqrt(coverage * (1.0 - coverage) / intervals),
            np.mean(truth, axis=-2),
            quantiles(error, LEVELS),
        )


def quantiles(values: np.ndarray, levels: tuple[float, ...]) -> np.ndarray:
    """Quantiles (..., parameters, levels) over the second last axis, NaN left out, by linear interpolation."""
    ordered = np.sort(np.moveaxis(values, -2, -1), axis=-1)  # NaN goes last
    last = np.sum(np.isfinite(ordered), axis=-1, keepdims=True) - 1
    place = np.maximum(last, 0) * np.asarray(levels)
    low = np.floor(place).astype(int)
    below, above = (np.take_along_axis(ordered, np.minimum(k, np.maximum(last, 0)), -1) for k in (low, low + 1))
    return below + (place - low) * (above - below)


def summarise(trials: xarray.Dataset, bound: xarray.DataArray | None = None) -> xarray.Dataset:
    """Summarise a study: all statistics by cell, estimator and parameter, failures by reason, and the break-down.

    Args:
        trials: of `jaxident.study`. They may lie on disk; little of them is read at a time.
        bound: smallest standard deviation possible, such as Cramér and Rao's, on any of the axes of the result.

    Returns:
        xarray.Dataset: bias, root mean square error, quantiles, coverage and more, with `rmse_over_bound` if there is a
            bound. Failed trials count in `failures`, and in no mean.

    Examples:
        >>> import jaxident as ji
        >>> ji.start_jax()
        >>> content = {"seeds": 8, "noise": [1e-5], "robots": [{"model": "published"}], "estimators": ["batch"]}
        >>> trials = ji.study(content)
        >>> ji.summarise(trials).rmse.sel(parameter="alpha_1").squeeze().dims
        ()
    """
    shape = tuple(trials.sizes[axis] for axis in (*cell_axes(trials), "estimator", "parameter"))
    found = {name: np.full(shape, np.nan) for name in Errors._fields[:-1]}
    found["quantiles"] = np.full((*shape, len(LEVELS)), np.nan)
    failures = np.zeros((*shape[:-1], len(REASONS) - 1), int)
    for cut in _parts(shape[:-2], trials.sizes["seed"]):
        for number in range(shape[-2]):
            reason = np.asarray(trials["reason"].variable[(*cut, slice(None), number)])
            failures[(*cut, number)] = np.stack([np.sum(reason == k, -1) for k in range(1, len(REASONS))], -1)
            for columns in _columns(reason.size, shape[-1]):
                arrays = _read(trials, cut, number, columns)
                for name, value in error_statistics(*arrays)._asdict().items():
                    found[name][(*cut, number, columns)] = value
    return _named(trials, found, failures, bound)


def median_error(summary: xarray.Dataset) -> xarray.DataArray:
    """The median over the parameters of rmse / |truth|, 1 for all; NaN where one of them is missing."""
    return (summary["rmse"] / np.abs(summary["truth"])).median("parameter", skipna=False)


def breakdown(summary: xarray.Dataset) -> xarray.DataArray:
    """The lowest noise level [m] from which each estimator is broken in each cell, NaN where none of the levels
    breaks it: median over the parameters of rmse / |truth| above BROKEN_ERROR, or a share of failures above
    BROKEN_SHARE."""
    error = median_error(summary)
    failed = summary["failures"].sum("reason") / summary.attrs["seeds"]
    broken = ~(error <= BROKEN_ERROR) | (failed > BROKEN_SHARE)
    ordered = broken.sortby("noise")
    levels = ordered["noise"].broadcast_like(ordered)
    first = levels.where(ordered).min("noise", skipna=True)
    return first.assign_attrs(units="m", long_name="lowest camera noise that breaks the estimator")


def _parts(shape: tuple[int, ...], seeds: int) -> list[tuple[Any, ...]]:
    """Cells read together: whole axes from the last one on."""
    room, sizes = max(1, NUMBERS // (12 * seeds)), []
    for length in reversed(shape):
        size = max(1, min(length, room))
        room = room // size if size == length else 1
        sizes.append(size)
    return [piece.cut for piece in pieces(shape, tuple(reversed(sizes)))]


def _columns(trials: int, parameters: int) -> list[slice]:
    """Parameters read together."""
    size = min(parameters, max(1, NUMBERS // trials))
    return [slice(k, min(k + size, parameters)) for k in range(0, parameters, size)]


def _read(trials: xarray.Dataset, cut: tuple[slice, ...], number: int, columns: slice) -> list[np.ndarray]:
    """Estimates, deviations and truth (cells..., seeds, parameters) of one estimator."""
    estimate, deviation = (
        np.asarray(trials[name].variable[(*cut, slice(None), number, columns)]) for name in ("estimate", "deviation")
    )
    return [estimate, deviation, np.asarray(trials["truth"].variable[(*cut, slice(None), columns)])]


def _named(trials: xarray.Dataset, found: dict[str, Any], failures: Any, bound: Any) -> xarray.Dataset:
    axes = (*cell_axes(trials), "estimator", "parameter")
    named = {name: ((*axes, "quantile") if name == "quantiles" else axes, value) for name, value in found.items()}
    summary = xarray.Dataset({**named, "failures": ((*axes[:-1], "reason"), failures)})
    summary = summary.assign_coords({n: c for n, c in trials.coords.items() if "seed" not in c.dims})
    summary = summary.assign_coords(quantile=list(LEVELS), reason=list(REASONS[FOUND + 1 :]))
    summary = summary.assign_attrs(trials.attrs, seeds=trials.sizes["seed"])
    summary["breakdown"] = breakdown(summary)
    if bound is not None:
        summary["rmse_over_bound"] = summary["rmse"] / bound
    return summary

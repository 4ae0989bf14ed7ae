"""The page of `jaxident sweep`."""

import json
import math
import os

import numpy as np
import xarray

from jaxident import plot
from jaxident.files.atomic import Target
from jaxident.plot.names import plain
from jaxident.plot.studies import Curve
from jaxident.report.glossary import glossary
from jaxident.report.naming import naming_lead, naming_sections
from jaxident.report.page import PHONE, Figure, Page, Section, Table, write_page
from jaxident.report.sweep_maps import MAP_TEXT, entry, maps
from jaxident.report.words import number
from jaxident.robot.model import DIFFERENCE_ORDER, require_physical
from jaxident.study.design import Study
from jaxident.study.estimators import BEST, settings_of
from jaxident.study.statistics import BROKEN_ERROR, BROKEN_SHARE, cell_axes, median_error

SHOWN = ("alpha_1", "alpha_2", "delta_21", "dead_zone_r")
HISTOGRAM_TRIALS = 10_000
LISTED = 60
"""Rows that a table of the page shows; the rest stands in summary.csv."""


def write_study(
    study: Study, trials: xarray.Dataset, summary: xarray.Dataset, path: Target, named: xarray.Dataset | None = None
) -> list[str]:
    """Write the page of a study, with what diagnoses `named`, if any; returns its path. Of the trials it reads one
    cell."""
    write_page(_page(study, trials, summary, named), path)
    return [os.fspath(path)]


def _page(study: Study, trials: xarray.Dataset, summary: xarray.Dataset, named: xarray.Dataset | None) -> Page:
    base = {axis: 0 for axis in cell_axes(summary) if axis != "noise"}
    sections = [
        *naming_sections(named),
        Section("Failures and break-down", [_breakdown_text(), _breakdown_table(summary)]),
        Section("Error against noise", [_where(summary, base), *(_curves(summary, base, name) for name in SHOWN)]),
        Section("Maps", [MAP_TEXT, *maps(summary, base)]),
        Section("Distributions", [_histogram(study, trials, summary, name) for name in SHOWN]),
        Section("All numbers", [_numbers(summary.isel(base))], folded=True),
        glossary("bias", "coverage", "interval", "Monte-Carlo error", "root mean square"),
    ]
    versions = ", ".join(f"{name} {found}" for name, found in json.loads(trials.attrs["versions"]).items())
    lead = f"{naming_lead(named)}{_finding(summary)} {_counts(study, summary)}"
    closing = f"Seed {study.seed}; {versions}."
    return Page(study.name, lead, sections, closing, what_next(study, summary), _break_down(summary))


def _break_down(summary: xarray.Dataset) -> Figure:
    """How the error of each estimator grows with the camera's noise, over all cells."""
    error = median_error(summary).transpose("estimator", ..., "noise")
    levels = summary.sizes["noise"]
    curves = {plain(str(one)): error.sel(estimator=one).values.reshape(-1, levels) for one in error["estimator"].values}
    figure, ax = plot.figure(size=(PHONE, 3.2))
    plot.break_down(summary["noise"].values, curves, broken=BROKEN_ERROR, ax=ax)
    cells = error[0].size // levels
    spread = f" Lines: the middle of {cells} cells; fields: from the best to the worst." if cells > 1 else ""
    return Figure(plot.image(figure), "Error of each estimator against camera noise", f"{MEDIAN}{spread}")


MEDIAN = "Root-mean-square error of the median parameter, in per cent of the parameter."


def what_next(study: Study, summary: xarray.Dataset) -> str:
    """Failures first; then the estimator or the setting that this study lacks; then single trials."""
    failed = int(summary["failures"].sum())
    if failed:
        return f"Find out why {failed} estimates failed: the table below counts them by reason. {SINGLE}"
    if study.diagnoses:
        return SINGLE
    best = [choice.name for choice in study.estimators if choice.method == BEST]
    blind = [one.name for one in study.estimators if one.method == BEST and not settings_of(one)["coupling"]]
    if "rmse_over_bound" not in summary or not ((blind and coupled(study)) or not best):
        return SINGLE
    errors = summary["rmse_over_bound"]
    times = float((errors.sel(estimator=blind) if best else errors).median(skipna=True))
    if not times > FAR:
        return SINGLE
    setting = " with `settings = { coupling = true }`" if coupled(study) else ""
    return (
        f"These errors are {number(times)} times the least that the logs allow (the Cramér-Rao bound; median). "
        f'Take `method = "{BEST}"`{setting}: it comes near the bound.'
    )


def coupled(study: Study) -> bool:
    """Whether a robot of the study has speeds that change each other."""
    pairs = [require_physical(candidate.model).coupling for candidate in study.robots]
    return any(pair is not None and np.any(np.asarray(pair) != 0.0) for pair in pairs)


FAR = 2.0
"""Times the Cramér-Rao bound from which another estimator is worth a try. Chosen, not measured: that of maximum
likelihood stays near 1."""
SINGLE = "Look at single trials: `jaxident sweep STUDY.toml --trial 0 --out trial` draws one with its log."


def _finding(summary: xarray.Dataset) -> str:
    """How much camera noise each estimator bears, over all cells."""
    told, most = [], 1e3 * float(summary["noise"].max())
    for one in map(str, summary["estimator"].values):
        levels = 1e3 * summary["breakdown"].sel(estimator=one).values.ravel()
        broken = levels[np.isfinite(levels)]
        if not broken.size:
            told.append(f"{one} bears all camera noise that was tried, up to {most:.4g} mm")
            continue
        span = " to ".join(f"{level:.4g}" for level in sorted({broken.min(), broken.max()}))
        some = f" in {broken.size} of {levels.size} cases" if broken.size < levels.size else ""
        told.append(f"{one} is broken from {span} mm of camera noise on{some}")
    return f"{'; '.join(told)}."


def _counts(study: Study, summary: xarray.Dataset) -> str:
    failed = int(summary["failures"].sum())
    every = study.trials * len(study.estimators)
    axes = ", ".join(f"{n} {_plural(axis, n)}" for axis, n in zip(study.axes, study.shape, strict=True) if n > 1)
    runs = f" of {study.runs} runs each" if study.runs > 1 else ""
    return f"{study.trials} trials{runs} ({axes or 'one each'}), {every} estimates, {failed} of them failed."


def _plural(axis: str, count: int) -> str:
    words = {"samples": "run lengths", "noise": "noise levels", "effect": "sets of effects"}
    return words.get(axis, f"{axis}s") if count > 1 else axis


def _breakdown_text() -> str:
    return (
        f"An estimator is called broken where the root-mean-square error of its median parameter exceeds "
        f"{100 * BROKEN_ERROR:g} % of the parameter, or where more than {100 * BROKEN_SHARE:g} % of its trials fail. "
        "A failed trial is counted here and is in no other number."
    )


def _breakdown_table(summary: xarray.Dataset) -> Table:
    """A row for each estimator and cell but for the noise: break-down level and failures by reason."""
    failures = summary["failures"].sum("noise")
    axes = [axis for axis in (*cell_axes(summary), "estimator") if axis != "noise"]
    told = [axis for axis in axes if axis == "estimator" or summary.sizes[axis] > 1]
    level = summary["breakdown"].transpose(*axes)
    reasons = [str(name) for name in summary["reason"].values if int(failures.sel(reason=name).sum())]
    rows = []
    for index in list(np.ndindex(level.shape))[:LISTED]:
        at = dict(zip(axes, index, strict=True))
        value = float(level[at])
        told_level = "none of these" if math.isnan(value) else f"{1e3 * value:.4g} mm"
        counts = [int(failures.isel(at).sel(reason=name)) for name in reasons]
        rows.append((*(entry(summary, axis, at[axis]) for axis in told), told_level, *counts))
    more = f" The first {LISTED} of {level.size}." if level.size > LISTED else ""
    return Table((*told, "broken from", *reasons), rows, f"Lowest camera noise that breaks the estimator.{more}")


def _where(summary: xarray.Dataset, at: dict[str, int]) -> str:
    """Which cell is shown, of the axes that have several."""
    told = [f"{axis} {entry(summary, axis, k)}" for axis, k in at.items() if summary.sizes[axis] > 1]
    return f"Shown for {', '.join(told)}; summary.csv has all." if told else "Over all seeds."


def _curves(summary: xarray.Dataset, at: dict[str, int], name: str) -> Figure:
    cell = summary.isel(at).sel(parameter=name)
    curves = {
        plain(str(one)): Curve(*(cell[part].sel(estimator=one).values for part in Curve._fields))
        for one in summary["estimator"].values
    }
    bound = None
    if "rmse_over_bound" in cell:
        bound = (cell["rmse"] / cell["rmse_over_bound"]).isel(estimator=0).values
    figure, ax = plot.figure(size=(PHONE, 3.4))
    plot.error_curves(summary["noise"].values, curves, label=name, ax=ax, bound=bound)
    return Figure(plot.image(figure), f"Error of {name} against camera noise")


def _histogram(study: Study, trials: xarray.Dataset, summary: xarray.Dataset, name: str) -> Figure:
    """The errors of a parameter in the first cell, at the middle noise level."""
    middle = len(study.noise) // 2
    at = {axis: middle if axis == "noise" else 0 for axis in cell_axes(summary)}
    cut = (*at.values(), slice(0, HISTOGRAM_TRIALS))
    column = DIFFERENCE_ORDER.index(name)
    truth = np.asarray(trials["truth"].variable[(*cut, column)])
    estimates = np.asarray(trials["estimate"].variable[(*cut, slice(None), column)])
    errors = {plain(choice.name): estimates[:, k] - truth for k, choice in enumerate(study.estimators)}
    bound = None
    if "rmse_over_bound" in summary:
        cell = summary.isel(at).sel(parameter=name)
        bound = float((cell["rmse"] / cell["rmse_over_bound"]).isel(estimator=0))
    figure, ax = plot.figure(size=(PHONE, 2.8))
    plot.error_histogram(errors, label=name, ax=ax, bound=bound)
    level = f"{1e3 * study.noise[middle]:.4g} mm"
    return Figure(plot.image(figure), f"Errors of {name}", f"Errors of {name} at {level} of camera noise.")


def _numbers(cell: xarray.Dataset) -> Table:
    """Bias, deviation, error and coverage of the shown cell."""
    rows = []
    for one, level in ((o, n) for o in cell["estimator"].values for n in range(cell.sizes["noise"])):
        at = cell.sel(estimator=one).isel(noise=level)
        for k, name in enumerate(DIFFERENCE_ORDER):
            values = [float(at[part][k]) for part in ("bias", "bias_se", "sd", "rmse", "rmse_se", "coverage")]
            rows.append((str(one), f"{1e3 * float(at['noise']):.3g}", name, *values))
    titles = ("estimator", "noise [mm]", "parameter", "bias", "± bias", "sd", "rmse", "± rmse", "coverage")
    more = f" The first {LISTED} of {len(rows)}; all stand in summary.csv." if len(rows) > LISTED else ""
    return Table(titles, rows[:LISTED], f"± is the Monte-Carlo standard error; SI units.{more}")

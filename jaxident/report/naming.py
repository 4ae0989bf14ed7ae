"""The part of a study's page on what its diagnoses name."""

import numpy as np
import xarray

from jaxident import plot
from jaxident.plot.names import plain
from jaxident.report.page import NOTHING, PHONE, Figure, Section, Table
from jaxident.report.sweep_maps import entry
from jaxident.study.statistics import cell_axes

LEVELS = {
    "noise": ("camera noise in position [mm]", 1e3), "samples": ("rows of a run", 1.0),
    "amplitude": ("largest command [unit]", 1.0), "period": ("sample period [s]", 1.0),
}  # fmt: skip
"""Axes of numbers, the first of which with several levels is drawn: what it is called, and the factor of its unit."""
MOST_LINES, MOST_COLUMNS, MOST_ROWS = 5, 14, 24
"""Of a picture: more cannot be told apart, or read."""
FEW_COLUMNS = 6
"""Of a picture that a phone shows whole."""
SHARES = ("all_named", "right", "right_or_alike", "claimed")
LISTED = 60
"""Rows of the table; naming.csv has all."""
TEXT = (
    "A diagnosis of each trial's log names the effects that it finds. Right: it names all effects that act, and no "
    "other, each under its own name. Or alike: a wrong name counts, too, where the diagnosis says that it cannot tell "
    "that effect from the one that acts. Claimed: it says that something acts that the nominal model has not. Logs "
    "that were refused count nowhere here."
)
CAPTION = (
    "Per cent of trials in which an effect is named, all else averaged. Rows: what acts; framed fields: the effects "
    "that do. Every other number is a wrong name."
)


def naming_sections(named: xarray.Dataset | None) -> list[Section]:
    """The section on names; none for a study without diagnoses."""
    if named is None:
        return []
    return [Section("What the diagnoses name", [TEXT, *_matrices(named), *_curves(named), _table(named)])]


def naming_lead(named: xarray.Dataset | None) -> str:
    """How many diagnoses are right, over all cells; nothing of a study without."""
    if named is None:
        return ""
    told = []
    for one in map(str, named["estimator"].values):
        at = named.sel(estimator=one)
        count, weight = int(at["diagnosed"].sum()), at["diagnosed"] / max(int(at["diagnosed"].sum()), 1)
        right, alike, false = (
            round(float((at[n] * weight).sum()) * count) for n in ("right", "right_or_alike", "false_names")
        )
        told.append(f"{one} is right in {right} of {count} trials ({alike} with look-alikes); {false} names are wrong")
    return f"{'; '.join(told)}. "


def _sets(named: xarray.Dataset) -> str:
    """The axis of what acts."""
    return "effect" if "effect" in named.dims else "robot"


def _matrices(named: xarray.Dataset) -> list[Figure]:
    """For each diagnosis shares of names by what acts, over all else."""
    axis, made = _sets(named), []
    others = [one for one in cell_axes(named) if one != axis]
    there = named["in_force"].any([one for one in others if one in named["in_force"].dims]).values
    for one in map(str, named["estimator"].values):
        shares = named["share_named"].sel(estimator=one).mean(others).transpose(axis, "catalogue").values
        order = np.argsort(~there.any(axis=0) * 10.0 - np.nan_to_num(shares).max(axis=0), kind="stable")
        kept = [k for k in order if there[:, k].any() or np.nan_to_num(shares[:, k]).max() > 0.0][:MOST_COLUMNS]
        rows = list(map(plain, named[axis].values))[:MOST_ROWS]
        if not kept:
            continue
        figure, ax = plot.figure(size=(PHONE if len(kept) <= FEW_COLUMNS else 6.3, 1.5 + 0.3 * len(rows)))
        names = list(map(plain, named["catalogue"].values[kept]))
        plot.name_matrix(shares[:MOST_ROWS, kept], there[:MOST_ROWS, kept], rows=rows, columns=names, ax=ax)
        made.append(Figure(plot.image(figure), f"{one}: share of trials in which each effect is named", CAPTION))
    return made


def _curves(named: xarray.Dataset) -> list[Figure]:
    """Shares of right diagnoses against the first axis of numbers that has several levels."""
    along = next((axis for axis in LEVELS if named.sizes[axis] > 1), None)
    if along is None:
        return []
    axis, (label, factor), made = _sets(named), LEVELS[along], []
    others = [one for one in cell_axes(named) if one not in (axis, along)]
    cells = int(np.prod([named.sizes[one] for one in others]))
    for one in map(str, named["estimator"].values):
        at = named.sel(estimator=one)
        curves = {
            plain(str(each)): (at["right"].sel({axis: each}).mean(others).values,
                               np.sqrt((at["right_se"].sel({axis: each}) ** 2).sum(others).values) / cells)
            for each in named[axis].values[:MOST_LINES]
        }  # fmt: skip
        figure, ax = plot.figure(size=(PHONE, 3.2))
        plot.share_curves(factor * named[along].values, curves, xlabel=label, ylabel="right diagnoses [%]", ax=ax)
        first = f" The first {MOST_LINES} of {named.sizes[axis]}." if named.sizes[axis] > MOST_LINES else ""
        made.append(Figure(plot.image(figure), f"{one}: share of right diagnoses by {label}",
                           f"Bars: one standard error.{first}"))  # fmt: skip
    return made


def _table(named: xarray.Dataset) -> Table:
    """A row for each cell and diagnosis."""
    keys = (*cell_axes(named), "estimator")
    told = [key for key in keys if named.sizes[key] > 1 or key == _sets(named)]
    values = {name: named[name].transpose(*keys).values for name in named if "catalogue" not in named[name].dims}
    rows = []
    for index in list(np.ndindex(values["right"].shape))[:LISTED]:
        at = {name: float(value[index]) for name, value in values.items()}
        shares = [_with_error(100 * at[name], 100 * at[f"{name}_se"], 0) for name in SHARES]
        wrong = _with_error(at["false_names"], at["false_names_se"], 2)
        cell = [entry(named, key, index[keys.index(key)]) for key in told]
        rows.append((*cell, int(at["diagnosed"]), *shares, wrong))
    titles = (*told, "diagnosed", "all named", "right", "or alike", "claimed", "wrong names a trial")
    more = f" The first {LISTED} of {values['right'].size}." if values["right"].size > LISTED else ""
    return Table(titles, rows, f"Shares in per cent, ± one standard error.{more}")


def _with_error(value: float, error: float, digits: int) -> str:
    """A mean with its standard error, which a single trial does not give; a dash for what no trial gives."""
    if np.isnan(value):
        return NOTHING
    return f"{value:.{digits}f}" + ("" if np.isnan(error) else f" ± {error:.{digits}f}")

"""The page of `jaxident diagnose`: how large the gap is, where it lies, what causes it, how far it shrinks."""

from importlib.metadata import version

import numpy as np

from jaxident import plot
from jaxident.diagnosis.account.shrink import interval
from jaxident.diagnosis.decide import DIFFERENT
from jaxident.diagnosis.diagnose import Diagnosis
from jaxident.diagnosis.preparation.judging import CHANNELS
from jaxident.origin import Origin
from jaxident.report import causes, words
from jaxident.report.account import account_section
from jaxident.report.discovered import discovered
from jaxident.report.glossary import glossary
from jaxident.report.lead import details, deviations, headline
from jaxident.report.motor_or_ground import motor_or_ground
from jaxident.report.origin import origin_section
from jaxident.report.page import PHONE, Figure, Page, Section, Table
from jaxident.report.stretches import served, worst_stretches
from jaxident.report.words import (
    NOMINAL,
    SITES,
    SPACE,
    VARIABLES,
    angle,
    chance,
    length,
    measured,
    number,
    percent,
    together,
)

LISTED = 12
"""Regions that the table shows."""
WORDS = (
    *("account", "camera variance", "corrected model", "effect", "excess", "floor", "gain of an effect", "gap"),
    *("horizon", "interval", "nominal model", "root mean square", "slip", "start not known better"),
)


def diagnosis_page(found: Diagnosis, name: str, made: Origin | None = None) -> Page:
    """The page of one diagnosis; `name` says of what, such as the logs' folder, and `made` by which command."""
    sections = [
        account_section(found.account, details(found)),
        *worst_stretches(found),
        *motor_or_ground(found),
        _gap(found),
        _where(found),
        causes.causes(found),
        *discovered(found),
        causes.shrink(found),
        _parameters(found),
        causes.hidden(found),
        served(found),
        glossary(*WORDS),
        *origin_section(made),
    ]
    return Page(f"Diagnosis of {name}", headline(found), sections, f"jaxident {version('jaxident')}", found.next)


def _gap(found: Diagnosis) -> Section:
    """The errors of the models before and after, of all channels and of each, against the floor."""
    gap = found.gap
    levels, intervals = {}, {}
    for label, errors in zip(names := _models(found), np.asarray(gap.errors), strict=True):
        kept = errors[np.isfinite(errors).all(axis=1)]
        if label and len(kept):
            channels = [kept, *(kept[:, [k]] for k in range(len(CHANNELS)))]
            levels[label] = [float(np.mean(part)) for part in channels]
            intervals[label] = [interval(part) for part in channels]
    if not levels:
        return Section("How large the gap is", ["No stretch of the logs is left to judge by."])
    floor = [gap.floor, *np.mean(gap.noise.total / gap.unit, axis=0).tolist()]
    rows = ("all channels", *CHANNELS)
    figure, ax = plot.figure(size=(PHONE, 2.9))
    plot.gap_levels(levels, floor, rows=rows, intervals=intervals, floor_interval=gap.floor_interval, ax=ax)
    picture = Figure(plot.image(figure), "Error of each model by channel, against the floor", GAP_CAPTION)
    sizes = dict(zip((*names, "floor"), (gap.rms[key] for key in RMS), strict=True))
    cells = [
        (name, length(sizes[name][0]), angle(sizes[name][1]), *(float(f"{value:.3g}") for value in values))
        for name, values in (levels | {"floor": floor}).items()
    ]
    with_effects = f" The corrected model has {together(selected)}." if (selected := found.finding.selected) else ""
    table = Table(("model", "position", "heading", *rows), cells,
                  f"Root mean square errors, then mean squares in camera variances.{with_effects}")  # fmt: skip
    return Section("How large the gap is", [GAP.format(horizon=gap.horizon), picture, table])


RMS = ("before", "refitted", "after", "discovered", "floor")
"""Keys of `Gap.rms` in the order of the table."""


def _models(found: Diagnosis) -> tuple[str, str, str, str]:
    """Names of the models before, refitted, after and with discovered laws; empty where one is the same as another."""
    given = any(p.nominal is not None for p in found.parameters)
    after = "with named effects" if found.discovered else "corrected model"
    last = "with discovered laws" if found.discovered else ""
    named = after if found.finding.selected else ""
    return "as given" if given else "", "parameters refitted" if given else "nominal model", named, last


GAP = (
    "From the first poses of each stretch of a run the model predicts {horizon:.3g} s ahead. The error is measured in "
    "units of the camera's own variance: 1 is an error as large as the camera's. Along is in the direction of travel, "
    "lateral sideways. Only stretches that took no part in any fit count."
)
GAP_CAPTION = (
    f"Points: mean with 90{SPACE}% interval. Black bars: the floor, what noise alone would leave; grey: its "
    f"90{SPACE}% interval. A gap is what lies above."
)


def _where(found: Diagnosis) -> Section:
    """Channels, the map, the regions that stand out, and the sites."""
    place, largest = found.where, found.prepared.largest
    beyond = any(share > 0.0 for share in place.excess.values())
    if beyond:
        text = f"Of the nominal model's error beyond the floor, parameters refitted, {_shares(place.excess)}."
    else:
        text = "The nominal model's error does not lie above the floor in any channel."
    moving = [name for name in found.selected if name in found.finding.selected]
    if moving and place.channels != place.excess:
        text += f" Of the movement due to {together(moving)}, all else alike, {_shares(place.channels)}."
    blocks: list = [text]
    if place.table and beyond:
        blocks += [MAP, _map(found)]
    rows = [
        (_variable(region.variable), *(_scaled(end, region.variable, largest) for end in (region.low, region.high)),
         percent(region.share), f"{region.p_value:.2g}")
        for region in place.regions[:LISTED]
    ]  # fmt: skip
    more = f" The first {LISTED} of {len(place.regions)}." if len(place.regions) > LISTED else ""
    table = Table(("variable", "from", "to", "share of excess", "probability by chance"), rows,
                  f"Regions that stand out from the rest; five in a hundred may be false.{more}")  # fmt: skip
    blocks.append(table if rows else "No region stands out from the rest.")
    sites = [(site, SITES[site], chance(p)) for site, p in found.judgement.sites.items()]
    blocks.append(Table(("site", "what it is", "takes part"), sites, "Where in the robot the cause lies."))
    return Section("Where it lies", blocks)


def _shares(channels: dict[str, float]) -> str:
    return ", ".join(f"{percent(share)} is {words.CHANNELS[name]}" for name, share in channels.items())


MAP = (
    "The map: each row sorts the stretches by one thing that the robot did, into bins equally full. Bright bins are "
    "where the nominal model errs beyond the floor; framed ones stand out more than chance allows."
)


def _map(found: Diagnosis) -> Figure:
    table, marked, largest = {}, set(), found.prepared.largest
    standing = {(region.variable, region.low) for region in found.where.regions}
    for variable, (edges, means) in found.where.table.items():
        label = _variable(variable)
        table[label] = [_scaled(edge, variable, largest) for edge in edges], means
        marked |= {(label, k) for k, edge in enumerate(edges[:-1]) if (variable, float(edge)) in standing}
    figure, ax = plot.figure(size=(6.3, 0.9 + 0.27 * len(table)))
    plot.gap_map(table, marked=marked, label="mean squared error beyond the floor [camera variances]", ax=ax)
    return Figure(plot.image(figure), "Mean excess error by what the robot was doing")


def _variable(name: str) -> str:
    meaning, unit, _ = VARIABLES.get(name, (name, "", 0))
    return f"{meaning} [{unit}]" if unit else meaning


def _scaled(value: float, name: str, largest: float) -> float:
    """A bin's edge in the user's unit; the diagnosis has commands over their largest."""
    return float(value) * largest ** VARIABLES.get(name, ("", "", 0))[2]


def _parameters(found: Diagnosis) -> Section:
    """The nominal parameters as given and as refitted."""
    given = any(p.nominal is not None for p in found.parameters)
    rows = []
    for p in found.parameters:
        meaning, unit = NOMINAL.get(p.name, ("", ""))
        value = measured(p.refitted, p.standard_deviation)
        apart = (number(p.nominal), value, float(f"{deviations(p):.2g}")) if given else (value,)
        rows.append((p.name, meaning, unit, *apart))
    middle = ("given", "refitted", "apart [sd]") if given else ("identified",)
    notes = ["± is a standard deviation (sd)."]
    if found.finding.selected:
        notes.append(f"Fitted together with {together(found.finding.selected)}.")
    if given:
        notes.append(f"From {DIFFERENT:g} sd on, given and refitted differ.")
    return Section("Parameters", [Table(("parameter", "what it is", "unit", *middle), rows, " ".join(notes))])

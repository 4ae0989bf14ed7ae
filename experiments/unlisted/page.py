"""A page of what was discovered in robots with hidden effects: a section for each kind, with the first robot's laws."""

import pathlib

import numpy as np

from jaxident import plot
from jaxident.effects.law_kinds import TURNING
from jaxident.report.page import Figure, Page, Section, Table, write_page
from jaxident.robot.model import Discovered

from .measure import achieved
from .robots import KINDS

LEAD = (
    "Each robot hides one effect that no catalogue lists. A diagnosis saw six runs of it; four fresh runs then tell "
    "how much of the error 1 s ahead the corrected model takes away."
)
ERRORS = ("nominal", "corrected", "known")


def write(rows: list[dict], path: pathlib.Path) -> None:
    """The page of some rows of `experiments.unlisted`."""
    kinds = [kind for kind in KINDS if any(row["kind"] == kind for row in rows)]
    sections = [_section(kind, [row for row in rows if row["kind"] == kind]) for kind in kinds]
    write_page(Page("What no catalogue lists", LEAD, sections, f"{len(rows)} robots"), path)


def _section(kind: str, rows: list[dict]) -> Section:
    rows = sorted(rows, key=lambda row: row["seed"])
    cells = [
        (str(row["seed"]), ", ".join(row["named"]) or "nothing", *(f"{row[key]:.3g}" for key in ERRORS),
         f"{100 * achieved(row):.0f} %" if np.isfinite(achieved(row)) else "nothing to take", str(len(row["laws"])))
        for row in rows
    ]  # fmt: skip
    table = Table(("robot", "named", "nominal", "corrected", "robot known", "taken away", "laws"), cells)
    return Section(f"{kind}: {KINDS[kind]}", [*(_figure(law) for law in rows[0]["laws"]), table])


def law_of(law: dict) -> Discovered:
    """A law as `diagnosis.json` tells it."""
    signals = [name for name in law["inputs"] if name != law["times"]]
    points = law["curve"]
    at = np.unique([point["at"] for point in points])
    value, deviation = (np.array([point[key] for point in points]) for key in ("value", "standard_deviation"))
    if len(signals) == 1:
        turning = {key: law[key] for key in TURNING}
        return Discovered(law["acts_on"], law["times"], *signals, at, value, deviation, **turning)
    second = np.unique([point["second_at"] for point in points])
    shape = len(at), len(second)
    return Discovered(law["acts_on"], law["times"], signals[0], at, value.reshape(shape), deviation.reshape(shape),
                      signals[1], second)  # fmt: skip


def _figure(told: dict) -> Figure:
    law = law_of(told)
    figure, ax = plot.figure(size=(6.3, 4.2 if law.second_signal else 2.2))
    plot.discovered(law, told["rows"], ax=ax)
    like = told["looks_like"]
    numbers = "" if like is None else ", ".join(f"{key} = {value:.3g}" for key, value in like["parameters"].items())
    times = "" if law.times == "1" else f"{law.times} times "
    caption = "No simple form." if like is None else f"Looks like {times}{like['form']}, {numbers}."
    return Figure(plot.image(figure), f"{law.acts_on} by {law.signal}", caption)

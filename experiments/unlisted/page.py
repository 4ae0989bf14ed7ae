"""A page of what was discovered in robots with hidden effects: a section for each kind, with the first robot's laws."""

import math
import pathlib
import textwrap

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
    sections = [_section(kind, [row for row in rows if row["kind"] == kind]) for kind in _kinds(rows)]
    write_page(Page("What no catalogue lists", LEAD, sections, f"{len(rows)} robots"), path)


def picture(rows: list[dict], path: pathlib.Path) -> None:
    """One picture of the first law of the first robot of each kind that has one."""
    first = [next(row for row in sorted(rows, key=_seed) if row["kind"] == kind) for kind in _kinds(rows)]
    shown = [row for row in first if row["laws"]]
    lines = math.ceil(len(shown) / 2)
    figure, axes = plot.figure(lines, 2, size=(11.0, 3.1 * lines))
    for ax in axes.flat[len(shown) :]:
        ax.axis("off")
    for row, ax in zip(shown, axes.flat, strict=False):
        law = row["laws"][0]
        plot.discovered(law_of(law), law["rows"], ax=ax)
        words = textwrap.fill(KINDS[row["kind"]].rstrip("."), 50)
        ax.set_title(f"{words}\n{100 * achieved(row):.0f} % of the error taken away", fontsize="medium")
    path.write_bytes(plot.image(figure))


def _seed(row: dict) -> int:
    return row["seed"]


def _kinds(rows: list[dict]) -> list[str]:
    """Kinds that some rows have, in the order of KINDS."""
    return [kind for kind in KINDS if any(row["kind"] == kind for row in rows)]


def _section(kind: str, rows: list[dict]) -> Section:
    rows = sorted(rows, key=_seed)
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

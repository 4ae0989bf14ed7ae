"""The confusion matrix and the reliability of probabilities as pictures, the table as text."""

import pathlib
from typing import Any

import numpy as np

import jaxident as ji
from jaxident.effects import CATALOGUE

from .calibration import reliability
from .intervals import wilson
from .marks import NAMING

VERDICTS = ("no_gap", "parameters", "unknown", "undecided", "failed")


def confusion(pairs: list[tuple[str, str]], path: pathlib.Path) -> None:
    """pairs: what was hidden, what was said; a row for each of the first, shares of its cases as shades, counts as
    numbers."""
    hidden = sorted({a for a, _ in pairs}, key=_place)
    said = sorted({b for _, b in pairs} | set(hidden) & set(CATALOGUE), key=_place)
    counts = np.zeros((len(hidden), len(said)))
    for a, b in pairs:
        counts[hidden.index(a), said.index(b)] += 1
    figure, ax = ji.plot.figure(1, 1, size=(1.5 + 0.27 * len(said), 1.5 + 0.22 * len(hidden)))
    ax.grid(visible=False)
    ax.imshow(counts / np.maximum(counts.sum(axis=1, keepdims=True), 1), cmap="Blues", vmin=0, vmax=1, aspect="auto")
    for a, b in np.argwhere(counts > 0):
        strong = counts[a, b] > 0.5 * counts[a].sum()
        ax.text(b, a, f"{counts[a, b]:.0f}", ha="center", va="center", fontsize=7, color="white" if strong else "black")
    ax.set_xticks(range(len(said)), said, rotation=90, fontsize=7)
    ax.set_yticks(range(len(hidden)), hidden, fontsize=7)
    ax.set_xlabel("said")
    ax.set_ylabel("hidden")
    ji.plot.save(figure, path)


def said(mark: dict[str, Any]) -> str:
    """What a diagnosis says in one word: the first effect, or the verdict."""
    return mark["selected"][0] if mark["verdict"] in NAMING and mark["selected"] else mark["verdict"]


def reliable(tops: np.ndarray, path: pathlib.Path) -> None:
    """Share right against probability, with 95 % intervals."""
    figure, ax = ji.plot.figure(1, 1, size=(3.4, 3.2))
    ax.plot([0, 1], [0, 1], color="0.7", linewidth=1)
    for p, right, count in reliability(tops):
        low, high = wilson(round(right * count), count)
        ax.errorbar(p, right, [[max(right - low, 0)], [max(high - right, 0)]], fmt="o", color="C0", markersize=4)
        ax.annotate(str(count), (p, right), textcoords="offset points", xytext=(5, -8), fontsize=7)
    ax.set_xlabel("probability of the first hypothesis")
    ax.set_ylabel("share right")
    ji.plot.save(figure, path)


def text(tables: dict[str, list[dict]]) -> str:
    """The table of all methods in Markdown: value, 95 % interval, cases."""
    methods = list(tables)
    labels = list(dict.fromkeys(row["row"] for rows in tables.values() for row in rows))
    goals = {row["row"]: row["goal"] for rows in tables.values() for row in rows}
    lines = [f"| | {' | '.join(methods)} | goal |", "|---" * (len(methods) + 2) + "|"]
    for label in labels:
        cells = [_cell(next((row for row in tables[name] if row["row"] == label), None)) for name in methods]
        lines.append(f"| {label} | {' | '.join(cells)} | {goals[label]} |")
    return "\n".join(lines) + "\n"


def _cell(row: dict | None) -> str:
    if row is None or row["value"] is None:
        return ""
    return f"{row['value']:.3g} ({row['interval'][0]:.3g} to {row['interval'][1]:.3g}; {row['cases']})"


def _place(name: str) -> tuple[int, str]:
    names = ["none", *CATALOGUE]
    return (names.index(name), "") if name in names else (len(names) + (name in VERDICTS), name)

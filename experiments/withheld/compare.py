"""Two ways to diagnose the same cases, side by side: every row of the table, and what the second gains on the first.

    python -m experiments.withheld.compare --answers ANSWERS --found before=FOLDER after=FOLDER --out OUT [--quick]

Both columns of a row are taken over the cases that bear on it in both. The 95 % interval of the difference knows that
they are the same cases, and a hard case is hard for both: of shares it is Agresti's and Min's, of all else the
bootstrap's over cases drawn in pairs. Cases that one of them has not come to yet are left out. OUT/comparison.md also
lists the cases that came out otherwise. Answers must be plain.
"""

import argparse
import json
import pathlib
from collections.abc import Sequence
from typing import Any

import numpy as np

import jaxident as ji

from .scoring.intervals import bootstrap, matched
from .scoring.judge import added, marked
from .scoring.misses import hidden_of, said_of, wrong
from .scoring.rows import ROWS, Row
from .scoring.table import features


def paired(row: Row, first: list[dict], second: list[dict]) -> dict[str, Any]:
    """One row of two lists of marks, of the same cases in the same order: both values and their difference, with its
    95 % interval; null where no case bears on it in both."""
    both = [(a, b) for a, b in zip(first, second, strict=True) if row.bears(a) and row.bears(b)]
    told: dict[str, Any] = {"row": row.label, "first": None, "second": None, "difference": None, "interval": None}
    if not both:
        return told | {"cases": 0, "goal": row.goal}
    one, other = (features(row, list(each)) for each in zip(*both, strict=True))

    def difference(drawn: np.ndarray) -> float:
        cases = drawn.astype(int)
        return float(row.statistic(other[cases]) - row.statistic(one[cases]))

    every = np.arange(len(both))
    told |= {"first": float(row.statistic(one)), "second": float(row.statistic(other)), "difference": difference(every)}
    interval = matched(one, other) if row.counted else bootstrap(every, difference)
    return told | {"interval": list(interval), "cases": len(both), "goal": row.goal}


def compared(first: list[dict], second: list[dict]) -> list[dict[str, Any]]:
    """All rows that some case bears on."""
    return [row for row in (paired(row, first, second) for row in ROWS) if row["cases"]]


def text(rows: list[dict], names: Sequence[str]) -> str:
    """The rows in Markdown."""
    lines = [f"| | {names[0]} | {names[1]} | difference | cases | goal |", "|---|---|---|---|---|---|"]
    for row in rows:
        low, high = row["interval"]
        gain = f"{row['difference']:+.3g} ({low:+.3g} to {high:+.3g})"
        cells = (row["row"], f"{row['first']:.3g}", f"{row['second']:.3g}", gain, str(row["cases"]), row["goal"])
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def changed(answers: dict[str, dict], first: dict[str, dict], second: dict[str, dict], names: Sequence[str]) -> str:
    """A Markdown table of the cases that came out otherwise: what each said, and what of it is wrong."""
    lines = [f"| case | kind | hidden (strength) | {names[0]} | {names[1]} |", "|---|---|---|---|---|"]
    for name, answer in answers.items():
        told = [f"{said_of(marks[name])}{_faults(marks[name])}" for marks in (first, second)]
        if told[0] != told[1]:
            cells = (name.removeprefix("case_"), answer["kind"], hidden_of(answer), *told)
            lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _faults(marks: dict) -> str:
    """The marks that are wrong, but for the shrink, whose last digits always differ."""
    found = wrong(marks | {"shrink": None})
    return f" (wrong: {', '.join(found)})" if found else ""


def pages(answers: dict[str, dict], marks: dict[str, dict[str, dict]]) -> tuple[dict[str, list], str]:
    """Rows by generator, and the page; marks: {name: {case: marks}} of two."""
    names = tuple(marks)
    first, second = marks.values()
    tables, parts = {}, []
    for kind in sorted({answer["generator"] for answer in answers.values()}):
        own = {name: answer for name, answer in answers.items() if answer["generator"] == kind}
        tables[kind] = compared([first[name] for name in own], [second[name] for name in own])
        parts += [f"## {len(own)} cases of the {kind} robot\n", text(tables[kind], names)]
        parts += ["Came out otherwise:\n", changed(own, first, second, names)]
    return tables, "\n".join(parts)


def main() -> None:
    """Compare two folders of diagnoses; write and print what came out."""
    options = _parser().parse_args()
    ji.start_jax()
    folders = {name: pathlib.Path(path) for name, path in (each.split("=", 1) for each in options.found)}
    answers = json.loads(options.answers.read_text())["cases"]
    answers = {n: a for n, a in answers.items() if all((f / n / "process.json").exists() for f in folders.values())}
    marks = {name: marked(answers, folder, not options.quick) for name, folder in folders.items()}
    for k, own in enumerate(marks.values()):
        files = [given[k] if given else None for given in (options.shares, options.promise)]
        for name, further in added(answers, *files).items():
            own[name] |= further
    tables, page = pages(answers, marks)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "comparison.json").write_text(json.dumps({"tables": tables, "marks": marks}, indent=1) + "\n")
    (options.out / "comparison.md").write_text(page)
    print(page)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("answers", "out"):
        parser.add_argument(f"--{name}", required=True, type=pathlib.Path)
    parser.add_argument("--found", nargs=2, required=True, metavar="NAME=FOLDER")
    for name in ("shares", "promise"):
        parser.add_argument(f"--{name}", nargs=2, type=pathlib.Path, help=f"what `{name}` wrote for each")
    parser.add_argument("--quick", action="store_true", help="without the shrink on fresh runs")
    return parser


if __name__ == "__main__":
    main()

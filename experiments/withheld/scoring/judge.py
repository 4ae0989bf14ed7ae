"""Score a folder of diagnoses against unsealed answers, and write table and pictures."""

import json
import pathlib
from typing import Any

import numpy as np

import jaxident as ji

from . import pictures
from .calibration import claims
from .fresh import fresh_runs, true_shrink
from .marks import mark
from .misses import misses
from .table import table

RANDOM = ("coloured_noise", "outliers", "frozen_frames", "lost_commands", "bumps")
"""Effects of chance: they leave nothing to shrink on runs without it."""


def judge(
    answers: dict[str, dict],
    folders: dict[str, pathlib.Path],
    out: pathlib.Path,
    shrink: bool = True,
    more: dict[str, dict] | None = None,
) -> dict:
    """Tables by generator and method; folders: that of each method's diagnoses, ours first; more: further marks by case
    of the first method (`added`). Writes OUT/scores.json, table.md, misses.md of the first method, and pictures."""
    out.mkdir(parents=True, exist_ok=True)
    marks = {method: marked(answers, folder, shrink) for method, folder in folders.items()}
    for name, further in (more or {}).items():
        next(iter(marks.values()))[name] |= further
    kinds = sorted({answer["generator"] for answer in answers.values()})
    tables, pages = {}, []
    for kind in kinds:
        own = {name: answer for name, answer in answers.items() if answer["generator"] == kind}
        tables[kind] = {method: table([found[name] for name in own]) for method, found in marks.items()}
        pages.append(f"## {len(own)} cases of the {kind} robot\n\n{pictures.text(tables[kind])}")
        for method, found in marks.items():
            draw(own, {name: found[name] for name in own}, out, f"{kind}_{method}")
    (out / "scores.json").write_text(json.dumps({"tables": tables, "marks": marks}, indent=1) + "\n")
    (out / "table.md").write_text("\n".join(pages))
    (out / "misses.md").write_text(misses(answers, next(iter(marks.values()))))
    print("\n".join(pages))
    return tables


def marked(answers: dict[str, dict], folder: pathlib.Path, shrink: bool = True) -> dict[str, dict[str, Any]]:
    """The marks of every case of one folder."""
    return {name: one(answer, folder / name, shrink) for name, answer in answers.items()}


def added(names, shares: pathlib.Path | None, promise: pathlib.Path | None) -> dict[str, dict[str, Any]]:
    """Further marks of these cases from what `shares` and `promise` wrote. shares: whether each true share is inside
    its interval; promise: error on fresh runs over that promised."""
    further: dict[str, dict[str, Any]] = {name: {} for name in names}
    for name, case in _read(shares).items():
        if name in further:
            rows = case["rows"]
            further[name]["shares"] = [row["interval"][0] <= row["true"] <= row["interval"][1] for row in rows]
    for name, case in _read(promise).items():
        if name in further:
            further[name]["promise"] = case["fresh"] / case["promised"]
    return further


def _read(path: pathlib.Path | None) -> dict:
    return {} if path is None else json.loads(path.read_text())


def one(answer: dict, folder: pathlib.Path, shrink: bool) -> dict[str, Any]:
    """The marks of one case; a case without a diagnosis is marked as failed."""
    path, record = folder / "diagnosis.json", folder / "process.json"
    diagnosis = json.loads(path.read_text()) if path.exists() else None
    found = mark(answer, diagnosis) | {"strength": answer["strength"], "inputs": answer["inputs"]}
    found["claims"] = claims(answer, diagnosis)
    given = (diagnosis or {}).get("probability") or {}
    outside = answer["kind"] in ("outside", "mixed")
    found["unexplained_top"] = [given["unexplained"], outside] if "unexplained" in given else None
    found["seconds"] = json.loads(record.read_text())["seconds"] if record.exists() else None
    gap = (diagnosis or {}).get("gap") or {}
    found["interval"] = gap.get("whole_shrink_interval", gap.get("shrink_interval"))  # older ones have the second
    if shrink and diagnosis and shrinkable(answer) and (folder / "corrected_model.json").exists():
        models = [ji.load_model(folder / f"{name}_model.json") for name in ("nominal", "corrected")]
        found["shrink"] = true_shrink(answer, *models, gap["horizon"], fresh_runs(answer))["shrink"]
    return found


def shrinkable(answer: dict) -> bool:
    """Whether the shrink of a case has meaning: an effect is there without chance."""
    return any(effect["name"] not in RANDOM for effect in answer["effects"])


def draw(answers: dict[str, dict], marks: dict[str, dict], out: pathlib.Path, label: str) -> None:
    """Confusion matrix over cases with at most one effect, and the reliability of the probabilities."""
    hidden = {
        name: (answer["effects"] or [{"name": "none"}])[0]["name"]
        for name, answer in answers.items()
        if len(answer["effects"]) < 2
    }
    if hidden:
        pictures.confusion(
            [(hidden[name], pictures.said(marks[name])) for name in hidden], out / f"confusion_{label}.png"
        )
    tops = [m["top"] for m in marks.values() if m["top"] is not None]
    if tops:
        pictures.reliable(np.array(tops, float), out / f"reliability_{label}.png")

"""From marks of cases to the table: every row with its count and a 95 % interval."""

from collections.abc import Callable
from typing import Any

import numpy as np

from .intervals import bootstrap, wilson

BINS = np.linspace(0.0, 1.0, 11)


def table(marks: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """All rows for one method. marks: `marks.mark` of each case, with `strength`, `inputs`, `seconds`, and where there
    is one `shrink` (`fresh.true_shrink`'s shrink) and `interval` (the diagnosis's own, 90 %)."""
    single = [m for m in marks if m["kind"] == "single"]
    listed = [m for m in marks if m["kind"] in ("single", "pair")]
    pairs = [m for m in marks if m["kind"] == "pair"]
    telling = [m for m in single if m.get("inputs", "multilevel") == "multilevel"]
    strong = [m for m in telling if m.get("strength", [0.0])[0] > 0.3]
    none = [m for m in marks if m["kind"] == "none"]
    rows = [
        share("effect claimed when there is none", none, "claimed", "at most 0.05"),
        share("one effect: named", telling, "right", "at least 0.9"),
        share("one effect: named, without sets", telling, "strict", ""),
        share("one effect of strength above 0.3: named", strong, "right", "at least 0.95"),
        share("one effect: another claimed", single, "extra", ""),
        share("site", [m for m in marks if m["site"] is not None], "site", "at least 0.95"),
        share("channel", [m for m in marks if m["channel"] is not None], "channel", "at least 0.95"),
        share(
            "outside the catalogue: told as unexplained",
            [m for m in marks if m["kind"] == "outside"],
            "unexplained",
            "at least 0.9",
        ),
        share("in the catalogue: something unexplained told", listed, "unexplained", "at most 0.03"),
        share("two effects: both named", pairs, "right", "at least 0.75"),
        share("two effects: one named at least", pairs, "some", "at least 0.95"),
    ]
    return rows + shrinks(listed) + calibration(marks) + times(marks)


def share(label: str, marks: list[dict], key: str, goal: str) -> dict[str, Any]:
    """How many of these cases have the mark."""
    hits = sum(bool(m[key]) for m in marks)
    value = hits / len(marks) if marks else None
    return row(label, value, wilson(hits, len(marks)) if marks else None, len(marks), goal)


def row(label: str, value: float | None, interval, count: int, goal: str = "") -> dict[str, Any]:
    """One row; a value of null where no case bears on it."""
    return {"row": label, "value": value, "interval": interval and list(interval), "cases": count, "goal": goal}


def shrinks(marks: list[dict]) -> list[dict[str, Any]]:
    """Shrink on fresh runs over that achievable, which is 1, and how often the diagnosis's interval holds it."""
    found = [m["shrink"] for m in marks if m.get("shrink") is not None]
    judged = [m for m in marks if m.get("shrink") is not None and m.get("interval")]
    inside = [m["interval"][0] <= m["shrink"] <= m["interval"][1] for m in judged]
    held = wilson(sum(inside), len(inside)) if inside else None
    return [
        measured("shrink achieved over achievable, median", found, np.median, "0.95"),
        row("shrink inside its 90 % interval", np.mean(inside) if inside else None, held, len(inside), "0.85 to 0.95"),
    ]


def measured(label: str, values: list[float], statistic: Callable, goal: str = "") -> dict[str, Any]:
    """A statistic over cases."""
    if not values:
        return row(label, None, None, 0, goal)
    return row(label, float(statistic(np.asarray(values))), bootstrap(values, statistic), len(values), goal)


def calibration(marks: list[dict]) -> list[dict[str, Any]]:
    """Whether hypotheses held at p come true at p: the calibration error of the most probable one (Naeini et al. 2015,
    ten bins) and the probability given to the truth."""
    tops = [m["top"] for m in marks if m.get("top") is not None]
    truth = [m["probability_of_truth"] for m in marks if m.get("probability_of_truth") is not None]
    mean_over = [p - right for p, right in tops]
    if not tops:
        return []
    pairs = np.array(tops, float)
    spread = bootstrap(np.arange(len(pairs)), lambda k: calibration_error(pairs[k.astype(int)]))
    return [
        row("calibration error of the first hypothesis", calibration_error(pairs), spread, len(tops)),
        measured("first hypothesis: probability less share right", mean_over, np.mean),
        measured("probability given to the truth, mean", truth, np.mean),
    ]


def reliability(tops: np.ndarray) -> list[tuple[float, float, int]]:
    """Mean probability, share right and count of each bin that holds a case; tops (cases, 2)."""
    index = np.clip(np.digitize(tops[:, 0], BINS) - 1, 0, len(BINS) - 2)
    found = [tops[index == k] for k in range(len(BINS) - 1)]
    return [(float(each[:, 0].mean()), float(each[:, 1].mean()), len(each)) for each in found if len(each)]


def calibration_error(tops: np.ndarray) -> float:
    """Mean over cases of |probability - share right| of their bin."""
    bins = reliability(tops)
    return sum(count * abs(p - right) for p, right, count in bins) / max(1, sum(count for *_, count in bins))


def times(marks: list[dict]) -> list[dict[str, Any]]:
    """Median seconds of a case, and how many processes failed."""
    seconds = [m["seconds"] for m in marks if m.get("seconds") is not None]
    failed = [m | {"failed": m["verdict"] == "failed"} for m in marks]
    return [measured("seconds per case, median", seconds, np.median, "60"), share("failed", failed, "failed", "0")]

"""Marks of one diagnosis against the answer: what is right and what is not, each true, false or null."""

import itertools
from typing import Any

GAP_VERDICTS = ("effects", "partly", "unknown")
NAMING = ("effects", "partly")


def mark(answer: dict, diagnosis: dict | None) -> dict[str, Any]:
    """All marks of a case; a diagnosis that is missing (the process failed) is wrong wherever it counts.

    claimed: a gap beyond parameters is claimed. unexplained: something is told that no named effect covers, apart from
    the names. right: the hidden set is named, no more and no less, where a name also stands for those said to be
    indistinguishable from it. strict: the same without them. some: at least one hidden effect is named. named: how many
    of the `hidden` ones of the catalogue are, each by a name of its own. extras: how many names are right for none.
    site, channel: the most probable site, the channel of most excess, are among the right ones. top: probability of the
    most probable set, or outside the catalogue that something is unexplained, and whether that is the truth.
    """
    if diagnosis is None:
        diagnosis = {"verdict": "failed"}
    selected, likeness = diagnosis.get("selected") or [], look_alikes(diagnosis)
    kind, accepted = answer["kind"], answer["accepted"]
    listed = bool(accepted)
    effects = diagnosis["verdict"] in NAMING
    alike = [{name, *likeness.get(name, ())} for name in selected]
    wrong = sum(not touches(accepted, each) for each in alike) if effects else 0
    return {
        "kind": kind,
        "verdict": diagnosis["verdict"],
        "claimed": diagnosis["verdict"] in GAP_VERDICTS,
        "unexplained": diagnosis["verdict"] in ("partly", "unknown"),
        "selected": selected,
        "right": bool(effects and covers(accepted, alike)) if listed else None,
        "strict": bool(effects and covers(accepted, [{name} for name in selected])) if listed else None,
        "some": bool(effects and any(set(names) & each for names in accepted for each in alike)) if listed else None,
        "extra": wrong > 0 if listed else None,
        "hidden": len(accepted),
        "named": found_of(accepted, alike) if effects else 0,
        "extras": wrong,
        "set_size": max(map(len, alike), default=0),
        "site": _among(_largest(diagnosis, "site"), [s for e in answer["effects"] for s in e["sites"]]),
        "channel": _among(_largest(diagnosis, "channels"), [] if kind == "mixed" else answer["channels"]),
        "top": top(answer, diagnosis, likeness),
        "probability_of_truth": probability_of_truth(answer, diagnosis, likeness),
    }


def look_alikes(diagnosis: dict) -> dict[str, list[str]]:
    """For each cause the names that this input cannot tell from it."""
    return {cause["effect"]: cause.get("indistinguishable_from") or [] for cause in diagnosis.get("causes") or []}


def touches(accepted: list[list[str]], names: set[str]) -> bool:
    """Whether one of the names is right for one of the hidden effects."""
    return any(set(right) & names for right in accepted)


def found_of(accepted: list[list[str]], found: list[set[str]]) -> int:
    """How many hidden effects are found at most, each by a name of its own."""
    if not accepted:
        return 0
    first, rest = set(accepted[0]), accepted[1:]
    by = [1 + found_of(rest, found[:k] + found[k + 1 :]) for k, names in enumerate(found) if first & names]
    return max([found_of(rest, found), *by])


def covers(accepted: list[list[str]], found: list[set[str]]) -> bool:
    """Whether each hidden effect is found by a name of its own, nothing else is, and no more than can be right."""
    if not found or len(found) > sum(map(len, accepted)):
        return False
    each_by_one = any(
        all(set(right) & names for right, names in zip(accepted, chosen, strict=True))
        for chosen in itertools.permutations(found, len(accepted))
    )
    return each_by_one and all(touches(accepted, names) for names in found)


def hypotheses(answer: dict, diagnosis: dict, likeness: dict) -> list[tuple[float, bool]]:
    """Probability of each hypothesis of the diagnosis, and whether it is the truth."""
    given = diagnosis.get("probability") or {}
    if answer["kind"] == "outside":
        p = given.get("unexplained", 0.0)
        return [(p, True), (1.0 - p, False)]
    rows = []
    for each in given.get("sets") or []:
        alike = [{name, *likeness.get(name, ())} for name in each["effects"]]
        right = covers(answer["accepted"], alike) if answer["accepted"] else not alike
        rows.append((each["p"], right))
    return rows or [(0.0, False)]


def top(answer: dict, diagnosis: dict, likeness: dict) -> tuple[float, bool] | None:
    """The most probable hypothesis."""
    rows = hypotheses(answer, diagnosis, likeness)
    return max(rows) if diagnosis.get("probability") else None


def probability_of_truth(answer: dict, diagnosis: dict, likeness: dict) -> float | None:
    """What the diagnosis gives to the truth in all."""
    if not diagnosis.get("probability"):
        return None
    return sum(p for p, true in hypotheses(answer, diagnosis, likeness) if true)


def _largest(diagnosis: dict, key: str) -> str | None:
    shares = (diagnosis.get("where") or {}).get(key) or {}
    known = {name: share for name, share in shares.items() if share is not None}
    return max(known, key=known.__getitem__) if known else None


def _among(found: str | None, right: list[str]) -> bool | None:
    """Null where nothing can be right; not finding anything is wrong."""
    return None if not right else found in right

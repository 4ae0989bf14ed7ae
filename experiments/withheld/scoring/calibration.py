"""Whether what is held at probability p is true in a share p of cases."""

import numpy as np

from .marks import look_alikes

BINS = np.linspace(0.0, 1.0, 11)
LEAST = 1e-3
"""Probability below which a diagnosis lists no cause; the log score takes nothing as less or more sure."""


def reliability(tops: np.ndarray) -> list[tuple[float, float, int]]:
    """Mean probability, share right and count of each bin that holds a claim; tops (claims, 2)."""
    index = bins_of(tops[:, 0])
    found = [tops[index == k] for k in range(len(BINS) - 1)]
    return [(float(each[:, 0].mean()), float(each[:, 1].mean()), len(each)) for each in found if len(each)]


def bins_of(p: np.ndarray) -> np.ndarray:
    """The bin of each probability."""
    return np.clip(np.digitize(p, BINS) - 1, 0, len(BINS) - 2)


def calibration_error(tops: np.ndarray) -> float:
    """Mean over claims of |probability - share right| of their bin (Naeini et al. 2015)."""
    bins = reliability(tops)
    return sum(count * abs(p - right) for p, right, count in bins) / max(1, sum(count for *_, count in bins))


def claims(answer: dict, diagnosis: dict | None) -> list[tuple[float, bool]]:
    """Probability that a cause takes part, and whether it does: every cause listed, and hidden effects not listed at 0.

    Causes that this input cannot tell apart make one claim, "one of these takes part", at the sum of their
    probabilities; so do the names that are right for one hidden effect. A hidden effect that is not listed does not
    count where the diagnosis says that this input could not show it. Nothing for a method without probabilities.
    """
    if not diagnosis or not diagnosis.get("probability"):
        return []
    given = {cause["effect"]: cause["probability"] for cause in diagnosis["causes"]}
    silent = set(diagnosis.get("not_testable") or []) - given.keys()
    hidden = [set(names) for names in answer["accepted"] if not set(names) <= silent]
    listed = [{name, *others} for name, others in look_alikes(diagnosis).items()]
    return [
        (min(sum(given.get(name, 0.0) for name in group), 1.0), any(names & group for names in hidden))
        for group in merged(listed + hidden)
    ]


def merged(sets: list[set[str]]) -> list[set[str]]:
    """Sets joined where they share a name."""
    found: list[set[str]] = []
    for each in sets:
        joined = [group for group in found if group & each]
        found = [group for group in found if not group & each] + [each.union(*joined)]
    return found


def tallied(found: list[tuple[float, bool]]) -> np.ndarray:
    """The claims of one case as sums that add up over cases (4, bins): count, probability, truth, log score."""
    p, true = np.array(found, float).T
    sure = np.clip(p, LEAST, 1.0 - LEAST)
    score = np.where(true > 0, np.log(sure), np.log1p(-sure))
    rows = (np.ones_like(p), p, true, score)
    return np.stack([np.bincount(bins_of(p), weights=row, minlength=len(BINS) - 1) for row in rows])


def tally_error(tallies: np.ndarray) -> float:
    """Calibration error of all claims of these cases; tallies (cases, 4, bins)."""
    count, p, true, _ = tallies.sum(axis=0)
    return float(np.abs(p - true).sum() / count.sum())


def log_score(tallies: np.ndarray) -> float:
    """Mean log of the probability given to what is so."""
    count, _, _, score = tallies.sum(axis=0)
    return float(score.sum() / count.sum())


def overconfidence(tallies: np.ndarray) -> float:
    """Mean probability less share true of the claims at a half and more; NaN where there is none."""
    count, p, true, _ = tallies.sum(axis=0)[:, len(BINS) // 2 :]
    return float((p - true).sum() / count.sum()) if count.sum() else float("nan")

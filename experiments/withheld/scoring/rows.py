"""The rows of the table: which cases bear on each, what of a case counts, and how it is put together over cases."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .calibration import calibration_error, log_score, overconfidence, tallied, tally_error

CATALOGUED = ("single", "pair", "many")
"""Kinds whose effects are all of the catalogue."""
LOW, HIGH, FAR = 0.75, 4.0 / 3.0, 3.0
"""Of the error on fresh runs over the promised one: between which it should be, and what it should never pass."""


class Row(NamedTuple):
    """`statistic` of the `feature` of all cases that bear on it; counted: a share, which has Wilson's interval."""

    label: str
    bears: Callable[[dict], bool]
    feature: Callable[[dict], Any]
    statistic: Callable[[np.ndarray], float] = np.mean
    goal: str = ""
    counted: bool = False


def share(label: str, bears: Callable[[dict], bool], key: str, goal: str = "") -> Row:
    """How many of these cases have a mark."""
    return Row(label, bears, lambda m: float(bool(m[key])), np.mean, goal, True)


def kind(*kinds: str) -> Callable[[dict], bool]:
    """Cases of these kinds."""
    return lambda m: m["kind"] in kinds


def telling(*kinds: str) -> Callable[[dict], bool]:
    """Cases of these kinds whose input can show every effect."""
    return lambda m: m["kind"] in kinds and m.get("inputs", "multilevel") == "multilevel"


def has(*keys: str) -> Callable[[dict], bool]:
    """Cases that know these marks; an empty list is not known."""
    return lambda m: not any(m.get(key) is None or (isinstance(m[key], list) and not m[key]) for key in keys)


def both(*conditions: Callable[[dict], bool]) -> Callable[[dict], bool]:
    """Cases that meet every condition."""
    return lambda m: all(condition(m) for condition in conditions)


def shrink_of(mark: dict) -> float:
    """Shrink on fresh runs, but at least -1: a model twice as far off as the nominal one is as bad as any worse one."""
    return float(np.fmax(mark["shrink"], -1.0))


def shrink(label: str, *kinds: str, statistic=np.median, goal: str = "") -> Row:
    """Shrink on fresh runs over that achievable, which is 1."""
    return Row(label, both(kind(*kinds), has("shrink")), shrink_of, statistic, goal)


def lower_tenth(values: np.ndarray) -> float:
    """What a tenth of the cases falls short of."""
    return float(np.quantile(values, 0.1))


def ratio(pairs: np.ndarray) -> float:
    """Sum of the first column over that of the second."""
    return float(pairs[:, 0].sum() / pairs[:, 1].sum())


def _strong(mark: dict) -> bool:
    return telling("single")(mark) and mark.get("strength", [0.0])[0] > 0.3


def _held(mark: dict) -> float:
    low, high = mark["interval"]
    return float(low <= mark["shrink"] <= high)


MANY, MIXED = "four or five effects", "one of the catalogue beside one outside"
SHRINK = "shrink achieved over achievable"
PROMISE = "error on fresh runs over that promised"
CLAIMS = "probability that a cause takes part"

NAMING = (
    share("effect claimed when there is none", kind("none"), "claimed", "at most 0.02"),
    share("one effect: named", telling("single"), "right", "at least 0.95"),
    share("one effect: named, without sets", telling("single"), "strict"),
    share("one effect of strength above 0.3: named", _strong, "right", "at least 0.98"),
    share("one effect: another claimed", kind("single"), "extra"),
    share("site", lambda m: m["site"] is not None, "site", "at least 0.95"),
    share("channel", lambda m: m["channel"] is not None, "channel", "at least 0.95"),
    share("outside the catalogue: told as unexplained", kind("outside"), "unexplained", "at least 0.9"),
    share("in the catalogue: something unexplained told", kind(*CATALOGUED), "unexplained", "at most 0.03"),
    share("two effects: both named", kind("pair"), "right", "at least 0.85"),
    share("two effects: one named at least", kind("pair"), "some", "at least 0.97"),
    Row(f"{MANY}: share named", telling("many"), lambda m: (m["named"], m["hidden"]), ratio, "at least 0.8"),
    Row(f"{MANY}: false extras a case", kind("many"), lambda m: m["extras"], np.mean, "at most 0.1"),
    share(f"{MANY}: all named and nothing else", telling("many"), "right"),
    share(f"{MIXED}: the first named", telling("mixed"), "some", "at least 0.85"),
    share(f"{MIXED}: the rest told", kind("mixed"), "unexplained", "at least 0.75"),
    Row(f"{MIXED}: false extras a case", kind("mixed"), lambda m: m["extras"]),
)
ERRORS = (
    shrink(f"{SHRINK}, median", *CATALOGUED, goal="0.95"),
    shrink(f"{SHRINK}, worst tenth", *CATALOGUED, statistic=lower_tenth, goal="0.7"),
    shrink(f"{MANY}: {SHRINK}, median", "many"),
    shrink(f"{MIXED}: {SHRINK}, median", "mixed"),
    shrink(f"outside the catalogue: {SHRINK}, median", "outside", goal="0.8"),
    Row("shrink inside its 90 % interval", both(kind(*CATALOGUED), has("shrink", "interval")), _held, np.mean,
        "0.85 to 0.95", True),
    Row(f"{MIXED}: shrink inside its 90 % interval", both(kind("mixed"), has("shrink", "interval")), _held, np.mean,
        "0.85 to 0.95", True),
    Row("true share of an effect inside its 90 % interval", has("shares"),
        lambda m: (sum(m["shares"]), len(m["shares"])), ratio, "0.85 to 0.95"),
    Row(f"{PROMISE}: 0.75 to 1.33", has("promise"), lambda m: float(LOW < m["promise"] < HIGH), np.mean,
        "at least 0.9", True),
    Row(f"{PROMISE}: above 3", has("promise"), lambda m: float(not m["promise"] <= FAR), np.mean, "0", True),
)  # fmt: skip
PROBABILITIES = (
    Row("calibration error of the first hypothesis", has("top"), lambda m: m["top"], calibration_error),
    Row("first hypothesis: probability less share right", has("top"), lambda m: m["top"][0] - m["top"][1]),
    Row("probability given to the truth, mean", has("probability_of_truth"), lambda m: m["probability_of_truth"]),
    Row(f"{CLAIMS}: calibration error", has("claims"), lambda m: tallied(m["claims"]), tally_error),
    Row(f"{CLAIMS}: log score, mean", has("claims"), lambda m: tallied(m["claims"]), log_score),
    Row(f"{CLAIMS}: less share true, of those at 0.5 and more", has("claims"), lambda m: tallied(m["claims"]),
        overconfidence),
    Row("probability of something unexplained: calibration error", has("unexplained_top"),
        lambda m: m["unexplained_top"], calibration_error),
)  # fmt: skip
COSTS = (
    Row("seconds per case, median", has("seconds"), lambda m: m["seconds"], np.median, "60"),
    Row("failed", lambda m: True, lambda m: float(m["verdict"] == "failed"), np.mean, "0", True),
)
ROWS = NAMING + ERRORS + PROBABILITIES + COSTS

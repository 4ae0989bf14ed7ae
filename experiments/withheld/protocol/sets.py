"""Sets of cases, each from one seed."""

import numpy as np

from jaxident.effects import CATALOGUE

from .cases import describe, simulate_cases
from .outside import LATER_SITES, SITES
from .robots import FORMS

COUNTS = {
    "trial": {"none": 1, "single": 1, "pair": 1, "outside": 1},
    "development": {"none": 20, "single": 40},
    "development_pairs": {"pair": 15, "outside": 15},
    "forms": {"single": 46, "pair": 30},
    "sealed": {"none": 80, "single": 145, "pair": 40, "outside": 40},
    "sealed_half": {"none": 40, "single": 73, "pair": 20, "outside": 20},
    "development_many": {"many": 10, "mixed": 14, "none": 6, "outside": 6, "single": 6},
    "sealed_second": {"none": 40, "single": 60, "pair": 20, "outside": 20, "many": 20, "mixed": 20},
    "engine": {"none": 5, "single": 15},
    "sealed_engine": {"none": 20, "single": 60, "pair": 20},
    "sealed_engine_second": {"none": 10, "single": 30, "pair": 12},
}
"""Cases of each kind in each set; those of the engine need the extra `mujoco`. `forms`: effects in other forms than the
catalogue's."""

MANY = (4, 5)
"""Effects of a case of the kind `many`: one of these counts, each as likely as the other."""
SINGLE_FRAMES = ("outliers", "frozen_frames")
"""Effects of pure chance on single frames: not among those of `many`."""
WITH_LATER = ("sealed_second",)
"""Sets that have the later effects of no catalogue (`outside.LATER_SITES`) as well."""

FORWARD = 0.06
"""Share of sealed cases whose input is two forward levels."""


LATER = ("command_polling", "twist_quantisation", "camera_latency")
"""Effects that came to the catalogue after sets had been drawn: the seed of a set must go on to draw the same cases."""


def draw_set(name: str, seed: int) -> list[dict]:
    """Descriptions of all cases of a set, in random order."""
    rng = np.random.default_rng(seed)
    cases = _engine_cases(rng, name) if "engine" in name else _batch_cases(rng, name)
    return [cases[k] for k in rng.permutation(len(cases))]


def simulate_block(cases: list[dict]) -> list[list[np.ndarray]]:
    """The logs of each case, all of one generator."""
    if cases[0]["generator"] == "batch":
        return simulate_cases(cases)
    from ..engine_robot.cases import simulate_case

    return [simulate_case(case) for case in cases]


def _engine_cases(rng, name: str) -> list[dict]:
    from ..engine_robot import cases as engine_cases

    cases = []
    for kind, count in COUNTS[name].items():
        for number, names in enumerate(hidden_names(rng, kind, count, list(engine_cases.LAWS))):
            slip = number % 2 == 1 if kind == "none" else rng.random() < 0.3
            sim = bool(rng.random() < 0.5)
            cases.append(engine_cases.describe(int(rng.integers(2**62)), names, slip=bool(slip), sim=sim))
    return cases


def _batch_cases(rng, name: str) -> list[dict]:
    cases = []
    listed = list(FORMS) if name == "forms" else [effect for effect in CATALOGUE if effect not in LATER]
    unlisted = list(SITES | LATER_SITES if name in WITH_LATER else SITES)
    for kind, count in COUNTS[name].items():
        for number, names in enumerate(names_of_kind(rng, kind, count, listed, unlisted)):
            sim = rng.choice(["same", "near"]) if rng.random() < 1 / 3 else None
            slip = number % 2 == 1 if kind == "none" else rng.random() < 0.5
            forward = name.startswith("sealed") and rng.random() < FORWARD
            inputs = "forward" if forward else "multilevel"
            own = int(rng.integers(2**62))
            cases.append(describe(own, kind, names, slip=bool(slip), sim=sim, inputs=inputs, other=name == "forms"))
    return cases


def names_of_kind(rng, kind: str, count: int, listed: list[str], outside: list[str]) -> list[list[str]]:
    """Names of the hidden effects of each case; `mixed`: one that is listed, then one that is outside."""
    if kind == "many":
        pool = [name for name in listed if name not in SINGLE_FRAMES]
        return [rng.choice(pool, rng.choice(MANY), replace=False).tolist() for _ in range(count)]
    if kind == "mixed":
        drawn = [hidden_names(rng, "single", count, pool) for pool in (listed, outside)]
        return [known + unknown for known, unknown in zip(*drawn, strict=True)]
    return hidden_names(rng, kind, count, outside if kind == "outside" else listed)


def hidden_names(rng, kind: str, count: int, pool: list[str]) -> list[list[str]]:
    """Names of the hidden effects of each case: every effect as often as any other, up to one."""
    if kind == "none":
        return [[] for _ in range(count)]
    if kind == "pair":
        return [rng.choice(pool, 2, replace=False).tolist() for _ in range(count)]
    drawn = np.concatenate([rng.permutation(pool) for _ in range(-(-count // len(pool)))])
    return [[str(name)] for name in drawn[:count]]

"""Sets of cases of the batched generator, from one seed."""

import numpy as np

from jaxident.effects import CATALOGUE

from .cases import describe
from .robots import OUTSIDE_SITES

COUNTS = {
    "development": {"none": 20, "single": 40},
    "development_pairs": {"pair": 15, "outside": 15},
    "sealed": {"none": 80, "single": 145, "pair": 40, "outside": 40},
}
"""Cases of each kind in each set."""

FORWARD = 0.06
"""Share of sealed cases whose input is two forward levels."""


def draw_set(name: str, seed: int) -> list[dict]:
    """Descriptions of all cases of a set, in random order."""
    rng = np.random.default_rng(seed)
    cases = []
    for kind, count in COUNTS[name].items():
        for number, names in enumerate(hidden_names(rng, kind, count)):
            sim = rng.choice(["same", "near"]) if rng.random() < 1 / 3 else None
            slip = number % 2 == 1 if kind == "none" else rng.random() < 0.5
            forward = name == "sealed" and rng.random() < FORWARD
            inputs = "forward" if forward else "multilevel"
            own = int(rng.integers(2**62))
            cases.append(describe(own, kind, names, slip=bool(slip), sim=sim, inputs=inputs))
    return [cases[k] for k in rng.permutation(len(cases))]


def hidden_names(rng, kind: str, count: int) -> list[list[str]]:
    """Names of the hidden effects of each case: every effect as often as any other, up to one."""
    if kind == "none":
        return [[] for _ in range(count)]
    pool = list(OUTSIDE_SITES) if kind == "outside" else list(CATALOGUE)
    if kind == "pair":
        return [rng.choice(pool, 2, replace=False).tolist() for _ in range(count)]
    drawn = np.concatenate([rng.permutation(pool) for _ in range(-(-count // len(pool)))])
    return [[str(name)] for name in drawn[:count]]

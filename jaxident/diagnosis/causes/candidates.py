"""Sets of effects as a search finds them: what each gains, what it must be worth, and where the search ended."""

from collections.abc import Collection
from typing import Any, NamedTuple

from jaxident.diagnosis.causes.search import Data, Solution
from jaxident.diagnosis.noise.law import Law
from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.coordinates import COORDINATES, SEARCHED

PENALTY = 4.0
"""Fall of -log p that each coordinate of an effect costs."""
ENOUGH = 9.0
"""Gain beyond the penalty that claims an effect. With it a coordinate that does nothing gains as much once in three
million times (chi-squared at 26), if the noise law is right; the rest is room for a law that is not quite."""
FORM, ELSEWHERE = 0.01, 0.001
"""Part of all that is explained which a further effect must bring at a site where the set has one already, and at
another: a robot's own form of an effect is never quite that of the catalogue, and what it leaves looks like another one
of the same site."""
RIGID = {name for name, search in SEARCHED.items() if search.rigid}
"""Effects that geometry gives one form: what they leave is not the form of theirs, so that beside them a further effect
pays as at another site, and so do they beside others."""


TERMS = 2.0
"""Terms of the corrector, the largest that no effect explains, that one effect may take up: a further effect, and a
difference from a simulator, is worth more. Where something is missing that has no name, as much is made up easily."""


class Candidate(NamedTuple):
    """A set of effects refitted: its solution and its gain, the fall of -log p from the nominal fit."""

    effects: tuple[str, ...]
    solution: Solution
    gain: float

    @property
    def price(self) -> float:
        """That of its coordinates."""
        return PENALTY * sum(len(COORDINATES[name]) for name in self.effects)

    @property
    def evidence(self) -> float:
        """Gain less the price of its coordinates, and of what may only be the form of others."""
        return self.gain - self.price - form_price(self.effects) * max(self.gain, 0.0)


def form_price(effects: Collection[str]) -> float:
    """Part of all that is explained which a set must bring beside its first effect."""
    sites = [name if name in RIGID else CATALOGUE[name].site for name in effects]
    distinct = len(set(sites))
    return FORM * (len(sites) - distinct) + ELSEWHERE * max(distinct - 1, 0)


def value(candidate: Candidate, further: float = ENOUGH) -> float:
    """What a set is worth: its evidence less ENOUGH for its first effect and another price for each further one."""
    count = len(candidate.effects)
    return candidate.evidence - ENOUGH * min(count, 1) - further * max(count - 1, 0)


def largest(terms: list[tuple[Any, float]]) -> float:
    """What the largest term of the corrector explains."""
    return max((gain for _, gain in terms), default=0.0)


class Finding(NamedTuple):
    """Where the search ended: data under the noise law of the search; the law beside the corrector's terms, and the
    likeliest one without them, which takes what they explain for noise; the nominal fit, all candidates of every stage
    by their effects, the selected set, and terms of the corrector with what each still explains."""

    data: Data
    law: Law
    likely: Law
    nominal: Solution
    candidates: dict[tuple[str, ...], Candidate]
    selected: tuple[str, ...]
    terms: list[tuple[Any, float]]

    @property
    def further(self) -> float:
        """What an effect beside others must be worth, all that is left considered."""
        return max(ENOUGH, TERMS * largest(self.terms))

    @property
    def asked(self) -> float:
        """What an effect beside others was asked for when the set was selected: `further`, or ENOUGH where the set
        stays in spite of what is left. Its probability is told by the same number."""
        best = max(self.candidates.values(), key=lambda candidate: value(candidate, self.further))
        return self.further if best.effects == self.selected else ENOUGH

    @property
    def rest(self) -> float:
        """Fall of -log p that all terms bring beyond the selected set."""
        return sum(gain for _, gain in self.terms)

    @property
    def unexplained(self) -> float:
        """The terms' share of all that is explained."""
        return self.share(self.rest)

    def share(self, rest: float) -> float:
        """Share of some rest in it and what the selected set explains."""
        return rest / max(self.candidates[self.selected].gain + rest, 1e-9)

"""What robot and simulator have in common: both searches are brought to the same names before sizes are compared.

Searched apart, two robots with the same gap may make up different effects for it, which would then look like
differences. So where an effect of one can stand in for one of the other, it does.
"""

from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.causes.finding import CLAIMED, Finding, Values
from jaxident.diagnosis.causes.points import sizes_of
from jaxident.diagnosis.causes.search_rounds import TERMS
from jaxident.diagnosis.fit.refit import Solution, refit
from jaxident.effects.coordinates import COORDINATES, NOMINAL, PLACES, free_places, neutral_vector

MOSTLY = 0.7
"""Part of an effect's size beyond which a difference of sizes is told as the effect, below as a parameter."""


class Together(NamedTuple):
    """Both searches with names that agree where they can; the simulator's fit with what it has of the robot's effects;
    what of the robot's selected set it has not, or hardly; what a difference must be worth."""

    robot: Finding
    simulator: Finding
    fit: Solution
    missing: tuple[str, ...]
    price: float

    @property
    def effects(self) -> tuple[str, ...]:
        """What the simulator has."""
        shared = [name for name in self.robot.selected if name not in self.missing]
        return tuple(dict.fromkeys([*shared, *(n for n in self.simulator.selected if n not in self.missing)]))


def explain_together(robot: Finding, simulator: Finding) -> Together:
    """What both have. A difference must be worth more than CLAIMED, and more than TERMS terms that no effect explains
    bring in both: as much is made up easily where something is missing."""
    price = max(CLAIMED, TERMS * min(robot.rest.largest, simulator.rest.largest))
    robot, simulator = same_names(robot, simulator, price)
    asked = [n for n in robot.selected if n in simulator.selected or shows(n, simulator, robot.fit, price)]
    fit = with_effects(simulator, tuple(dict.fromkeys([*simulator.selected, *asked])), robot.fit)
    missing = [
        name for name in robot.selected
        if (lacks(name, fit, robot.fit, price) if name in asked else robot.evidence(name) > price)
    ]  # fmt: skip
    return Together(robot, simulator, fit, tuple(missing), price)


def same_names(robot: Finding, simulator: Finding, price: float) -> tuple[Finding, Finding]:
    """Both with effects exchanged that the other has, where that costs less than the price of a difference."""
    for _ in range(len(robot.selected)):
        found = [(_exchange(simulator, robot, price), False), (_exchange(robot, simulator, price), True)]
        told = [(pair, own) for pair, own in found if pair is not None]
        if not told:
            break
        (_, effects), own = max(told, key=lambda each: each[0][0])
        if own:
            robot = reselected(robot, effects, simulator.fit)
        else:
            simulator = reselected(simulator, effects, robot.fit)
    return robot, simulator


def _exchange(finding: Finding, other: Finding, price: float) -> tuple[float, tuple[str, ...]] | None:
    """The cheapest exchange of one effect that the other has not for one that it has: its value and the set."""
    own, theirs, best = set(finding.selected), set(other.selected), None
    for key, value in finding.values.items():
        out, into = own - key, key - own
        fits = len(out) == len(into) == 1 and into <= theirs and not out <= theirs
        if fits and value > (-price if best is None else best[0]):
            best = value, tuple(name for name in (*finding.selected, *into) if name in key)
    return best


def reselected(finding: Finding, effects: tuple[str, ...], other: Solution) -> Finding:
    """The finding with another set selected; values count from it."""
    zero = finding.values.get(frozenset(effects), 0.0)
    values: Values = {key: value - zero for key, value in finding.values.items()}
    return finding._replace(selected=effects, fit=with_effects(finding, effects, other), values=values)


def with_effects(finding: Finding, effects: tuple[str, ...], other: Solution) -> Solution:
    """The refit with some effects; those that the finding's fit has not begin where another fit has them."""
    if set(effects) == set(finding.selected):
        return finding.fit
    vector, own = neutral_vector(finding.fit.vector[: len(NOMINAL)]), set(free_places(finding.selected))
    for place in (PLACES[name, c.name] for name in effects for c in COORDINATES[name]):
        vector[place] = (finding.fit if place in own else other).vector[place]
    return refit(finding.data, vector, finding.fit.starts, effects)


def lacks(name: str, fit: Solution, other: Solution, price: float) -> bool:
    """Whether a fit has hardly any of an effect that another fit has: taking one size for both would cost more than
    `price` of -log p, and most of the larger size lies between them. A fit that has more of it lacks nothing."""
    (here, own), (there, theirs) = (searched(sizes_of(name), one) for one in (fit, other))
    between, mine, their = (_squares(step, own + theirs) for step in (here - there, here, there))
    more = their < (1.0 - MOSTLY) ** 2 * mine
    return 0.5 * between > price and between > MOSTLY**2 * max(mine, their) and not more


def shows(name: str, finding: Finding, other: Solution, price: float) -> bool:
    """Whether logs ask for an effect beside those that were found in them. A payload that comes after the last run of a
    simulator changes nothing, and is none of the simulator's; nor is a limit at its largest command."""
    fit = with_effects(finding, (*finding.selected, name), other)
    return finding.fit.cost - fit.cost > price


def searched(pairs: Collection[tuple[str, str]], solution: Solution) -> tuple[np.ndarray, np.ndarray]:
    """Those of some coordinates that a fit has searched, from neutral (n,), and their covariance (n, n)."""
    own = [k for k, place in enumerate(solution.places) if place in {PLACES[pair] for pair in pairs}]
    free = [solution.places[k] for k in own]
    size = solution.vector[free] - neutral_vector(solution.vector[: len(NOMINAL)])[free]
    return size, solution.covariance[np.ix_(own, own)]


def _squares(step: Array, covariance: Array) -> float:
    """step' covariance^-1 step by way of the correlations: variances of what logs say nothing about are enormous."""
    deviation = np.sqrt(np.diagonal(covariance))
    unit = step / deviation
    return float(unit @ np.linalg.pinv(covariance / deviation / deviation[:, None]) @ unit)

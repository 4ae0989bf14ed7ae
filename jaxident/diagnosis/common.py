"""What robot and simulator have in common, found by explaining both together: only what differs has a price of its own.

Searched apart, two robots with the same unexplained gap make up different effects for it, which then look like
differences.
"""

from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.causes.candidates import ENOUGH, PENALTY, TERMS, Candidate, Finding, largest
from jaxident.diagnosis.causes.scores import sizes_of
from jaxident.diagnosis.causes.search import Solution, refit
from jaxident.diagnosis.causes.sets import one_more
from jaxident.diagnosis.causes.unexplained import unexplained
from jaxident.diagnosis.motion.responses import respond
from jaxident.effects.coordinates import COORDINATES, NOMINAL, PLACES, free_places, neutral_vector

BEST = 4
"""Sets of either search that are tried on the other's logs as well."""
ROUNDS = 4
"""Searches at most for one effect more beside the best pair of sets."""
MOSTLY = 0.7
"""Part of an effect's size beyond which a difference of sizes is told as the effect, below as a parameter."""

Values = dict[tuple[str, ...], tuple[float, tuple[str, ...]]]
"""Of each set of the robot its value, the evidence of both, and what of it the simulator has not, or hardly."""


class Together(NamedTuple):
    """Both searches with the sets selected that explain them best together; the values of all of the robot's sets;
    what a difference must be worth."""

    robot: Finding
    simulator: Finding
    values: Values
    price: float

    @property
    def missing(self) -> tuple[str, ...]:
        """What of the robot's selected set the simulator has not, or hardly."""
        return self.values[self.robot.selected][1]


def explain_together(robot: Finding, simulator: Finding) -> Together:
    """The pair of sets, one for the robot and one for the simulator, with the highest evidence in all.

    An effect of both is paid for once; one of either alone must be worth more than ENOUGH, and more than TERMS terms
    that no effect explains bring in both, or beside others in its own logs: as much is made up easily where something
    is missing. Effects of both take no room: first both grow as long as an effect more is found, whatever is left, and
    what the sets then leave decides the price; what an effect takes up must not be held against it.
    """
    theirs, own = _best(simulator), _best(robot)
    robot, simulator = _with_sets(robot, theirs, simulator), _with_sets(simulator, own, robot)
    robot, simulator = _grown(robot, simulator)
    price = max(ENOUGH, TERMS * min(largest(robot.terms), largest(simulator.terms)))
    chosen, partner, values = _pair(robot, simulator, price, (robot.further, simulator.further))
    both = tuple(name for name in chosen if name not in values[chosen][1])
    robot = _with_set(robot, both, robot.candidates[chosen], simulator.candidates[partner])  # what the gap begins from
    return Together(_reselected(robot, chosen), _reselected(simulator, partner), values, price)


def _grown(robot: Finding, simulator: Finding) -> tuple[Finding, Finding]:
    """Both with sets of ever more effects, and the pair selected that these lead to if every effect costs ENOUGH."""
    least = ENOUGH, (ENOUGH, ENOUGH)
    chosen, partner, _ = _pair(robot, simulator, *least)
    before: tuple[tuple[str, ...] | None, tuple[str, ...] | None] = None, None
    for _ in range(ROUNDS):
        robot = robot if chosen == before[0] else one_more(robot, chosen)
        simulator = simulator if partner == before[1] else one_more(simulator, partner)
        before = chosen, partner
        chosen, partner, _ = _pair(robot, simulator, *least)
        if (chosen, partner) == before:
            break
    robot, simulator = _crossed(robot, chosen, simulator, partner), _crossed(simulator, partner, robot, chosen)
    chosen, partner, _ = _pair(robot, simulator, *least)
    return _reselected(robot, chosen), _reselected(simulator, partner)


def _crossed(finding: Finding, own: tuple[str, ...], other: Finding, theirs: tuple[str, ...]) -> Finding:
    """With the other's set refitted here too, alone and beside each effect of the own set: grown apart, the two may
    have different names for the same thing, or one of them none."""
    for effects in (theirs, *((*theirs, name) for name in own if name not in theirs)):
        finding = _with_set(finding, effects, finding.candidates[own], other.candidates[theirs])
    return finding


def _pair(
    robot: Finding, simulator: Finding, price: float, further: tuple[float, float]
) -> tuple[tuple[str, ...], tuple[str, ...], Values]:
    """The best set of the robot and the simulator's beside it, and the values of all of the robot's sets."""
    theirs = {
        effects: fit for effects, fit in simulator.candidates.items()
        if all(shows(name, fit, simulator.candidates) for name in effects)
    }  # fmt: skip
    values: Values = {}
    partner: dict[tuple[str, ...], tuple[str, ...]] = {}
    for effects, candidate in robot.candidates.items():
        pairs = {
            other: candidate.evidence + fit.evidence + shared_worth(effects, other, price, further)
            for other, fit in theirs.items()
        }
        partner[effects] = max(pairs, key=lambda other: pairs[other])
        fit = theirs[partner[effects]]
        missing = tuple(name for name in effects if name not in fit.effects or lacks(name, fit, candidate, price))
        values[effects] = pairs[partner[effects]], missing
    chosen = max(values, key=lambda effects: values[effects][0])
    return chosen, partner[chosen], values


def shared_worth(
    own: Collection[str], theirs: Collection[str], price: float, further: tuple[float, float] = (ENOUGH, ENOUGH)
) -> float:
    """What is added to the evidence of two sets: coordinates of effects in both are paid for once, every effect costs
    ENOUGH as in a search alone, and one that only one of them has the price of a difference, or, beside others, that of
    a further effect of this one, `further`."""
    both = set(own) & set(theirs)
    worth = sum(PENALTY * len(COORDINATES[name]) - ENOUGH for name in both)
    for effects, beside in zip((own, theirs), further, strict=True):
        alone = len(set(effects) - both)
        first = min(alone, 0 if both else 1)
        worth -= price * first + max(price, beside) * (alone - first)
    return worth


def lacks(name: str, fit: Candidate, other: Candidate, price: float) -> bool:
    """Whether a fit has hardly any of an effect that another fit has: taking one size for both would cost more than
    `price` of -log p, and most of the larger size lies between them. A fit that has more of it lacks nothing."""
    pairs = [(name, c.name) for c in COORDINATES[name]]
    (here, own), (there, theirs) = (_searched(pairs, one.solution) for one in (fit, other))
    between, mine, their = (_squares(step, own + theirs) for step in (here - there, here, there))
    more = their < (1.0 - MOSTLY) ** 2 * mine
    return 0.5 * between > price and between > MOSTLY**2 * max(mine, their) and not more


def shows(name: str, fit: Candidate, found: Mapping[Any, Candidate]) -> bool:
    """Whether a fit's logs ask for one of its effects: it is worth the price of its coordinates there, by its size and
    by what the fit gains beyond its best part without it among those `found`. A payload that comes after the last run
    of a simulator changes nothing, and is none of the simulator's; nor is a limit at its largest command. What only
    shapes an effect does not count: an instant may seem well known where the change is none."""
    size, covariance = _searched(sizes_of(name), fit.solution)
    rest = max(c.gain for c in found.values() if set(c.effects) <= set(fit.effects) - {name})
    worth = 0.5 * _squares(size, covariance) if len(size) else np.inf
    return min(worth, fit.gain - rest) > PENALTY * max(len(size), 1)


def _squares(step: Array, covariance: Array) -> float:
    """step' covariance^-1 step by way of the correlations: variances of what logs say nothing about are enormous."""
    deviation = np.sqrt(np.diagonal(covariance))
    unit = step / deviation
    return float(unit @ np.linalg.pinv(covariance / deviation / deviation[:, None]) @ unit)


def _searched(pairs: list[tuple[str, str]], solution: Solution) -> tuple[np.ndarray, np.ndarray]:
    """Those of some coordinates that a fit has searched, from neutral (n,), and their covariance (n, n)."""
    own = [k for k, place in enumerate(solution.places) if place in {PLACES[pair] for pair in pairs}]
    free = [solution.places[k] for k in own]
    size = solution.vector[free] - neutral_vector(solution.vector[: len(NOMINAL)])[free]
    return size, solution.covariance[np.ix_(own, own)]


def _best(finding: Finding) -> list[tuple[str, ...]]:
    order = sorted(finding.candidates, key=lambda effects: -finding.candidates[effects].evidence)
    return list(dict.fromkeys([finding.selected, *order[:BEST]]))


def _with_sets(finding: Finding, sets: list[tuple[str, ...]], other: Finding) -> Finding:
    """With these sets refitted too, their effects begun where the other search has them."""
    for effects in sets:
        finding = _with_set(finding, effects, finding.candidates[()], other.candidates[effects])
    return finding


def _with_set(finding: Finding, effects: tuple[str, ...], begin: Candidate, other: Candidate) -> Finding:
    """With this set refitted too, from a candidate; effects that it has not begin where the other one has them."""
    if any(set(effects) == set(known) for known in finding.candidates):
        return finding
    vector, own = neutral_vector(begin.solution.vector[: len(NOMINAL)]), free_places(begin.effects)
    for place in free_places(effects)[len(NOMINAL) :]:
        vector[place] = (begin if place in own else other).solution.vector[place]
    solution = refit(finding.data, vector, begin.solution.starts, effects)
    fit = Candidate(effects, solution, finding.nominal.cost - solution.cost)
    return finding._replace(candidates=finding.candidates | {effects: fit})


def _reselected(finding: Finding, selected: tuple[str, ...]) -> Finding:
    """With another set selected, and what that one leaves unexplained."""
    if selected == finding.selected:
        return finding
    solution, windows = finding.candidates[selected].solution, finding.data.windows
    responses = respond(np.exp(solution.vector[:2]), solution.linear.residual, windows)
    terms, law = unexplained(finding.data, solution, responses, finding.likely, sized=True)
    return finding._replace(law=law, selected=selected, terms=terms)

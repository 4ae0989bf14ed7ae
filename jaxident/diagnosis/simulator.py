"""The user's own simulator, known by its logs alone: its parameters, and the effects that it has already."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from jaxident.diagnosis.noise import Law
from jaxident.diagnosis.prepare import Prepared, prepare
from jaxident.diagnosis.which import Finding, search_effects
from jaxident.log import Log


class Simulator(NamedTuple):
    """What the user's simulator is: vector (SIZE,) of its nominal parameters and effects, and their names."""

    vector: Any
    effects: tuple[str, ...]


def inspect_simulator(sim: Log | Sequence[Log], prepared: Prepared, finding: Finding) -> Simulator:
    """Nominal parameters and effects of a simulator from its logs, as far as the robot's camera could tell."""
    law = Law(finding.law.position, finding.law.heading)
    own = prepare(sim, None, finding.nominal.vector[:10], prepared, law)
    everything = np.ones(len(own.naming), bool)
    found = search_effects(own.windows, everything, own.nominal, law, sized=False)
    return Simulator(found.candidates[found.selected].solution.vector, found.selected)


def shared(finding: Finding, simulator: Simulator | None) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Effects that robot and simulator both have, and those that the simulator has alone."""
    if simulator is None:
        return (), ()
    common = tuple(name for name in simulator.effects if name in finding.selected)
    return common, tuple(name for name in simulator.effects if name not in common)

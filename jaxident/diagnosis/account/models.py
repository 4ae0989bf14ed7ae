"""The models that are judged: the corrected one, and it with some of its effects only, nominal parameters refitted."""

import dataclasses
from collections.abc import Collection, Iterator
from typing import Any, NamedTuple

import numpy as np

from jaxident.diagnosis.account.shapley import joined_by
from jaxident.diagnosis.causes.evidence import log_evidence
from jaxident.diagnosis.causes.finding import Finding
from jaxident.diagnosis.causes.search import joining
from jaxident.diagnosis.fit.refit import Data, refit
from jaxident.diagnosis.noise.law import Law
from jaxident.diagnosis.preparation.prepare import Prepared
from jaxident.diagnosis.preparation.translate import to_model
from jaxident.effects.catalogue import BY_CHANCE
from jaxident.effects.coordinates import COORDINATES, NOMINAL, PLACES, neutral_vector
from jaxident.robot.model import Model

LOST = BY_CHANCE["lost"]
"""Chance that bends the mean path, too: a change of command comes later on average."""


class Corrected(NamedTuple):
    """The corrected model, its law of noise, effects found by the search, and parameters of those that show without."""

    model: Model
    law: Law
    selected: tuple[str, ...]
    direct: dict[str, Any]


def corrected_of(prepared: Prepared, finding: Finding, law: Law, direct: dict) -> Corrected:
    """The selected set as a model."""
    model = to_model(prepared, finding.fit.vector, law, finding.selected, direct, finding.fit)
    return Corrected(model, law, finding.selected, direct)


def players_of(corrected: Corrected, common: Collection[str]) -> tuple[str, ...]:
    """Effects that bend the mean path and that the given model has not."""
    chance = [LOST] if LOST in corrected.direct else []
    return tuple(name for name in (*corrected.selected, *chance) if name not in common)


def with_players(
    prepared: Prepared, finding: Finding, corrected: Corrected, players: tuple[str, ...]
) -> Iterator[tuple[frozenset[str], Model]]:
    """The corrected model with the sets of its players that the account asks for: effects at the size that all were
    found with, and the nominal parameters refitted on the rows that fit, as if the others were nowhere."""
    fixed = {*corrected.selected, *corrected.direct} - set(players)
    for joined in joined_by(players):
        whole = len(joined) == len(players)
        yield joined, corrected.model if whole else _refitted(prepared, finding, corrected, {*fixed, *joined})


def _refitted(prepared: Prepared, finding: Finding, corrected: Corrected, kept: set[str]) -> Model:
    """The model with some effects of the corrected one."""
    names = tuple(name for name in corrected.selected if name in kept)
    direct = {name: values for name, values in corrected.direct.items() if name in kept}
    found = finding.fit
    begin = found if 2 * len(names) >= len(corrected.selected) else finding.nominal
    vector = neutral_vector(begin.vector[: len(NOMINAL)])
    places = [place for (name, _), place in PLACES.items() if name in names]
    vector[places] = found.vector[places]
    data: Data = finding.data
    if prepared.sent is not None and LOST not in kept:
        data = data._replace(windows=data.windows._replace(command=prepared.sent))
    elif not names:
        return to_model(prepared, finding.nominal.vector, corrected.law, (), direct)
    fit = refit(data, vector, begin.starts, ())
    return to_model(prepared, fit.vector, corrected.law, names, direct)


def without(model: Model, effects: Collection[str]) -> Model:
    """The model without some effects, all else alike."""
    return dataclasses.replace(model, effects=tuple(e for e in model.effects if e.name not in effects))


def placebo_of(prepared: Prepared, finding: Finding, law: Law) -> tuple[str, Model]:
    """The effect with a derivative that the search has least use for, and the model with it alone: what it shrinks is
    chance."""
    table, here = finding.table, [finding.table.here[name] for name in finding.selected]
    idle = [k for k in joining(table, here) if table.options[k].point is None]
    name = table.options[min(idle, key=lambda k: log_evidence(table, [*here, k]))].effect
    fit = refit(finding.data, finding.nominal.vector, finding.nominal.starts, (name,))
    return name, to_model(prepared, fit.vector, law, (name,))


def as_model(prepared: Prepared, vector: np.ndarray, law: Law, effects: Collection[str], direct: dict) -> Model:
    """Coordinates (10,) or (SIZE,) of a simulator with some effects as a model, judged under a law."""
    whole = vector if len(vector) > len(NOMINAL) else neutral_vector(vector)
    chance = {name: values for name, values in direct.items() if name in effects}
    return to_model(prepared, whole, law, tuple(name for name in COORDINATES if name in effects), chance)

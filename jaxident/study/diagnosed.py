"""The estimator `diagnose` of a study: what a diagnosis of each trial's log finds and names.

It is no part of a trial's compiled program: a diagnosis decides as it goes, and takes seconds. It sees the log alone,
and identifies its nominal model from it.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.decide import VERDICTS
from jaxident.diagnosis.diagnose import Diagnosis, diagnose
from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.coordinates import NOMINAL
from jaxident.errors import InputError, WorkError
from jaxident.log import Log
from jaxident.robot.difference import to_difference
from jaxident.robot.drive import Physical
from jaxident.robot.model import DIFFERENCE_ORDER, Model, difference_vector, require_physical
from jaxident.study.design import Study
from jaxident.study.estimators import settings_of
from jaxident.study.sight import FOUND, REFUSED, Finding
from jaxident.study.trial import Outcome, Recording

NO_VERDICT = -1


class Naming(NamedTuple):
    """verdict: a place in VERDICTS; takes_part (effects,): probability of each effect of the catalogue; named
    (effects,): 1 where it is named, else 0; alike (effects,): 1 where the diagnosis says that a named one looks so."""

    verdict: Any
    takes_part: Any
    named: Any
    alike: Any


NO_NAMING = Naming(NO_VERDICT, *[np.full(len(CATALOGUE), np.nan)] * 3)


def with_diagnoses(study: Study, outcome: Outcome, recording: Callable[[int], Recording]) -> Outcome:
    """The outcome (trials, ...) of the compiled estimators with those of the diagnoses in their places.
    recording(trial) is what a trial's estimators see."""
    if not study.diagnoses:
        return outcome
    estimate, deviation, reason = (np.array(part) for part in (outcome.estimate, outcome.deviation, outcome.reason))
    naming = [[NO_NAMING] * len(study.estimators) for _ in estimate]
    for trial in range(len(estimate)):
        log = recording(trial).log()
        for place in study.diagnoses:
            found, naming[trial][place] = diagnose_log(log, settings_of(study.estimators[place])["horizon"])
            estimate[trial, place], deviation[trial, place], reason[trial, place] = found
    told = Naming(*(np.array([[one[k] for one in row] for row in naming]) for k in range(len(Naming._fields))))
    told = told._replace(verdict=told.verdict.astype("i1"))
    return Outcome(estimate, deviation, outcome.truth, reason, **told._asdict())


def diagnose_log(log: Log, horizon: float) -> tuple[Finding, Naming]:
    """The corrected model's parameters with their deviations, and what is named. A log that is refused, or on which the
    arithmetic ends, has no numbers: it must not end a study of thousands. horizon [s]: 0 for the default."""
    try:
        found = diagnose(log, horizon=horizon or None)
    except (InputError, WorkError, np.linalg.LinAlgError):
        none = np.full(len(DIFFERENCE_ORDER), np.nan)
        return Finding(none, none, REFUSED), NO_NAMING
    return Finding(*parameters_of(found.corrected_model), FOUND), naming_of(found)


def naming_of(found: Diagnosis) -> Naming:
    """What a diagnosis says of every effect of the catalogue."""
    probability = {cause.effect: cause.probability for cause in found.judgement.causes}
    takes_part = np.array([probability.get(name, 0.0) for name in CATALOGUE])
    others = {one for c in found.judgement.causes if c.effect in found.selected for one in c.indistinguishable_from}
    named, alike = (np.array([float(name in names) for name in CATALOGUE]) for names in (found.selected, others))
    return Naming(VERDICTS.index(found.verdict), takes_part, named, alike)


def parameters_of(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Parameters (12,) in DIFFERENCE_ORDER of a physical model, and their deviations to first order, NaN where it has
    no covariance."""
    drive = require_physical(model)
    coupling = np.zeros(2) if drive.coupling is None else drive.coupling
    point = np.concatenate([drive.rate, np.ravel(drive.gain), model.dead_zone, coupling])
    found, slopes = _by_difference(point, model.sample_period)
    here = {name: place for place, name in enumerate(model.parameter_order)}
    if model.covariance is None or not here.keys() >= set(NOMINAL):
        return np.asarray(found), np.full(len(found), np.nan)
    own = [here[name] for name in NOMINAL]
    covariance = np.asarray(model.covariance)[np.ix_(own, own)]
    return np.asarray(found), np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", slopes, covariance, slopes), 0.0))


@jax.jit
def _by_difference(point: Array, period: Array) -> tuple[Array, Array]:
    """A point in the order of NOMINAL as parameters (12,) of the difference equations, and their derivatives."""

    def parameters(p):
        return difference_vector(to_difference(Physical(p[:2], p[2:6].reshape(2, 2), p[8:10]), period), p[6:8])

    return parameters(point), jax.jacfwd(parameters)(point)

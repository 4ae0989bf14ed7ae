"""Which end of a search is taken: the one with more log evidence, unless another foretells the poses better."""

import math
from types import SimpleNamespace

import jax
import numpy as np
import pytest

from jaxident.diagnosis.causes.ends import CLEARLY, best_end, foretells_better, misses
from jaxident.diagnosis.noise.law import Law, first_law
from jaxident.diagnosis.preparation.judging import on_fitted
from jaxident.diagnosis.preparation.prepare import prepare
from jaxident.effects.coordinates import PLACES, neutral_vector, nominal_vector
from jaxident.effects.simulate import simulate
from jaxident.estimation.ahead.stretches import Starts
from jaxident.estimation.predict import predict
from jaxident.log import Log
from jaxident.robot.drive import Physical
from jaxident.robot.model import Effect, Model
from jaxident.robot.noise import Noise
from jaxident.study.synthetic import excite

LAW = Law(4e-4, 3e-3)
DELAY = ("transport_delay", "delay")
ROBOT = Model(
    1.0 / 30.0, Physical(np.array([4.0, 5.0]), np.array([[0.5, 0.45], [9.0, -8.5]])), np.array([0.1, 0.12]),
    Noise(LAW.position, LAW.heading), (Effect("transport_delay", {"delay": 0.1}),),
)  # fmt: skip


@pytest.fixture(scope="module")
def prepared():
    """Three runs of a robot with a delay of 0.1 s."""
    plain = [excite(jax.random.key(k), "multilevel", 400, ROBOT.sample_period, hold=10) for k in range(3)]
    runs = [simulate(ROBOT, log, key=jax.random.key(10 + k)) for k, log in enumerate(plain)]
    return prepare([Log(*map(np.asarray, run)) for run in runs], None)


def end(prepared, log_evidence, vector=None, effects=()):
    """An end at some coordinates, those of the nominal fit by default."""
    fit = SimpleNamespace(vector=np.array(prepared.nominal.vector if vector is None else vector))
    settled = SimpleNamespace(now=SimpleNamespace(fit=fit, effects=effects))
    return SimpleNamespace(settled=settled, likely=LAW, log_evidence=log_evidence)


def true_coordinates(prepared):
    """Those of the robot, for commands over the largest."""
    physical, largest = ROBOT.dynamics, prepared.largest
    scaled = Physical(physical.rate, physical.gain * largest)
    vector = neutral_vector(nominal_vector(scaled, ROBOT.dead_zone / largest))
    vector[PLACES[DELAY]] = 0.1
    return vector


def test_an_end_misses_the_rows_that_fit_by_what_predict_misses_them_by(prepared):
    fitted, camera = on_fitted(prepared), first_law(prepared.windows)
    found = misses(fitted, end(prepared, 0.0, true_coordinates(prepared), DELAY[:1]))
    ahead = predict(ROBOT, fitted.log, prepared.rows, stride=1)
    runs, seen = fitted.log.runs(), []
    for run, row in zip(fitted.judging.run, fitted.judging.row, strict=True):
        here = (ahead.run == runs[run].run[0]) & (ahead.start == row) & (ahead.step == prepared.rows)
        missed = [
            float(getattr(ahead, k)[here][0] - getattr(runs[run], k)[row + prepared.rows]) for k in ("x", "y", "theta")
        ]
        missed[2] = (missed[2] + np.pi) % (2.0 * np.pi) - np.pi
        seen.append(np.mean(np.square(missed) / np.square([camera.position, camera.position, camera.heading])))
    np.testing.assert_allclose(found, seen, rtol=1e-6)


def test_the_end_that_foretells_better_is_taken_in_spite_of_its_evidence(prepared):
    plain, delayed = end(prepared, 100.0), end(prepared, 0.0, true_coordinates(prepared), DELAY[:1])
    assert np.mean(misses(on_fitted(prepared), delayed)) < 0.5 * np.mean(misses(on_fitted(prepared), plain))
    assert best_end(prepared, [plain, delayed]) is delayed
    assert best_end(prepared, [delayed, plain]) is delayed


def test_evidence_decides_between_ends_that_foretell_alike(prepared):
    ends = [end(prepared, evidence) for evidence in (1.0, 3.0, 2.0)]
    assert best_end(prepared, ends) is ends[1]
    assert best_end(prepared, ends[:1]) is ends[0]
    nothing = prepared._replace(naming=Starts(np.zeros(0, int), np.zeros(0, int)))
    assert best_end(nothing, ends) is ends[1]


def test_chance_alone_foretells_better_as_often_as_said():
    """Of 400 pairs as many as a normal variable is beyond CLEARLY, within four standard errors."""
    rng = np.random.default_rng(0)
    wrong = sum(foretells_better(*rng.chisquare(3, (2, 60))) for _ in range(400))
    share = 0.5 * math.erfc(CLEARLY / 2.0**0.5)
    assert wrong / 400 == pytest.approx(share, abs=4.0 * np.sqrt(share * (1.0 - share) / 400))


def test_an_end_that_runs_away_is_not_taken(prepared):
    fine = np.linspace(1.0, 2.0, 9)
    wild = np.where(np.arange(9) == 3, np.inf, 0.1 * fine)
    assert foretells_better(fine, wild)
    assert not foretells_better(wild, fine)
    away = end(prepared, 0.0)
    away.settled.now.fit.vector[8:10] = 2000.0  # couplings that make speeds grow by e every half a millisecond
    assert np.isinf(misses(on_fitted(prepared), away)).all()

"""Trials of several runs."""

import dataclasses

import jax
import numpy as np
import pytest
from support.studies import ROBOT, SMALL

import jaxident as ji
from jaxident.errors import InputError
from jaxident.report.sweep import write_study
from jaxident.robot.model import Effect
from jaxident.robot.noise import Noise
from jaxident.study import bound
from jaxident.study.dataset import describe, study_arrays
from jaxident.study.design import Candidate, EffectSet, check_study
from jaxident.study.engine import run_one
from jaxident.study.sight import FOUND, Choice
from jaxident.study.statistics import summarise
from jaxident.study.synthetic import simulate_runs

PAYLOAD = (Effect("payload_change", {"ratio": 0.5, "instant": 4.0}),)
PLAIN = SMALL._replace(robots=(Candidate("published", ROBOT),), excitations=("multilevel",), noise=(1e-5,), hold=5)
THREE = PLAIN._replace(runs=3)


def test_the_first_run_is_the_trial_with_one_run_and_the_others_have_draws_of_their_own():
    made, alone = (run_one(study, 0)[0] for study in (THREE, PLAIN))
    log = made.log()
    assert np.unique(log.run).tolist() == [0, 1, 2]
    assert len(log.t) == 180
    runs = log.runs()
    for column in ("t", "u_r", "x", "theta"):
        np.testing.assert_allclose(getattr(runs[0], column), getattr(alone.log(), column), rtol=0, atol=1e-15)
    for one, other in ((0, 1), (0, 2), (1, 2)):
        assert np.any(runs[one].u_r != runs[other].u_r)
    error = (made.measured.x - made.exact.x).reshape(3, 60)
    assert np.max(np.abs(np.corrcoef(error)[np.triu_indices(3, 1)])) < 0.5
    np.testing.assert_allclose(made.exact.x.reshape(3, 60)[:, 0], 0.0)


@pytest.mark.slow  # a program more, which takes 15 s to compile
def test_effects_go_on_from_run_to_run():
    """A load comes after 4 s, in the third run of 2 s: poses are those of `simulate_runs`."""
    study = THREE._replace(effects=(EffectSet("load", PAYLOAD),))
    made, plain = (run_one(each, 0)[0] for each in (study, THREE))
    expected = simulate_runs(dataclasses.replace(ROBOT, effects=PAYLOAD), made.log(), key=jax.random.key(0))
    np.testing.assert_allclose(made.exact.x, expected.x, atol=1e-9)
    away = np.abs(made.exact.x - plain.exact.x).reshape(3, 60).max(axis=1)
    assert away[:2].max() < 1e-6
    assert away[2] > 1e-3


@pytest.mark.slow  # the four methods take a minute to compile
def test_every_method_sees_all_runs_and_no_seam(tmp_path):
    """Runs begin at the origin: a seam taken for motion would throw an estimate away by metres."""
    methods = ("batch", "recursive", "key-term-least-squares", "maximum-likelihood")
    chosen = tuple(Choice(m, m, (("coupling", True),) if m == "maximum-likelihood" else ()) for m in methods)
    study = PLAIN._replace(estimators=chosen, samples=(150,), noise=(1e-6,), seeds=2, runs=4)
    whole = study_arrays(study)
    write_study(study, whole, summarise(whole), tmp_path / "page.html")
    assert "2 trials of 4 runs each" in (tmp_path / "page.html").read_text()
    found = whole.squeeze()
    assert np.all(found["reason"] == FOUND)
    sure = ["alpha_1", "alpha_2", "dead_zone_r", "dead_zone_l"]
    error = np.abs(found["estimate"] - found["truth"]).sel(parameter=sure)
    assert float(error.max()) < 3e-3
    best = error.sel(estimator="maximum-likelihood") / found["deviation"].sel(
        estimator="maximum-likelihood", parameter=sure
    )
    assert float(best.max()) < 5.0


@pytest.mark.slow
def test_the_bound_is_that_of_all_runs(monkeypatch):
    monkeypatch.setattr(bound, "SEEDS", 1)
    found = bound.bounds(THREE).squeeze()
    expected = ji.cramer_rao(ROBOT, run_one(THREE, 0)[0].log(), Noise(1e-5, 1e-4)).difference_deviation
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_a_study_of_one_run_is_told_as_before():
    """Folders of older versions go on."""
    assert "runs" not in describe(PLAIN)
    assert describe(THREE)["runs"] == 3


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"runs": 0}, "runs: is 0; it should be at least 1"),
        ({"runs": 200_000}, "60 in 200000 runs is too long"),
        ({"estimators": (Choice("iv", "instrumental-variables"),)}, "takes one run"),
    ],
)
def test_what_makes_no_sense_is_refused(change, words):
    with pytest.raises(InputError, match=words):
        check_study(THREE._replace(**change))

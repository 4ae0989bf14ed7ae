"""`diagnose` as an estimator of a study."""

import numpy as np
import pytest
import xarray
from support.studies import SMALL

import jaxident as ji
from jaxident.diagnosis.decide import VERDICTS
from jaxident.effects.catalogue import CATALOGUE
from jaxident.files.models import load_model
from jaxident.robot.drive import Physical
from jaxident.robot.model import Effect, Model
from jaxident.study.dataset import study_arrays
from jaxident.study.design import Candidate, EffectSet
from jaxident.study.diagnosed import naming_of, parameters_of
from jaxident.study.engine import chunk_shape, run_one
from jaxident.study.sight import REASONS, REFUSED, Choice
from jaxident.study.statistics import summarise

DELAY = Effect("transport_delay", {"delay": 0.1})
STUDY = SMALL._replace(
    robots=(Candidate("published", load_model("published")),),
    estimators=(*SMALL.estimators, Choice("named", "diagnose")),
    effects=(EffectSet("none"), EffectSet("late", (DELAY,))),
    noise=(1e-4,),
    excitations=("multilevel",),
    samples=(600,),
    hold=10,
    seeds=1,
)


@pytest.fixture(scope="module")
def trials():
    return study_arrays(STUDY)


@pytest.mark.slow
def test_the_effect_that_acts_is_named_and_no_other(trials):
    named = trials.sel(estimator="named").squeeze()
    assert [VERDICTS[k] for k in named["verdict"].values] == ["no_gap", "effects"]
    assert named["named"].sel(effect="none").sum() == 0
    late = named.sel(effect="late")
    assert late["catalogue"].values[late["named"].values == 1.0].tolist() == ["transport_delay"]
    assert late["takes_part"].sel(catalogue="transport_delay") > 0.99
    other = trials.sel(estimator="key-term")
    assert np.all(other["verdict"] == -1)
    assert np.all(np.isnan(other["named"]))


@pytest.mark.slow
def test_its_parameters_are_those_of_the_corrected_model(trials):
    """Under the delay too; another estimator takes the delay for poles and gains."""
    named = trials.sel(estimator="named").squeeze()
    sure = ["alpha_1", "alpha_2", "dead_zone_r", "dead_zone_l"]
    away = ((named["estimate"] - named["truth"]) / named["deviation"]).sel(parameter=sure)
    assert np.all(np.abs(away) < 4.0)


@pytest.mark.slow
def test_a_trial_alone_is_diagnosed_as_in_the_study(trials):
    """Also as by `diagnose` on the log that the trial leaves."""
    recording, outcome = run_one(STUDY, 1)
    whole = trials.isel(effect=1).squeeze()
    for name in ("estimate", "deviation", "verdict", "takes_part", "named", "alike"):
        np.testing.assert_array_equal(getattr(outcome, name), whole[name])
    verdict, _, named, _ = naming_of(ji.diagnose(recording.log()))
    assert verdict == whole["verdict"].sel(estimator="named")
    np.testing.assert_array_equal(named, whole["named"].sel(estimator="named"))


def test_a_log_that_is_refused_counts_as_a_failure():
    short = study_arrays(STUDY._replace(samples=(30,), effects=()))
    assert int(short["reason"].sel(estimator="named").squeeze()) == REFUSED
    assert np.all(np.isnan(short["estimate"].sel(estimator="named")))
    failures = summarise(short)["failures"].sel(estimator="named", reason=REASONS[REFUSED])
    assert int(failures.sum()) == 1


def test_few_trials_are_lost_where_each_takes_seconds():
    many = STUDY._replace(seeds=50, chunk=2000)
    assert np.prod(chunk_shape(many)) <= 4
    assert np.prod(chunk_shape(many._replace(estimators=SMALL.estimators))) == 100


def test_deviations_of_parameters_are_to_first_order():
    drive = Physical(np.array([3.0, 5.0]), np.array([[0.8, 0.78], [9.0, -9.2]]), np.array([0.1, 0.2]))
    order = ("rate_1", "rate_2", "gain_11", "gain_12", "gain_21", "gain_22", "dead_zone_r", "dead_zone_l",
             "coupling_1", "coupling_2")  # fmt: skip
    spread = np.linspace(1e-4, 1e-3, 10)
    model = Model(0.05, drive, np.array([0.1, 0.12]), covariance=np.diag(spread**2), parameter_order=order)
    found, deviation = parameters_of(model)
    point = np.array([3.0, 5.0, 0.8, 0.78, 9.0, -9.2, 0.1, 0.12, 0.1, 0.2])
    drawn = point + spread * np.random.default_rng(0).normal(size=(4000, 10))
    made = [
        parameters_of(Model(0.05, Physical(p[:2], p[2:6].reshape(2, 2), p[8:]), p[6:8]))[0] for p in drawn
    ]  # fmt: skip
    np.testing.assert_allclose(np.std(made, axis=0), deviation, rtol=0.05)
    np.testing.assert_allclose(np.mean(made, axis=0), found, atol=4.0 * np.max(deviation) / 60.0)


@pytest.mark.slow
def test_workers_find_the_same(tmp_path):
    """In this process and in two others: the same numbers."""
    content = STUDY._replace(seeds=2, chunk=1)
    ji.study(content, out=tmp_path / "whole")
    ji.study(content, out=tmp_path / "workers", scheduler="local:2")
    one, other = (xarray.open_zarr(tmp_path / name / "trials.zarr").load() for name in ("whole", "workers"))
    xarray.testing.assert_identical(one, other)
    assert len(one["catalogue"]) == len(CATALOGUE)

"""Files that version 0.1 wrote stay readable: tests/data/version_0_1, never to be written anew."""

import json
import pathlib
import shutil

import numpy as np
import pytest

from jaxident.files.models import load_model, model_to_dict, save_model
from jaxident.files.studies import read_study
from jaxident.files.trials import completed, open_trials
from jaxident.robot.model import DIFFERENCE_ORDER
from jaxident.study.dataset import describe

OLD = pathlib.Path(__file__).resolve().parents[1] / "data" / "version_0_1"


def test_a_model_with_every_section(tmp_path):
    model = load_model(OLD / "corrected_model.json")
    assert [effect.name for effect in model.effects] == ["transport_delay", "quadratic_drag"]
    assert model.effects[0].parameters["delay"] == 0.0521
    assert (model.noise.correlation_time, model.noise.slip_heading) == (0.2, 0.02)
    assert model.provenance.runs == (("a", 0.0),)
    assert model.provenance.from_prior == ("rate_1",)
    np.testing.assert_array_equal(model.covariance, np.diag([0.01, 0.04]))
    save_model(model, tmp_path / "again.json")
    assert model_to_dict(load_model(tmp_path / "again.json")) == model_to_dict(model)


def test_a_store_of_trials(tmp_path):
    shutil.copytree(OLD / "study", tmp_path / "study")
    with open_trials(tmp_path / "study" / "trials.zarr") as trials:
        assert trials["estimate"].sizes["seed"] == 3
        assert list(trials["parameter"].values) == list(DIFFERENCE_ORDER)
        assert list(trials["effect"].values) == ["none", "motor_lag x1"]
        assert trials["noise"].attrs["units"] == "m"
        truth = trials["truth"].isel(seed=0, noise=0, effect=0).sel(parameter="dead_zone_r")
        assert float(truth.squeeze()) == pytest.approx(0.25)
        assert np.isfinite(trials["estimate"].values).all()
        error = trials["estimate"] - trials["truth"]
        assert float(np.abs(error.isel(effect=0, noise=0).sel(parameter="alpha_1")).max()) < 0.05


def test_a_study_means_what_it_meant():
    """Word for word, so that a sweep that 0.1 began can go on; a lag had no `second_order` then."""
    kept = json.loads((OLD / "study" / "study.json").read_text("utf-8"))
    assert kept["schema"] == "jaxident.study/1"
    assert json.loads(json.dumps(describe(read_study(OLD / "study.toml")))) == completed(kept["study"])
    assert completed(kept["study"]) != kept["study"]


def test_a_diagnosis_has_the_names_that_programs_read():
    kept = json.loads((OLD / "diagnosis.json").read_text("utf-8"))
    assert kept["schema"] == "jaxident.diagnosis/2"
    assert kept["selected"] == [effect.name for effect in load_model(OLD / "corrected_model.json").effects]
    assert sum(one["p"] for one in kept["probability"]["sets"]) == pytest.approx(1.0)
    assert sum(row["share"] for row in kept["account"]["rows"]) == pytest.approx(1.0, abs=1e-9)
    for key in ("verdict", "gap", "where", "causes", "discovered", "parameters", "not_testable", "next"):
        assert key in kept

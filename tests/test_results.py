"""Results as users hold them: what they print, show in a notebook, tabulate and write."""

import pathlib

import numpy as np
import pytest
from support.diagnoses import VERDICTS, made_up

import jaxident as ji
from jaxident import results
from jaxident.effects.simulate import simulate
from jaxident.report.words import length, plain_text


@pytest.fixture(scope="module")
def log():
    """A run of the published robot with camera noise."""
    rng = np.random.default_rng(0)
    t = np.arange(400) / 30.0
    u = np.repeat(rng.uniform(-1.0, 1.0, (40, 2)), 10, axis=0)
    clean = simulate(ji.load_model("published"), ji.make_log(t, u[:, 0], u[:, 1]))
    return clean._replace(x=clean.x + rng.normal(0, 5e-4, 400), y=clean.y + rng.normal(0, 5e-4, 400),
                          theta=clean.theta + rng.normal(0, 5e-3, 400))  # fmt: skip


@pytest.fixture(scope="module")
def identified(log):
    return ji.identify(log, noise_law="white")


def test_an_identification_tells_every_parameter(identified, log, tmp_path):
    lines = repr(identified).splitlines()
    assert lines[0].startswith("identified from 400 poses in 1 runs: ")
    frame = identified.to_dataframe()
    assert list(frame.columns) == ["parameter", "estimate", "low", "high", "verdict", "reason"]
    assert [line.split()[0] for line in lines[1 : 1 + len(frame)]] == list(frame.parameter)
    assert frame.estimate[0] == pytest.approx(identified.model.physical.rate[0])
    assert identified._repr_html_().count("<img") == 1
    identified.save(tmp_path / "model.json")
    np.testing.assert_allclose(ji.load_model(tmp_path / "model.json").physical.rate, identified.model.physical.rate)
    identified.report(tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text("utf-8").startswith("<!DOCTYPE html>")


def test_an_identification_that_failed_says_so(identified):
    changed = identified._replace(ok=False)
    assert "do not trust" in repr(changed)
    assert changed.logs == identified.logs


def test_a_prediction_is_held_against_its_log(identified, log, tmp_path):
    found = ji.predict(identified.model, log, horizon=30)
    error = found.error
    assert repr(found).startswith(f"{error['starts']} free runs of 1 s")
    assert plain_text(length(error["position_rms"])) in repr(found)
    frame = found.to_dataframe()
    assert len(frame) == len(found.t)
    assert frame.run.dtype.kind == "i"
    np.testing.assert_array_equal(frame.x, found.x)
    assert found._repr_html_().count("<img") == 1
    found.save(tmp_path / "predicted.csv")
    assert len((tmp_path / "predicted.csv").read_text("utf-8").splitlines()) == 1 + len(frame)


@pytest.mark.parametrize("verdict", VERDICTS)
def test_a_diagnosis_shows_its_account(verdict):
    found = results.diagnosed(made_up(verdict))
    assert "who causes the error" in repr(found)
    frame = found.to_dataframe()
    assert frame.share.sum() == pytest.approx(1.0)
    assert found._repr_html_().count("<img") == 1


def test_a_diagnosis_writes_what_the_command_writes(tmp_path):
    found = results.diagnosed(made_up("effects"))
    found.save(tmp_path / "out")
    written = {path.name for path in pathlib.Path(tmp_path / "out").iterdir()}
    assert written == {"diagnosis.json", "nominal_model.json", "corrected_model.json", "report.html"}
    effects = ji.load_model(tmp_path / "out" / "corrected_model.json").effects
    assert [effect.name for effect in effects] == [effect.name for effect in found.corrected_model.effects]


def test_what_stands_in_a_notebook_is_escaped(identified):
    shown = identified._replace(suspicions=("<script>",))._repr_html_()
    assert "<script>" not in shown
    assert "&lt;script&gt;" in shown

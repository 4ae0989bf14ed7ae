"""`jaxident diagnose`, as a user runs it: quickly what it refuses, and slowly what it finds."""

import json
import shutil

import numpy as np
import pytest
from click.testing import CliRunner

from jaxident.cli.diagnose import command
from jaxident.cli.predict import command as predict
from jaxident.errors import InputError
from jaxident.files.logs import read_log, write_log
from jaxident.files.models import load_model
from jaxident.log import make_log


@pytest.fixture(autouse=True)
def started(monkeypatch):
    for name in ("diagnose", "predict"):  # the tests' own start has no cache
        monkeypatch.setattr(f"jaxident.cli.{name}.start_jax", lambda: None)


def refused(*words) -> str:
    result = CliRunner().invoke(command, list(words))
    assert isinstance(result.exception, InputError), result
    return str(result.exception)


def test_a_robot_that_stands_is_refused(tmp_path):
    rng = np.random.default_rng(0)
    t = np.arange(200) * 0.05
    write_log(make_log(t, rng.normal(size=200), rng.normal(size=200), *(1e-3 * rng.normal(size=(3, 200)))),
              tmp_path / "log.csv")  # fmt: skip
    assert "nothing moves" in refused(str(tmp_path / "log.csv"), "--out", str(tmp_path / "out"))
    assert not any((tmp_path / "out").iterdir())


def test_missing_files_and_short_runs_are_refused(tmp_path):
    assert "nowhere.csv" in refused(str(tmp_path / "nowhere.csv"))
    t = np.arange(60) * 0.05
    u = np.sign(np.sin(t))
    short = make_log(t, u, 0.5 * u, np.cumsum(0.01 * u), 0.0 * t, np.cumsum(0.005 * u))
    write_log(short, tmp_path / "short.csv")
    assert "none to judge by" in refused(str(tmp_path / "short.csv"), "--out", str(tmp_path / "out"))


def test_logs_whose_stretches_never_show_their_start_are_refused(tmp_path):
    """The camera sees the second half of every two seconds only."""
    rng = np.random.default_rng(1)
    t = np.arange(1200) * 0.05
    u = np.sign(np.sin(t))
    pose = [np.cumsum(0.01 * u), 1e-3 * rng.normal(size=1200), np.cumsum(0.005 * u)]
    seen = np.arange(1200) % 40 >= 20
    write_log(make_log(t, u, 0.5 * u, *(np.where(seen, column, np.nan) for column in pose)), tmp_path / "log.csv")
    assert "poses among its first 20" in refused(str(tmp_path / "log.csv"), "--out", str(tmp_path / "out"))


def test_sim_takes_all_words_up_to_the_next_option():
    words = ["real_1.csv", "real_2.csv", "--sim", "sim_1.csv", "sim_2.csv", "--out", "found"]
    given = command.make_context("diagnose", words).params
    assert given["logs"] == ("real_1.csv", "real_2.csv")
    assert given["sim"] == ("sim_1.csv", "sim_2.csv")
    assert given["out"] == "found"
    again = command.make_context("diagnose", ["real_1.csv", "--sim", "a.csv", "--sim", "b.csv"]).params
    assert again["sim"] == ("a.csv", "b.csv")


def promised_on(out, log):
    """Mean square of the errors of `jaxident predict` over the camera's variances, the corrected model on one log."""
    found, path = json.loads((out / "diagnosis.json").read_text()), out / "predicted.csv"
    model = load_model(out / "corrected_model.json")
    horizon = round(found["gap"]["horizon"] / model.sample_period)
    words = [str(out / "corrected_model.json"), str(log), "--horizon", str(horizon), "--out", str(path)]
    assert CliRunner().invoke(predict, words).exit_code == 0
    predicted, measured = np.genfromtxt(path, delimiter=",", names=True), read_log(log)
    path.unlink()
    ends = predicted[predicted["step"] == horizon]
    rows = (ends["start"] + horizon).astype(int)
    errors = np.stack([measured.pose[k][rows] - ends[name] for k, name in enumerate(("x", "y", "theta"))])
    errors[2] = np.angle(np.exp(1j * errors[2]))
    camera = np.array([model.noise.position, model.noise.position, model.noise.heading])
    return np.mean((errors / camera[:, None]) ** 2)


@pytest.mark.slow
@pytest.mark.parametrize("effect", ["none", "turn_loss", "transport_delay"])
def test_the_effect_of_an_example_is_found(tmp_path, effect):
    """Example logs with a hidden effect, and without: some minutes."""
    from jaxident.cli.example import command as example

    logs, out = tmp_path / "logs", tmp_path / "out"
    assert CliRunner().invoke(example, ["--effect", effect, "--out", str(logs)]).exit_code == 0
    result = CliRunner().invoke(command, [str(logs), "--out", str(out)])
    assert result.exit_code == 0, result
    found = json.loads((out / "diagnosis.json").read_text())
    assert found["verdict"] == ("no_gap" if effect == "none" else "effects")
    if effect != "none":
        alike = {name for cause in found["causes"][:1] for name in (cause["effect"], *cause["indistinguishable_from"])}
        assert effect in alike
    assert {path.name for path in out.iterdir()} == {
        "diagnosis.json", "nominal_model.json", "corrected_model.json", "report.html",
    }  # fmt: skip
    kept = promised_on(out, logs / "real_2.csv"), promised_on(out, logs / "real_5.csv")
    assert np.mean(kept) == pytest.approx(found["gap"]["after"], rel=0.1)


@pytest.mark.slow
def test_the_same_logs_give_the_same_bytes_in_any_order_and_in_any_folder(tmp_path):
    """Logs that are numbered, listed forwards and backwards."""
    from jaxident.cli.example import command as example

    assert CliRunner().invoke(example, ["--effect", "transport_delay", "--out", str(tmp_path / "a")]).exit_code == 0
    shutil.copytree(tmp_path / "a", tmp_path / "b")
    made = []
    for folder, order in (("a", 1), ("b", -1)):
        paths = sorted((tmp_path / folder).glob("real_*.csv"))[::order]
        result = CliRunner().invoke(command, [*map(str, paths), "--out", str(tmp_path / folder / "out")])
        assert result.exit_code == 0, result
        made.append({path.name: path.read_bytes() for path in (tmp_path / folder / "out").iterdir()})
    assert made[0] == made[1]

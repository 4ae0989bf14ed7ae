"""The installed program, as a user runs it: exit codes, one line for what is wrong, nothing half-written."""

import dataclasses
import json
import os
import re
import subprocess
import sys

import numpy as np
import pytest
from support.program import jaxident, refused

from jaxident.cli.main import _show_warning
from jaxident.files.logs import read_log
from jaxident.files.models import load_model, save_model
from jaxident.robot.model import Effect, Provenance


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a noisy log of the published robot and the paper's model of it."""
    folder = tmp_path_factory.mktemp("program")
    made = jaxident("simulate", "published", "--excitation", "staircase", "--samples", 600, "--hold", 5,
                    "--noise", "1e-6,1e-5", "--out", folder / "log.csv")  # fmt: skip
    assert made.returncode == 0, made.stderr
    found = jaxident("identify", folder / "log.csv", "--method", "paper", "--reading", "one-step", "--out",
                     folder / "model.json", "--json", folder / "result.json")  # fmt: skip
    assert found.returncode == 0, found.stderr
    assert "dead_zone_r" in found.stdout
    assert "wrote" in found.stdout
    return folder


def test_help_names_every_command():
    result = jaxident("--help")
    assert result.returncode == 0
    for name in ("reproduce", "example", "simulate", "convert", "identify", "predict"):
        assert name in result.stdout
        assert "Example:" in jaxident(name, "--help").stdout


def test_identify_writes_a_model_that_is_right(folder):
    model = load_model(folder / "model.json")
    assert model.physical is None
    assert model.provenance.logs == ("log.csv",)
    np.testing.assert_allclose(model.alpha, [0.9821, 0.7706], atol=5e-3)
    np.testing.assert_allclose(model.dead_zone, [0.25, 0.2], atol=0.02)
    result = json.loads((folder / "result.json").read_text())
    assert len(result["parameters"]) == 12


@pytest.mark.slow
def test_identify_bootstraps_with_a_seed(folder):
    log = read_log(folder / "log.csv")
    rows = zip(*(column[:120] for column in (log.t, log.u_r, log.u_l, log.x, log.y, log.theta)), strict=True)
    text = "t,u_r,u_l,x,y,theta\n" + "".join(",".join(map(repr, map(float, row))) + "\n" for row in rows)
    (folder / "short.csv").write_text(text)
    found = jaxident("identify", folder / "short.csv", "--noise-law", "white", "--bootstrap", 40, "--seed", 3,
                     "--json", folder / "b.json", "--report", folder / "b.html")  # fmt: skip
    assert found.returncode == 0, found.stderr
    assert "of 40 refits to resampled blocks" in found.stdout
    result = json.loads((folder / "b.json").read_text())
    own = {row["parameter"]: row for row in result["parameters"]}
    for name, (low, high) in result["bootstrap"]["intervals"].items():
        assert low < high
        assert name in own
        row = next(line for line in found.stdout.splitlines() if line.startswith(f"{name} "))
        shown = np.array([float(end) for end in re.findall(r"\[([^,]+), ([^\]]+)\]", row)[1]])
        told = np.array([low, high]) * (1e3 if " mm " in row or " mrad " in row else 1.0)
        np.testing.assert_allclose(shown, told, atol=0.1 * np.ptp(told))  # digits by the interval
    assert "bootstrap 95 %" in (folder / "b.html").read_text(encoding="utf-8")


def test_predict_writes_the_columns_of_the_contract(folder):
    result = jaxident("predict", folder / "model.json", folder / "log.csv", "--horizon", 30, "--out", folder / "p.csv")
    assert result.returncode == 0, result.stderr
    lines = (folder / "p.csv").read_text().splitlines()
    assert lines[0] == "run,start,step,t,x,y,theta,sd_x,sd_y,sd_theta"
    rows = np.array([list(map(float, line.split(","))) for line in lines[1:]])
    assert set(rows[:30, 1]) == {20.0}
    np.testing.assert_array_equal(rows[:30, 2], np.arange(1, 31))
    truth = read_log(folder / "log.csv")
    ends = rows[rows[:, 2] == 30]
    index = (ends[:, 1] + 30).astype(int)
    assert np.median(np.hypot(ends[:, 4] - truth.x[index], ends[:, 5] - truth.y[index])) < 5e-3


def test_predict_warns_where_the_poses_begin_a_session(tmp_path):
    """A log that the robot drove from session time 0 on, and a model whose own logs took 60 s; from 3 s on the option
    that is told says so."""
    robot = dataclasses.replace(load_model("published"), effects=(Effect("gain_drift", {"rate": -0.005}),))
    save_model(
        dataclasses.replace(robot, provenance=Provenance(duration=60.0, runs=(("a", 0.0),))), tmp_path / "model.json"
    )
    made = jaxident("simulate", "published", "--excitation", "multilevel", "--samples", 400, "--effect",
                    "gain_drift:rate=-0.005", "--out", tmp_path / "log.csv")  # fmt: skip
    assert made.returncode == 0, made.stderr
    words = ("predict", "model.json", "log.csv", "--horizon", 30, "--from", 3, "--out")
    for name, more, told in (("a.csv", (), True), ("b.csv", ("--session-time", 3), False)):
        found = jaxident(*words, name, *more, cwd=tmp_path)
        assert found.returncode == 0, found.stderr
        assert ("--session-time 3 " in found.stderr) == told


def test_same_seed_same_log(folder):
    for name in ("a.csv", "b.csv"):
        words = ("simulate", "published", "--excitation", "prbs", "--samples", 50, "--noise", "1e-3,1e-2", "--seed", 3)
        assert jaxident(*words, "--out", folder / name).returncode == 0
    assert (folder / "a.csv").read_bytes() == (folder / "b.csv").read_bytes()


def test_wrong_use(folder):
    log = folder / "log.csv"
    refused(jaxident("idntify", log), "No such command 'idntify'")
    refused(jaxident("identify"), "LOG...")
    refused(jaxident("identify", folder / "none.csv"), "none.csv")
    refused(jaxident("identify", log, "--method", "paper", "--forgetting", 1.5), "forgetting 1.5")
    refused(jaxident("identify", log, "--d-max", 7), "d-max 7")
    refused(jaxident("identify", log, "--method", "paper", "--coupling"), "coupling")
    refused(jaxident("identify", log, "--method", "paper", "--report", "x.html"), "--report needs")
    refused(jaxident("identify", log, "--method", "paper", "--bootstrap", 50), "--bootstrap needs")
    refused(jaxident("identify", log, "--method", "instrumental-variables", "--forgetting", 0.9), "forgetting")
    refused(jaxident("simulate", "published", "--out", "x.csv", cwd=folder), "--inputs LOG or --excitation NAME")
    refused(jaxident("predict", folder / "model.json", log, "--horizon", 5000, "--burn-in", 900, "--out", "x.csv",
                     cwd=folder), "burn-in of 900 rows")  # fmt: skip
    assert not (folder / "x.csv").exists()


def test_model_at_another_period_is_refused(folder):
    log = read_log(folder / "log.csv")
    rows = zip(log.t * 2, log.u_r, log.u_l, log.x, log.y, log.theta, strict=True)
    text = "t,u_r,u_l,x,y,theta\n" + "".join(",".join(map(repr, map(float, row))) + "\n" for row in rows)
    (folder / "slow.csv").write_text(text)
    words = ("predict", folder / "model.json", folder / "slow.csv", "--horizon", 5, "--out", folder / "q.csv")
    refused(jaxident(*words), "sample_period", "0.0333333", "0.0666667")
    assert not (folder / "q.csv").exists()


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("", ["empty"]),
        ("t,u_r,u_l,x,y\n0,1,1,0,0\n", ["theta"]),
        ("t,u_r,u_l,x,y,theta\n0,1,1,0,0,0\n0.1,fast,1,0,0,0\n", ["line 3", "u_r", "fast"]),
        ("t,u_r,u_l,x,y,theta\n0,1,1,0,0,0\n0.1,1,1,nan,0,0\n", ["line 3", "nan"]),
        ("t,u_r,u_l,x,y,theta\n0,1,1,0,0,0\n0.1,1,inf,0,0,0\n", ["line 3", "inf"]),
        ("t,u_r,u_l,x,y,theta\n0,1,1,0,0,0\n0,1,1,0,0,0\n", ["line 3"]),
        ("t,u_r,u_l,x,y,theta\n1,1,1,0,0,0\n0,1,1,0,0,0\n", ["line 3"]),
        ("t,u_r,u_l,x,y,theta\n0,1,1,0,0,0\n", ["row"]),
        ("t,u_r,u_l,x,y,theta\n" + "".join(f"{k},{k % 3},1,,,\n" for k in range(40)), ["poses"]),
        ("t,u_r,u_l,x,y,theta\n" + "".join(f"{k},{k % 3},1,0,0,0\n" for k in range(40)), ["nothing moves"]),
        ("t,u_r,u_l,x,y,theta\n" + "".join(f"{k},1,1,{k},0,0\n" for k in range(40)), ["no excitation"]),
    ],
)
def test_bad_logs(tmp_path, body, words):
    (tmp_path / "bad.csv").write_text(body)
    refused(jaxident("identify", "bad.csv", "--out", "model.json", cwd=tmp_path), *words)
    assert [path.name for path in tmp_path.iterdir()] == ["bad.csv"]


def test_the_papers_method_refuses_uneven_steps(tmp_path):
    rows = (f"{k + (k == 9) / 3},{k % 3},1,{k},0,0\n" for k in range(40))
    (tmp_path / "bad.csv").write_text("t,u_r,u_l,x,y,theta\n" + "".join(rows))
    refused(jaxident("identify", "bad.csv", "--method", "paper", cwd=tmp_path), "uneven")


def test_model_with_an_unknown_key(tmp_path, folder):
    content = json.loads((folder / "model.json").read_text()) | {"colour": "red"}
    (tmp_path / "model.json").write_text(json.dumps(content))
    words = ("predict", tmp_path / "model.json", folder / "log.csv", "--horizon", 5, "--out", tmp_path / "p.csv")
    refused(jaxident(*words), "colour")


def test_convert(tmp_path):
    (tmp_path / "c.csv").write_text("t,v,w\n0,0.1,0\n0.5,0.1,0.2\n")
    (tmp_path / "p.csv").write_text("t,x,y,theta\n0.01,0,0,0\n0.49,0.05,0,0\n")
    words = ("convert", "--commands", "c.csv", "--poses", "p.csv", "--out", "log.csv")
    refused(jaxident(*words, cwd=tmp_path), "track")
    result = jaxident(*words, "--track", 0.2, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    log = read_log(tmp_path / "log.csv")
    np.testing.assert_allclose(log.t, [0, 0.01, 0.49, 0.5])
    np.testing.assert_allclose(log.u_r[-1], 0.12)


def test_effects_prints_and_writes_the_catalogue(tmp_path):
    result = jaxident("effects", "--json", tmp_path / "c.json")
    assert result.returncode == 0, result.stderr
    rows = json.loads((tmp_path / "c.json").read_text())
    assert {"name", "site", "equation", "parameters", "confused_with", "extension"} <= rows[0].keys()
    assert all(row["name"] in result.stdout for row in rows)
    assert {"name": "level", "unit": "unit", "neutral": None, "range": [0.3, 1.0]} in [
        parameter for row in rows for parameter in row["parameters"]
    ]


def test_simulate_with_effects(tmp_path):
    words = ("simulate", "published", "--excitation", "multilevel", "--samples", 60)
    effects = ("--effect", "transport_delay:delay=0.05", "--effect", "coulomb_friction:right=0.05,left=0.04")
    for name, more in (("plain.csv", ()), ("with.csv", effects)):
        result = jaxident(*words, *more, "--out", tmp_path / name)
        assert result.returncode == 0, result.stderr
    plain, other = (read_log(tmp_path / name) for name in ("plain.csv", "with.csv"))
    assert np.abs(plain.theta - other.theta).max() > 0.1
    for effect, said in (
        ("gearbox:x=1", "unknown effect 'gearbox'"),
        ("transport_delay:lag=1", "it has delay [s]"),
        ("transport_delay:delay=60", "longer than the log"),
        ("input_saturation:level=0", "above 0 unit"),
        ("transport_delay:delay=long", "key=value"),
        ("transport_delay", "no parameter"),
    ):
        refused(jaxident(*words, "--effect", effect, "--out", tmp_path / "bad.csv"), said)
    assert not (tmp_path / "bad.csv").exists()


def test_a_reader_who_leaves_early_costs_no_file(tmp_path):
    """The pipe is closed before the first word; the file is written after the last."""
    read, write = os.pipe()
    os.close(read)
    ended = subprocess.run(
        [sys.executable, "-m", "jaxident", "effects", "--json", str(tmp_path / "effects.json")],
        stdout=write, stderr=subprocess.PIPE, text=True, check=False, timeout=300,
    )  # fmt: skip
    os.close(write)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert len(json.loads((tmp_path / "effects.json").read_text())) > 20


def test_example_keeps_its_effect_in_the_answer(tmp_path):
    result = jaxident("example", "--effect", "motor_lag", "--out", tmp_path / "a")
    assert result.returncode == 0, result.stderr
    (effect,) = load_model(tmp_path / "a" / ".answer.json").effects
    assert effect.name == "motor_lag"
    assert 0.02 < effect.parameters["time_constant"] < 0.1
    assert len(list((tmp_path / "a").glob("real_*.csv"))) == 6
    refused(jaxident("example", "--effect", "gearbox", "--out", tmp_path / "b"), "unknown effect 'gearbox'")
    assert not (tmp_path / "b").exists()


def test_a_library_s_word_to_its_developers_is_no_warning(capsys):
    _show_warning(DeprecationWarning("use another function"), DeprecationWarning, "zarr.py", 1)
    assert capsys.readouterr().err == ""
    _show_warning(UserWarning("half of\nthe rows"), UserWarning, "log.py", 1)
    assert capsys.readouterr().err == "warning: half of the rows\n"

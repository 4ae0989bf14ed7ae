"""`jaxident sweep` as a user runs it; what takes long (kills, clusters, the example) is slow."""

import csv
import json
import os
import random
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import xarray
from support.program import jaxident
from support.studies import SMALL, SMALL_TOML

from jaxident.files.logs import read_log
from jaxident.files.study_example import EXAMPLE
from jaxident.study.dataset import study_arrays

WORDS = [sys.executable, "-m", "jaxident", "sweep"]


def run(*words, cwd, code=0):
    result = jaxident("sweep", *words, cwd=cwd)
    assert result.returncode == code, result
    return result


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    folder = tmp_path_factory.mktemp("swept")
    (folder / "study.toml").write_text(SMALL_TOML)
    assert "12 trials" in run("study.toml", "--out", "out", cwd=folder).stdout
    return folder


def test_writes_what_it_says(swept):
    with xarray.open_zarr(swept / "out" / "trials.zarr") as found:
        np.testing.assert_array_equal(found["estimate"], study_arrays(SMALL)["estimate"])
    with open(swept / "out" / "summary.csv") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 2 * 12
    assert {row["parameter"] for row in rows} >= {"alpha_1", "dead_zone_l"}
    assert all(float(row["rmse"]) >= abs(float(row["bias"])) for row in rows)
    assert all(float(row["rmse_over_bound"]) > 0.1 for row in rows)
    page = (swept / "out" / "index.html").read_text()
    assert "Error against noise" in page
    assert page.count("<img") >= 9


def test_one_trial_alone(swept):
    result = run("study.toml", "--out", "out", "--trial", 7, cwd=swept)
    assert "alpha_1" in result.stdout
    assert (swept / "out" / "trial_7.png").stat().st_size > 10_000
    assert len(read_log(swept / "out" / "trial_7.csv").t) == 60
    assert "0 to 11" in run("study.toml", "--out", "out", "--trial", 12, cwd=swept, code=2).stderr


@pytest.mark.slow
def test_an_axis_of_effects(tmp_path):
    text = SMALL_TOML.replace("hold = 3", "hold = 3\neffects = ['none', { transport_delay = { delay = 0.05 } }]")
    (tmp_path / "study.toml").write_text(text)
    assert "24 trials" in run("study.toml", "--out", "out", cwd=tmp_path).stdout
    with open(tmp_path / "out" / "summary.csv") as stream:
        rows = list(csv.DictReader(stream))
    assert list(rows[0])[2:4] == ["robot", "effect"]
    late = [row for row in rows if row["effect"] == "transport_delay delay=0.05"]
    assert len(late) == len(rows) // 2
    assert not any(row["rmse_over_bound"] for row in late)
    page = (tmp_path / "out" / "index.html").read_text()
    assert "2 sets of effects" in page
    assert "error [%] by effect" in page
    run("study.toml", "--out", "out", "--trial", 12, cwd=tmp_path)
    with xarray.open_zarr(tmp_path / "out" / "trials.zarr") as found:
        assert found["estimate"].sel(effect="none").size == len(rows) // 2 * 6


def test_the_summary_tells_its_study(swept):
    told = json.loads((swept / "out" / "summary.csv.provenance.json").read_text())["provenance"]
    assert told["command"] == ["sweep", "study.toml"]
    assert [one["name"] for one in told["inputs"]] == ["study.toml"]
    with xarray.open_zarr(swept / "out" / "trials.zarr") as found:
        assert json.loads(found.attrs["versions"]).items() >= told["versions"].items()


def test_wrong_use(swept):
    for words, said in (
        (("study.toml",), "--out DIR"),
        (("nothing.toml", "--out", "x"), "nothing.toml"),
        (("study.toml", "--out", "out", "--seed", 5), "study.seed"),
        (("study.toml", "--out", "study.toml"), "study.toml"),
        (("study.toml", "--out", "y", "--scheduler", "local:many"), "local:N"),
    ):
        result = run(*words, cwd=swept, code=2)
        assert said in result.stderr
        assert len(result.stderr.splitlines()) == 1
    assert not (swept / "x").exists()


def test_the_example_is_printed(tmp_path):
    assert run("--example", cwd=tmp_path).stdout == EXAMPLE


def files(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.mark.slow
def test_killed_at_any_moment_it_goes_on(tmp_path):
    """Five kills from before the first chunk to the last one; the store is the uninterrupted one."""
    text = SMALL_TOML.replace("seeds = 6", "seeds = 400")
    (tmp_path / "study.toml").write_text(text)
    run("study.toml", "--out", "whole", cwd=tmp_path)
    moments = random.Random(0)
    for share in (0.0, 0.2, 0.4, 0.6, 0.8):
        process = subprocess.Popen([*WORDS, "study.toml", "--out", "killed"], cwd=tmp_path)
        while process.poll() is None and len(list((tmp_path / "killed" / ".chunks").glob("*.json"))) < 200 * share:
            time.sleep(0.01)
        time.sleep(moments.uniform(0.0, 0.3))
        os.kill(process.pid, signal.SIGKILL)
        assert process.wait() == -signal.SIGKILL
    run("study.toml", "--out", "killed", cwd=tmp_path)
    assert files(tmp_path / "killed" / "trials.zarr") == files(tmp_path / "whole" / "trials.zarr")


@pytest.mark.slow
def test_local_processes_give_the_same_store(swept):
    pytest.importorskip("distributed")
    run("study.toml", "--out", "spread", "--scheduler", "local:2", cwd=swept)
    assert files(swept / "spread" / "trials.zarr") == files(swept / "out" / "trials.zarr")

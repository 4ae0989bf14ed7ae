"""`jaxident plan`, as a user runs it."""

import json
from functools import partial

import numpy as np
from click.testing import CliRunner
from support.program import jaxident, refused

from jaxident.cli.plan import command
from jaxident.diagnosis.planning import next_run
from jaxident.files.logs import read_log


def test_plan_writes_a_log_of_commands_alone(tmp_path, monkeypatch):
    monkeypatch.setattr(next_run, "plan", partial(next_run.plan, batches=1))
    monkeypatch.setattr("jaxident.cli.plan.start_jax", lambda: None)  # the tests' own start has no cache
    words = ["published", "--between", "lateral_slip,marker_offset", "--samples", "300", "--limit", "0.5"]
    runs = [CliRunner().invoke(command, [*words, "--out", str(tmp_path / f"{name}.csv"), "--json",
                                         str(tmp_path / "plan.json")]) for name in "ab"]  # fmt: skip
    assert [run.exit_code for run in runs] == [0, 0], runs
    for word in ("before: median of 8", "after: this plan", "assumed", "wrote"):
        assert word in runs[0].output
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    log, result = read_log(tmp_path / "a.csv"), json.loads((tmp_path / "plan.json").read_text())
    assert len(log.t) == 300
    assert np.abs(np.stack(log.command)).max() <= 0.5
    assert np.isnan(log.x).all()
    assert result["between"] == ["lateral_slip", "marker_offset"]
    assert result["after"] >= result["before"] > 0.0


def test_plan_refuses_in_one_line(tmp_path):
    words = ["plan", "published", "--between", "motor_lag,elves", "--out", str(tmp_path / "next.csv")]
    refused(jaxident(*words), "elves")
    assert not list(tmp_path.iterdir())

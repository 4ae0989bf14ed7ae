"""Diagnoses put together, and the worker that makes them, on folders made up."""

import json
import pathlib
import subprocess
import sys

from support.diagnoses import made_up

from experiments.withheld.protocol.collect import collect
from jaxident.files.diagnosis import diagnosis_to_dict

ROOT = pathlib.Path(__file__).resolve().parents[2]


def test_every_case_has_a_file_and_a_row(tmp_path):
    for name, verdict in (("case_01", "effects"), ("case_02", "no_gap")):
        (tmp_path / "found" / name).mkdir(parents=True)
        text = json.dumps(diagnosis_to_dict(made_up(verdict)))
        (tmp_path / "found" / name / "diagnosis.json").write_text(text)
    (tmp_path / "found" / "case_03").mkdir()
    collect(tmp_path / "found", tmp_path / "out")
    assert sorted(path.name for path in tmp_path.glob("out/*.json")) == ["case_01.json", "case_02.json"]
    table = (tmp_path / "out" / "table.md").read_text().splitlines()
    assert len({line.count("|") for line in table}) == 1
    assert "transport_delay (0.99), quadratic_drag (0.90) | motor_lag |" in table[2]
    assert table[4].startswith("| case_03 | failed |")


def test_the_worker_records_what_fails_and_goes_on(tmp_path):
    for name in ("case_1", "case_2"):
        (tmp_path / name).mkdir()
    words = [sys.executable, "-m", "experiments.withheld.worker", "found", "case_1", "case_2"]
    subprocess.run(words, cwd=tmp_path, env={"PYTHONPATH": str(ROOT), "PATH": ""}, check=True, capture_output=True)
    records = [json.loads((tmp_path / "found" / name / "process.json").read_text()) for name in ("case_1", "case_2")]
    assert [record["exit_code"] for record in records] == [2, 2]
    assert all(len(record["stderr"]) == 1 for record in records)

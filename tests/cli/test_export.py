"""`jaxident export`, as a user runs it."""

import dataclasses
import json

import pytest
from click.testing import CliRunner
from support.program import jaxident

import jaxident as ji
from jaxident.cli.export import TARGETS, UNITS, command
from jaxident.export import ask, export
from jaxident.robot.difference import to_difference


@pytest.fixture
def invoke(monkeypatch):
    monkeypatch.setattr("jaxident.cli.export.start_jax", lambda: None)  # the tests' own start has no cache
    return lambda *words: CliRunner().invoke(command, [str(word) for word in words])


def run(*words):
    return jaxident("export", *words)


def test_choices_are_those_of_the_export():
    assert set(TARGETS) == set(export.TARGETS)
    assert UNITS == ask.UNITS


@pytest.mark.parametrize("target", TARGETS)
def test_export_writes_what_it_says(target, tmp_path, invoke):
    out = tmp_path / "robot.out"
    result = invoke("published", "--to", target, "--out", out, "--json", tmp_path / "told.json")
    assert result.exit_code == 0, result.output
    told = json.loads((tmp_path / "told.json").read_text())
    assert sorted(told["files"]) == sorted(str(file) for file in tmp_path.iterdir() if file.name != "told.json")
    assert all(f"wrote {file}" in result.output for file in told["files"])
    assert {part["how"] for part in told["parts"]} <= {"field", "wrapper", "not carried"}
    for part in told["parts"]:
        assert part["name"] in result.output
    assert ("wheel radius 11.21 mm is assumed" in result.output) == (
        target in ("mjcf", "isaac", "gazebo", "ros2_control")
    )
    again = tmp_path / "again.out"
    assert invoke("published", "--to", target, "--out", again).exit_code == 0
    assert again.read_bytes() == out.read_bytes()


def test_what_is_not_carried_is_told_in_millimetres(tmp_path, invoke):
    model = dataclasses.replace(ji.load_model("published"), effects=(ji.Effect("turn_loss", {"loss": 1.0}),))
    ji.save_model(model, tmp_path / "corrected_model.json")
    result = invoke(tmp_path / "corrected_model.json", "--to", "mjcf", "--out", tmp_path / "robot.xml")
    line = next(line for line in result.output.splitlines() if line.startswith("turn_loss"))
    assert "not carried" in line
    assert "mm of the gap stay, computed on a default input" in line


def test_a_folder_as_output_and_free_numerators_are_refused_in_one_line(tmp_path):
    published = ji.load_model("published")
    free = dataclasses.replace(published, dynamics=to_difference(published.physical, published.sample_period))
    ji.save_model(free, tmp_path / "free.json")
    (tmp_path / "out").mkdir()
    cases = [
        (("published", "--to", "mjcf", "--out", tmp_path / "out"), "is a folder"),
        ((tmp_path / "free.json", "--to", "gazebo", "--out", tmp_path / "robot.sdf"), "free numerators"),
        (("published", "--to", "webots", "--out", tmp_path / "robot.xml"), "mjcf"),
        ((tmp_path / "none.json", "--to", "table", "--out", tmp_path / "table.md"), "no such file"),
    ]
    before = sorted(tmp_path.iterdir())
    for words, reason in cases:
        result = run(*words)
        assert result.returncode == 2, result
        assert result.stdout == ""
        assert len(result.stderr.splitlines()) == 1
        assert reason in result.stderr
    assert sorted(tmp_path.iterdir()) == before


def test_no_export_stands_without_its_wrapper(tmp_path, invoke):
    """The wrapper's name is taken by a folder: nothing is written."""
    (tmp_path / "robot_commands.py").mkdir()
    with pytest.raises(ji.InputError):
        ji.export("published", "mjcf", tmp_path / "robot.xml")
    assert not (tmp_path / "robot.xml").exists()

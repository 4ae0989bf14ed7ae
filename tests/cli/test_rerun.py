"""Results tell what they were made from, and are made again from that: the same to the bit, or told how they differ."""

import hashlib
import importlib
import json
import shutil

import click
import numpy as np
import pytest
from support.program import jaxident

from jaxident.cli.main import COMMANDS
from jaxident.cli.record import READ, WRITTEN
from jaxident.cli.rerun import REPEATABLE
from jaxident.files.logs import write_log
from jaxident.files.models import load_model
from jaxident.log import make_log

ROWS = 200
WORDS = ("convert", "--commands", "data/c.csv", "--poses", "data/p.csv", "--track", "0.3", "--out", "log.csv")
FREE_WORDS = {"between", "child_frame", "command_topic", "effect", "pose_topic", "wheels_topic", "scheduler"}
"""Parameters of any text that name no file."""


def write_data(folder):
    """Two streams, in a folder of their own."""
    folder.mkdir(parents=True)
    t = 0.05 * np.arange(ROWS)
    v, w = 0.2 + 0.1 * np.sin(t), 0.5 * np.cos(2.0 * t)
    for name, head, columns in (("c.csv", "t,v,w", (t, v, w)), ("p.csv", "t,x,y,theta", (t, v, t, w))):
        rows = "\n".join(",".join(map(repr, row)) for row in zip(*map(np.ndarray.tolist, columns), strict=True))
        (folder / name).write_text(f"{head}\n{rows}\n")


def noisy_log():
    """A log of a robot whose speeds follow its commands late, with a little noise."""
    draw = np.random.default_rng(4)
    u = np.repeat(draw.uniform(-1.0, 1.0, (ROWS // 5, 2)), 5, axis=0)
    speed = np.zeros((ROWS, 2))
    for k in range(1, ROWS):
        speed[k] = 0.7 * speed[k - 1] + 0.3 * u[k - 1]
    theta = np.cumsum(0.05 * (speed[:, 0] - speed[:, 1]))
    x, y = (np.cumsum(0.01 * speed.sum(axis=1) * side(theta)) for side in (np.cos, np.sin))
    pose = np.stack([x, y, theta]) + 1e-6 * draw.normal(size=(3, ROWS))
    return make_log(0.05 * np.arange(ROWS), *u.T, *pose)


@pytest.fixture
def made(tmp_path):
    """A folder with streams in `data`, and a log made of them."""
    write_data(tmp_path / "data")
    assert jaxident(*WORDS, cwd=tmp_path).returncode == 0
    return tmp_path


def edit(path, change):
    """Change the provenance in a file."""
    content = json.loads(path.read_text())
    change(content["provenance"])
    path.write_text(json.dumps(content))


def rerun(folder, *words):
    ended = jaxident("rerun", "log.csv", *words, cwd=folder)
    errors = [line for line in ended.stderr.splitlines() if not line.startswith("warning: ")]
    assert len(errors) == (ended.returncode != 0), ended
    return ended


def test_a_log_tells_what_it_was_made_from(made):
    told = json.loads((made / "log.csv.provenance.json").read_text())
    assert told["file"] == {"name": "log.csv", "sha256": hashlib.sha256((made / "log.csv").read_bytes()).hexdigest()}
    assert told["provenance"]["command"] == ["convert", "--commands=c.csv", "--poses=p.csv", "--track=0.3"]
    for one, name in zip(told["provenance"]["inputs"], ("c.csv", "p.csv"), strict=True):
        assert (one["name"], one["sha256"]) == (name, hashlib.sha256((made / "data" / name).read_bytes()).hexdigest())
    assert {"jaxident", "jax", "jaxlib", "numpy", "python"} <= told["provenance"]["versions"].keys()


def test_a_provenance_says_neither_when_nor_where(made):
    """The same inputs elsewhere, options in another order, defaults written out: the same bytes."""
    other = made / "somewhere" / "else"
    write_data(other)
    words = ("convert", "--out", str(other / "log.csv"), "--track", "0.3", "--pose-offset", "0.0",
             "--poses", str(other / "p.csv"), "--commands", str(other / "c.csv"))  # fmt: skip
    assert jaxident(*words, cwd=made.parent).returncode == 0
    for name in ("log.csv", "log.csv.provenance.json"):
        assert (other / name).read_bytes() == (made / name).read_bytes()


def test_it_is_made_again_to_the_bit_and_nothing_is_left(made):
    before = sorted(made.rglob("*"))
    ended = rerun(made, "--json", "told.json")
    assert ended.returncode == 0
    assert "the same to the bit: 1200 values" in ended.stdout
    told = json.loads((made / "told.json").read_text())
    assert (told["same"], told["differences"], told["values"]) == (True, [], 6 * ROWS)
    assert sorted(made.rglob("*")) == sorted([*before, made / "told.json"])
    assert rerun(made, "--out", "again").returncode == 0
    assert (made / "again" / "log.csv").read_bytes() == (made / "log.csv").read_bytes()


def test_inputs_that_moved_or_changed_are_told(made):
    (made / "data").rename(made / "moved")
    assert rerun(made).returncode == 0, "found in the folders here"
    (made / "far" / "away").mkdir(parents=True)
    shutil.move(made / "moved", made / "far" / "away" / "data")
    ended = rerun(made)
    assert ended.returncode == 2
    assert "c.csv (--commands): no such file in" in ended.stderr
    assert "--data FOLDER" in ended.stderr
    assert rerun(made, "--data", "far/away/data").returncode == 0
    shutil.move(made / "far" / "away" / "data" / "c.csv", made)
    assert rerun(made, "--data", "far/away/data").returncode == 0, "one moved, the other is here"
    with open(made / "far" / "away" / "data" / "p.csv", "a") as stream:
        stream.write("99,0,0,0\n")
    ended = rerun(made, "--data", "far/away/data")
    assert ended.returncode == 2
    assert "p.csv (--poses): has changed" in ended.stderr
    assert "--data FOLDER" in ended.stderr
    assert rerun(made, "--data", "nowhere").returncode == 2


def test_values_that_differ_are_told_by_how_much(made):
    lines = (made / "log.csv").read_text().splitlines()
    lines[3] = lines[3].replace(lines[3].split(",")[3], repr(float(lines[3].split(",")[3]) + 1e-6))
    (made / "log.csv").write_text("\n".join(lines) + "\n")
    ended = rerun(made)
    assert (ended.returncode, "has changed since" in ended.stderr) == (2, True)
    record = made / "log.csv.provenance.json"
    content = json.loads(record.read_text())
    content["file"]["sha256"] = hashlib.sha256((made / "log.csv").read_bytes()).hexdigest()
    content["provenance"]["versions"]["numpy"] = "1.0"
    record.write_text(json.dumps(content))
    ended = rerun(made)
    assert ended.returncode == 1
    assert "1 of 1200 values" in ended.stderr
    assert "x, line 4: " in ended.stdout
    assert "numpy 1.0 then" in ended.stdout


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda told: told["command"].append("--out=evil.csv"), "--out of this command says where outputs go"),
        (lambda told: told.update(command=["convert", "--commands=/etc/passwd", "--poses=p.csv"]), "not the next"),
        (lambda told: told["inputs"][0].update(name="../data/c.csv"), "without its folder"),
        (lambda told: told["inputs"][0].update(sha256="0"), "64 hexadecimal digits"),
        (lambda told: told["inputs"][0].update(sha256=None), "a pipe"),
        (lambda told: told["inputs"].append(told["inputs"][0]), "does not name its input 'c.csv'"),
        (lambda told: told["command"].append("--exec=rm"), "No such option"),
        (lambda told: told["command"].append("--period=fast"), "--period"),
        (lambda told: told["command"].append("--help"), "convert has no option"),
        (lambda told: told["command"].append("; rm -rf ."), "unexpected extra argument (; rm"),
        (lambda told: told.update(command=["rm", "-rf", "."]), "is not made again"),
        (lambda told: told.update(command=["sweep", "c.csv"]), "is not made again"),
        (lambda told: told.update(command=[]), "is not made again"),
        (lambda told: told.update(command="convert"), "should be a list"),
        (lambda told: told.update(output="../../evil"), "is not made again"),
        (lambda told: told.pop("inputs"), "no key 'inputs'"),
    ],
)
def test_what_a_stranger_wrote_is_data(made, change, told):
    """Neither a shell nor a file outside the inputs is reached, and nothing is written."""
    edit(made / "log.csv.provenance.json", change)
    before = sorted(made.rglob("*"))
    ended = rerun(made)
    assert ended.returncode == 2
    assert told in ended.stderr
    assert sorted(made.rglob("*")) == before


def test_files_without_provenance_and_bad_folders_are_refused(made):
    (made / "old.json").write_text('{"schema": "jaxident.diagnosis/2"}')
    for words, told in (
        (("old.json",), "has no key 'provenance'"),
        (("data/c.csv",), "no file c.csv.provenance.json beside it"),
        (("none.json",), "none.json: no such file"),
        (("log.csv", "--out", "."), "is the folder of log.csv"),
    ):
        ended = jaxident("rerun", *words, cwd=made)
        assert ended.returncode == 2
        assert told in ended.stderr


def test_every_parameter_that_names_a_file_is_known():
    """What is no input and no output must be a number, a choice or a word that names no file."""
    for name in COMMANDS:
        for parameter in importlib.import_module(f"jaxident.cli.{name}").command.params:
            if parameter.name not in (*READ, *WRITTEN, *FREE_WORDS) and name != "rerun":
                assert parameter.type is not click.STRING, (name, parameter.name)
    assert REPEATABLE.keys() < COMMANDS.keys()


@pytest.mark.slow
def test_a_model_and_its_json(tmp_path, monkeypatch):
    monkeypatch.setattr("jaxident.cli.identify.start_jax", lambda: None)  # the tests' own start has no cache
    write_log(noisy_log(), tmp_path / "log.csv")
    words = ("identify", "log.csv", "--method", "key-term-least-squares", "--out", "model.json", "--json", "r.json")
    found = jaxident(*words, cwd=tmp_path)
    assert found.returncode == 0, found
    result = json.loads((tmp_path / "r.json").read_text())
    assert result["provenance"]["command"] == ["identify", "log.csv", "--method=key-term-least-squares"]
    assert result["model"]["provenance"]["inputs"] == result["provenance"]["inputs"]
    assert load_model(tmp_path / "model.json").provenance.origin.inputs[0].name == "log.csv"
    for name in ("model.json", "r.json"):
        again = jaxident("rerun", name, cwd=tmp_path)
        assert again.returncode == 0, again
        assert "the same to the bit" in again.stdout

"""What a stranger, a slip of the finger or a broken disk gives the program: one line, the right exit code, no file."""

import contextlib
import dataclasses
import gzip
import json
import os
import subprocess
import sys
import time

import jax
import numpy as np
import pytest
from support.program import Ended, jaxident

from jaxident.errors import InputError
from jaxident.files import atomic, table
from jaxident.files.logs import read_log, write_log
from jaxident.files.models import load_model, model_from_dict, model_to_dict, save_model
from jaxident.files.studies import parse_study, read_study
from jaxident.files.study_example import EXAMPLE
from jaxident.log import make_log
from jaxident.robot.model import Provenance
from jaxident.study.synthetic import excite, simulate_runs

HEADER = "t,u_r,u_l,x,y,theta\n"
DEVICE = "/dev/zero"


def refused(ended: Ended, *words: str) -> None:
    """Exit code 2, and one line of bearable length that holds the words."""
    assert ended.returncode == 2, ended
    assert ended.stdout == ""
    assert ended.stderr.count("\n") == 1
    assert len(ended.stderr) < 1500
    for word in words:
        assert word in ended.stderr


@pytest.fixture
def log(tmp_path):
    """A short log of the published robot."""
    path = tmp_path / "log.csv"
    plain = excite(jax.random.key(0), "multilevel", 120, 1.0 / 30.0, hold=3)
    robot = load_model("published")
    write_log(simulate_runs(robot, plain, noise=(1e-5, 1e-4), key=jax.random.key(1)), path)
    return path


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a = " + "[" * 2000 + "]" * 2000, "nested too deeply"),
        ("seeds = " + "9" * 5000, "number cannot be read"),
        ("a" + ".a" * 20_000 + " = 1", "line 1: a key of more than 8 dots"),
        ("x = 1\n[" + '"a".' * 20_000 + "a]", "line 2: a key of more than 8 dots"),
    ],
)
def test_a_study_file_that_would_never_be_read_is_refused_at_once(text, words):
    begin = time.perf_counter()
    with pytest.raises(InputError, match=words):
        parse_study(text, "study.toml")
    assert time.perf_counter() - begin < 2.0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("seeds = 50 ", "seeds = 1e18 ", "seeds: "),
        ("seeds = 50 ", "seeds = 100_000_000 ", "seeds: with 100000000 the axes make 800000000 trials"),
        ("samples = [200]", "samples = [1e15]", "samples: "),
        ("hold = 5 ", "hold = 1e15 ", "hold: "),
        ('model = "published"', 'model = "/dev/zero"', "model: /dev/zero: has more than"),
        (
            'model = "published"',
            f'model = "published"\nscale = {{ rate = {list(range(1, 300))}, gain = {list(range(1, 300))} }}',
            "scale: makes more than 10000 robots",
        ),
    ],
)
def test_a_study_beyond_all_bounds_names_the_key(old, new, words):
    with pytest.raises(InputError, match=r"study\.toml: ") as caught:
        parse_study(EXAMPLE.replace(old, new), "study.toml")
    assert words in str(caught.value)


@pytest.mark.skipif(not os.path.exists(DEVICE), reason="the system has no /dev/zero")
@pytest.mark.parametrize("read", [load_model, read_study, read_log])
def test_a_file_without_an_end_is_refused(read):
    with pytest.raises(InputError, match=DEVICE):
        read(DEVICE)


def packed(path, *parts: tuple[str, int]):
    """A gzipped file of texts, each repeated so many times."""
    with gzip.open(path, "wt", encoding="utf-8") as stream:
        for text, times in parts:
            stream.write(text * times)
    return path


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ([("\0" * 1_000_000, 10)], "is not a text file"),
        ([(HEADER, 1), ("0" * 1_000_000, 20)], "a line of more than"),
        ([(HEADER, 1), ("0,0,0,0,0,0" + " " * 1000 + "\n", 100_000)], "unpacks to more than 100 times"),
        ([(HEADER, 1), ("\n" * 1_000_000, 25)], "more than 20000000 lines"),
    ],
)
def test_a_packed_bomb_is_refused_before_it_fills_the_memory(tmp_path, parts, words):
    with pytest.raises(InputError, match=words):
        read_log(packed(tmp_path / "bomb.csv.gz", *parts))


def test_an_honest_packed_log_is_read_however_small_it_is(tmp_path):
    rows = "".join(f"{k},1,1,0,0,0\n" for k in range(20_000))
    assert len(read_log(packed(tmp_path / "log.csv.gz", (HEADER, 1), (rows, 1))).t) == 20_000


def test_blocks_of_lines_are_the_lines(tmp_path, monkeypatch):
    """Cut anywhere, with and without a last line feed."""
    rows = [f"{k},{k % 3},1,0,{k},0" for k in range(50)]
    for text in ("\n".join(rows), "\r\n".join(rows) + "\n\n"):
        (tmp_path / "log.csv").write_text(HEADER + text, newline="")
        for size in (1, 7, 64):
            monkeypatch.setattr(table, "BLOCK_BYTES", size)
            np.testing.assert_array_equal(read_log(tmp_path / "log.csv").y, np.arange(50.0))


def test_a_long_header_is_not_repeated(tmp_path):
    names = ",".join(f"column_{k}" for k in range(150))
    (tmp_path / "log.csv").write_text(f"t,u_r,u_l,x,y,theta,{names}\n0,1,1,0,0,0\n")
    with (
        pytest.warns(UserWarning, match="columns ignored"),
        pytest.raises(InputError, match="line 2: 6 cells") as caught,
    ):
        read_log(tmp_path / "log.csv")
    assert len(str(caught.value)) < 250


def test_a_key_given_twice_among_many_is_found_at_once(tmp_path):
    keys = ",".join(f'"k{k}":0' for k in range(200_000))
    (tmp_path / "model.json").write_text(f'{{{keys},"k199999":0}}')
    begin = time.perf_counter()
    with pytest.raises(InputError, match="'k199999' is given twice"):
        load_model(tmp_path / "model.json")
    assert time.perf_counter() - begin < 3.0


@pytest.mark.parametrize(
    "words",
    [
        ("predict", "published", "log.csv", "--horizon", "5", "--session-time", "nan", "--out", "out"),
        ("predict", "published", "log.csv", "--horizon", "9" * 20, "--out", "out"),
        ("predict", "published", "log.csv", "--horizon", "5", "--from", "inf", "--out", "out"),
        ("diagnose", "log.csv", "--horizon", "nan", "--out", "out"),
        ("diagnose", "log.csv", "--horizon", "inf", "--out", "out"),
        ("diagnose", "log.csv", "--sim", "--out", "out"),
        ("diagnose", "log.csv", "--out", "out", "--sim"),
        ("simulate", "published", "--excitation", "prbs", "--samples", "9" * 20, "--out", "out"),
        ("simulate", "published", "--excitation", "prbs", "--samples", "50", "--hold", "9" * 20, "--out", "out"),
        ("simulate", "published", "--excitation", "prbs", "--samples", "50", "--seed", str(2**64), "--out", "out"),
        ("simulate", "published", "--excitation", "prbs", "--samples", "50", "--amplitude", "nan", "--out", "out"),
        (
            "simulate",
            "published",
            "--excitation",
            "prbs",
            "--samples",
            "50",
            "--effect",
            "motor_lag:x=nan",
            "--out",
            "o",
        ),
        ("plan", "published", "--between", "motor_lag,play", "--limit", "inf", "--out", "out"),
        ("identify", "log.csv", "--d-max", "nan", "--out", "out"),
        ("identify", "log.csv", "--bootstrap", "9" * 20, "--out", "out"),
        ("convert", "--commands", "log.csv", "--poses", "log.csv", "--period", "inf", "--out", "out"),
        ("convert", "--commands", "log.csv", "--poses", "log.csv", "--pose-offset", "nan", "--out", "out"),
    ],
)
def test_an_option_beyond_all_bounds_is_named(log, words):
    before = sorted(os.listdir(log.parent))
    named = [word for word in words if word.startswith("--") and word != "--out"]
    ended = jaxident(*words, cwd=log.parent)
    refused(ended)
    assert any(word in ended.stderr for word in named)
    assert "out.csv" not in ended.stderr
    assert sorted(os.listdir(log.parent)) == before


@pytest.mark.parametrize(
    "words",
    [
        ("identify", "log.csv", "--out"),
        ("identify", "log.csv", "--json"),
        ("identify", "log.csv", "--report"),
        ("predict", "published", "log.csv", "--horizon", "5", "--out", "p.csv", "--json"),
        ("predict", "published", "log.csv", "--horizon", "5", "--out"),
        ("simulate", "published", "--excitation", "prbs", "--samples", "50", "--out"),
        ("plan", "published", "--between", "motor_lag,play", "--out"),
        ("convert", "--commands", "log.csv", "--poses", "log.csv", "--out"),
        ("export", "published", "--to", "table", "--out"),
        ("export", "published", "--to", "table", "--out", "out.txt", "--json"),
        ("bench", "--json"),
        ("reproduce", "--json"),
    ],
)
def test_an_output_that_cannot_be_written_is_told_before_the_work(log, words, monkeypatch):
    """The logs are not even read: that they are missing would be the other line."""
    log.unlink()
    monkeypatch.setattr("jaxident.files.models.load_model", lambda path: pytest.fail("the work began"))
    refused(jaxident(*words, "none/file", cwd=log.parent), "none/file: the folder none does not exist")


def test_example_looks_at_its_folder_before_it_writes(log):
    (log.parent / "out" / ".answer.json").mkdir(parents=True)
    refused(jaxident("example", "--effect", "none", "--out", "out", cwd=log.parent), ".answer.json: is a folder")
    assert os.listdir(log.parent / "out") == [".answer.json"]


def test_diagnose_looks_at_its_folder_before_the_work(log):
    folder = log.parent / "out"
    (folder / "report.html").mkdir(parents=True)
    refused(jaxident("diagnose", "log.csv", "--out", "out", cwd=log.parent), "report.html: is a folder")


def test_a_log_whose_name_is_no_text(log):
    """It is read, its name is printed, and a model keeps the name."""
    name = b"l\xffg.csv"
    os.rename(log, os.path.join(os.fsencode(log.parent), name))
    ended = jaxident("simulate", "published", "--inputs", name, "--out", b"\xfe.csv", cwd=log.parent)
    assert (ended.returncode, ended.stdout) == (0, "wrote \\udcfe.csv\nwrote \\udcfe.csv.provenance.json\n")
    origin = Provenance(logs=(os.fsdecode(name),))
    save_model(dataclasses.replace(load_model("published"), provenance=origin), log.parent / "m.json")
    assert os.fsencode(*load_model(log.parent / "m.json").provenance.logs) == name
    refused(jaxident("identify", b"n\xffne.csv", cwd=log.parent), "ne.csv: no such file")


SLOW_WRITER = """
import sys, time
from jaxident.files.atomic import writing_text
with writing_text(sys.argv[1]) as stream:
    stream.write("part")
    stream.flush()
    print("begun", flush=True)
    time.sleep(60)
"""


@contextlib.contextmanager
def writer(path):
    """A process that has begun to write a file and does not come to an end."""
    words = [sys.executable, "-c", SLOW_WRITER, str(path)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "begun\n"
        yield process


def test_the_next_call_removes_what_a_killed_one_left(tmp_path, monkeypatch):
    """And not what another process is writing."""
    monkeypatch.setattr(atomic, "FRESH", 0.0)
    with writer(tmp_path / "a") as killed, writer(tmp_path / "b") as living:
        killed.terminate()
        killed.wait()
        assert len(list(tmp_path.glob(".*.part"))) == 2
        atomic.write_text(tmp_path / "c", "whole")
        assert len(list(tmp_path.glob(".*.part"))) == 1
        living.terminate()
    atomic.write_text(tmp_path / "c", "whole")
    assert os.listdir(tmp_path) == ["c"]


def test_a_left_over_is_removed_although_the_clock_was_set_back(tmp_path):
    left = tmp_path / ".0123456789abcdef.part"
    left.write_text("half")
    os.utime(left, (time.time() + 86400.0,) * 2)
    atomic.write_text(tmp_path / "c", "whole")
    assert os.listdir(tmp_path) == ["c"]


def test_an_error_line_cannot_command_the_terminal(tmp_path):
    (tmp_path / "model.json").write_text('{"\\u001b[2J\\u202e": 1}')
    refused(jaxident("predict", "model.json", "x.csv", "--horizon", "5", "--out", "p.csv", cwd=tmp_path), "unknown key")
    content = model_to_dict(load_model("published"))
    content["effects"] = [{"name": "motor_lag", "parameters": {"\x1b[2J": "no"}}]
    (tmp_path / "model.json").write_text(json.dumps(content))
    ended = jaxident("predict", "model.json", "x.csv", "--horizon", "5", "--out", "p.csv", cwd=tmp_path)
    refused(ended, "\\x1b[2J")
    assert "\x1b" not in ended.stderr


def test_a_model_says_what_stands_at_a_bound():
    content = model_to_dict(load_model("published"))
    content["provenance"] = {"at_bound": ["rate_1"]}
    model = model_from_dict(content)
    assert model.provenance.at_bound == ("rate_1",)
    assert model_to_dict(model)["provenance"]["at_bound"] == ["rate_1"]
    content["provenance"] = {"at_bound": [1]}
    with pytest.raises(InputError, match=r"provenance.at_bound\[0\]: should be a text"):
        model_from_dict(content)


def test_time_stamps_alone_are_a_log(tmp_path):
    """The smallest log that is one, whatever stands around it."""
    write_log(make_log(np.arange(2.0), np.zeros(2), np.ones(2)), tmp_path / "log.csv")
    assert read_log(tmp_path / "log.csv").t.tolist() == [0.0, 1.0]

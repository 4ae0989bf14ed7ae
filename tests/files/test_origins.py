"""The origin of a result in files, and two results of one origin against each other."""

import dataclasses
import gzip
import json

import pytest

from jaxident.errors import InputError
from jaxident.files.compare import NOTHING, Difference, compare
from jaxident.files.models import load_model, save_model
from jaxident.files.origins import checksum, origin_from_dict, origin_to_dict, read_origin, with_origin, write_beside
from jaxident.origin import Input, Origin, versions

MADE = Origin(
    ("identify", "a.csv", "--horizon=2"), "--out", (Input("LOG", "a.csv", "0" * 64), Input("--sim", "b.csv", None)),
    tuple(versions().items()), 7,
)  # fmt: skip


def test_an_origin_reads_back_from_json_and_from_a_model(tmp_path):
    content = json.loads(json.dumps(origin_to_dict(MADE)))
    assert origin_from_dict(content, "file") == MADE
    model = load_model("published")
    told = with_origin(model.provenance, MADE)
    assert (told.version, told.logs, told.seed) == (versions()["jaxident"], ("a.csv",), 7)
    save_model(dataclasses.replace(model, provenance=told), tmp_path / "m.json")
    assert load_model(tmp_path / "m.json").provenance == told
    assert read_origin(tmp_path / "m.json") == (tmp_path / "m.json", MADE)
    assert "command" not in json.dumps(json.loads((tmp_path / "m.json").read_text()) | {"provenance": None})


def test_the_file_beside_is_found_by_both_names_and_knows_its_output(tmp_path):
    (tmp_path / "p.csv").write_text("t,x\n0,1\n")
    beside = write_beside(tmp_path / "p.csv", MADE)
    assert read_origin(beside) == read_origin(tmp_path / "p.csv") == (tmp_path / "p.csv", MADE)
    (tmp_path / "p.csv").write_text("t,x\n0,2\n")
    with pytest.raises(InputError, match="has changed since"):
        read_origin(tmp_path / "p.csv")
    assert write_beside("/dev/null", MADE) is None


def test_a_folder_has_the_checksum_of_its_logs(tmp_path):
    folder = tmp_path / "logs"
    folder.mkdir()
    (folder / "real_1.csv").write_text("1")
    first = checksum(folder)
    (folder / "notes.txt").write_text("no log")
    assert checksum(folder) == first
    (folder / "real_1.csv").rename(folder / "real_2.csv")
    second = checksum(folder)
    (folder / "real_2.csv").write_text("2")
    assert len({first, second, checksum(folder)}) == 3
    (folder / "metadata.yaml").write_text("")
    bag = checksum(folder)
    (folder / "run.db3").write_text("more")
    assert checksum(folder) != bag
    assert checksum("/dev/null") is None


def test_two_results_are_compared_value_by_value(tmp_path):
    before = {"a": {"b": [1.0, 2.0], "c": "x"}, "gone": None, "provenance": {"version": "1", "seed": 0}}
    after = {"a": {"b": [1.0, 2.5], "c": "y"}, "new": True, "provenance": {"version": "2", "seed": 0}}
    (tmp_path / "1.json").write_text(json.dumps(before))
    (tmp_path / "2.json").write_text(json.dumps(after))
    found = compare(tmp_path / "1.json", tmp_path / "2.json")
    assert (found.same, found.values) == (False, 6)
    assert found.differences == [
        Difference("a.b[1]", 2.0, 2.5), Difference("a.c", "x", "y"), Difference("gone", "null", NOTHING),
        Difference("new", NOTHING, True),
    ]  # fmt: skip
    assert found.differences[0].size == pytest.approx(0.2)
    assert found.differences[1].size == found.differences[3].size == float("inf")
    same = compare(tmp_path / "1.json", tmp_path / "1.json")
    assert (same.same, same.values, same.differences) == (True, 5, [])


def test_tables_and_texts_are_compared(tmp_path):
    (tmp_path / "1.csv.gz").write_bytes(gzip.compress(b"t,x\n0,1\n1,\n"))
    (tmp_path / "2.csv.gz").write_bytes(gzip.compress(b"t,x\n0,1\n1,5\n"))
    found = compare(tmp_path / "1.csv.gz", tmp_path / "2.csv.gz")
    assert (found.values, found.differences) == (4, [Difference("x, line 3", "", 5.0)])
    (tmp_path / "1.h").write_text("a\nb\n")
    (tmp_path / "2.h").write_text("a\nc\n")
    assert compare(tmp_path / "1.h", tmp_path / "2.h").differences == [Difference("line 2", "b", "c")]
    (tmp_path / "bad.csv").write_text("t,x\n0\n")
    with pytest.raises(InputError, match="is no table"):
        compare(tmp_path / "bad.csv", tmp_path / "1.h")

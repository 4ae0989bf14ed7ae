"""The version is the same wherever it is stated, and the types come with the package."""

import pathlib
import re
import tomllib

import jaxident as ji

ROOT = pathlib.Path(__file__).resolve().parents[1]
STATED = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]


def test_every_file_states_the_same_version():
    citation = re.search(r"^version: (.*)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)[1]
    newest = re.search(r"^## (\d[\d.]*)", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)[1]
    assert {ji.__version__, citation, newest} == {STATED}


def test_types_come_with_the_package():
    assert (ROOT / "jaxident" / "py.typed").exists()

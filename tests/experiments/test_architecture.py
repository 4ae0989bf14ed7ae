"""The drawing of the rooms is that of the code, and every file that its page names is there."""

import pathlib
import re

from experiments import architecture

ROOT = pathlib.Path(__file__).resolve().parents[2]


def test_the_drawing_is_up_to_date():
    again = "out of date: run python -m experiments.architecture"
    assert architecture.PICTURE.read_text(encoding="utf-8") == architecture.drawing(), again


def test_an_arrow_that_a_longer_way_replaces_is_left_out():
    graph = {"a": {"b", "c"}, "b": {"c"}, "c": set()}
    assert architecture.floors(graph) == {"a": 2, "b": 1, "c": 0}
    assert sorted(architecture.arrows(graph)) == [("a", "b"), ("b", "c")]


def test_every_file_that_the_page_names_exists():
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    names = set(re.findall(r"`((?:jaxident|tests)/[\w/]+\.py)`", text))
    assert len(names) > 10
    assert not [name for name in names if not (ROOT / name).exists()]


def test_every_function_that_the_page_names_is_in_its_file():
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    named = re.findall(r"`(jaxident/[\w/]+\.py)`, function `(\w+)`", text)
    assert len(named) > 6
    assert not [(file, name) for file, name in named if f"def {name}(" not in (ROOT / file).read_text(encoding="utf-8")]

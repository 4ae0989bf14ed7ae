"""The page of several robots of one make."""

import json
import pathlib

from withheld.real.set_page import lead, set_page

from jaxident.report.page import render

REAL = pathlib.Path(__file__).parents[2] / "experiments" / "withheld" / "real"


def diagnoses():
    return {path.stem: json.loads(path.read_text()) for path in sorted(REAL.glob("create_*.json"))}


def test_every_robot_stands_in_every_table():
    page = render(set_page(diagnoses(), "Creates <of> one make"))
    assert "Creates &lt;of&gt; one make" in page
    for robot in ("create_1", "create_5"):
        assert page.count(f"<td>{robot}</td>") == 3
    assert page.count("data:image/png") == 2


def test_the_lead_counts_verdicts_and_the_commonest_effect():
    found = diagnoses()
    named = {name: each | {"verdict": "effects", "selected": ["turn_loss"]} for name, each in found.items()}
    assert "no effect is named" in lead({"a": found["create_1"] | {"selected": []}})
    assert "turn_loss is named on 5" in lead(named)


def test_robots_without_regions_or_shrink_have_a_page():
    found = diagnoses()["create_1"]
    bare = found | {"where": found["where"] | {"regions": []}, "gap": found["gap"] | {"shrink": None}}
    page = render(set_page({"one": bare}, "One"))
    assert "none told" in page
    assert page.count("data:image/png") == 1

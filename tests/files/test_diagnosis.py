"""diagnosis.json of diagnoses made up for each verdict."""

import json

import pytest
from support.diagnoses import VERDICTS, discovered_law, made_up

from jaxident.effects.catalogue import CATALOGUE
from jaxident.files.diagnosis import diagnosis_to_dict

KEYS = {"schema", "verdict", "probability", "account", "gap", "where", "causes", "selected", "discovered", "parameters",
        "not_testable", "next"}  # fmt: skip
GAP = {"horizon", "before", "refitted", "after", "discovered", "floor", "shrink", "shrink_interval", "rms"}
FIXED = ["camera", "start", "slip", "discovered", "rest"]


@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_verdict_is_strict_json_with_the_keys_of_the_schema(verdict):
    content = diagnosis_to_dict(made_up(verdict))
    assert json.loads(json.dumps(content, allow_nan=False)) == content
    assert content.keys() >= KEYS
    assert content["verdict"] == verdict
    assert content["schema"] == "jaxident.diagnosis/2"
    assert content["probability"].keys() == {"gap", "unexplained", "sets"}
    assert sum(each["p"] for each in content["probability"]["sets"]) == pytest.approx(1.0)
    assert content["gap"].keys() >= GAP
    assert content["gap"]["rms"].keys() == {"before", "refitted", "after", "discovered", "floor"}
    assert not set(content["selected"]) & set(content["not_testable"])
    for cause in content["causes"]:
        assert cause["site"] == CATALOGUE[cause["effect"]].site


@pytest.mark.parametrize("verdict", VERDICTS)
def test_the_account_adds_up(verdict):
    found = made_up(verdict)
    rows = diagnosis_to_dict(found)["account"]["rows"]
    assert [row["part"] for row in rows] == [*FIXED[:3], *found.selected, *FIXED[3:]]
    assert sum(row["share"] for row in rows) == pytest.approx(1.0, abs=1e-9)
    for row in rows:
        assert row.keys() == {"part", "rms_position", "rms_heading", "share", "share_interval", "channels"}
        assert row["share_interval"][0] <= row["share"] <= row["share_interval"][1]
    squares = sum(row["rms_position"] * abs(row["rms_position"]) for row in rows)
    assert squares == pytest.approx(diagnosis_to_dict(found)["gap"]["rms"]["refitted"]["position"] ** 2)


def test_regions_of_commands_are_in_the_users_unit():
    found = made_up("effects")
    inner = {(r.variable, r.low) for r in found.where.regions}
    told = {r["variable"]: r["from"] for r in diagnosis_to_dict(found)["where"]["regions"]}
    for variable, low in inner:
        factor = found.prepared.largest if "u" in variable else 1.0
        assert any(abs(value - factor * low) < 1e-12 for name, value in told.items() if name == variable)


def test_a_discovered_law_has_the_keys_of_the_schema():
    content = diagnosis_to_dict(made_up("partly")._replace(discovered=(discovered_law(),)))
    assert json.loads(json.dumps(content, allow_nan=False)) == content
    (law,) = content["discovered"]
    keys = {"site", "acts_on", "inputs", "memory", "curve", "share", "p_value", "looks_like"}
    assert law.keys() >= keys
    assert (law["site"], law["inputs"], law["memory"]) == ("drive", ["w", "v"], None)
    assert all(point.keys() == {"at", "value", "standard_deviation"} for point in law["curve"])
    assert law["looks_like"].keys() == {"form", "parameters", "part_explained"}
    assert diagnosis_to_dict(made_up("partly"))["discovered"] is None

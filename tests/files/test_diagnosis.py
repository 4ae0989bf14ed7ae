"""diagnosis.json of diagnoses made up for each verdict."""

import json

import pytest
from support.diagnoses import VERDICTS, made_up

from jaxident.effects.catalogue import CATALOGUE
from jaxident.files.diagnosis import diagnosis_to_dict

KEYS = {"schema", "verdict", "probability", "gap", "where", "causes", "selected", "parameters", "not_testable", "next"}


@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_verdict_is_strict_json_with_the_keys_of_the_schema(verdict):
    content = diagnosis_to_dict(made_up(verdict))
    assert json.loads(json.dumps(content, allow_nan=False)) == content
    assert content.keys() >= KEYS
    assert content["verdict"] == verdict
    assert content["gap"].keys() >= {"horizon", "before", "refitted", "after", "floor", "shrink", "shrink_interval"}
    for cause in content["causes"]:
        assert cause["site"] == CATALOGUE[cause["effect"]].site


def test_regions_of_commands_are_in_the_users_unit():
    found = made_up("effects")
    inner = {(r.variable, r.low) for r in found.where.regions}
    told = {r["variable"]: r["from"] for r in diagnosis_to_dict(found)["where"]["regions"]}
    for variable, low in inner:
        factor = found.prepared.largest if "u" in variable else 1.0
        assert any(abs(value - factor * low) < 1e-12 for name, value in told.items() if name == variable)

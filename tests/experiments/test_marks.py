"""Marks of hand-written diagnoses."""

import pytest
from withheld.scoring.marks import mark

BATCH = {"generator": "batch", "strength": [0.3], "inputs": "multilevel"}
NONE = BATCH | {"kind": "none", "effects": [], "accepted": [], "channels": []}
DELAY = BATCH | {
    "kind": "single",
    "effects": [{"name": "transport_delay", "parameters": {"delay": 0.03}, "sites": ["actuation"]}],
    "accepted": [["transport_delay"]],
    "channels": ["along", "heading"],
}
GRIP = DELAY | {
    "effects": [{"name": "low_grip", "parameters": {}, "sites": ["contact"]}],
    "accepted": [["traction_limit", "lateral_slip"]],
}
PAIR = DELAY | {
    "kind": "pair",
    "effects": [*DELAY["effects"], {"name": "slope", "parameters": {}, "sites": ["contact"]}],
    "accepted": [["transport_delay"], ["slope"]],
}
OUTSIDE = DELAY | {
    "kind": "outside",
    "effects": [{"name": "tether", "parameters": {}, "sites": ["drive", "contact"]}],
    "accepted": [],
    "channels": [],
}


MANY = DELAY | {"kind": "many", "accepted": [["transport_delay"], ["slope"], ["turn_loss"], ["backlash"]]}
MIXED = DELAY | {
    "kind": "mixed",
    "effects": [*DELAY["effects"], {"name": "tether", "parameters": {}, "sites": ["drive", "contact"]}],
    "outside": ["tether"],
}


def says(*selected, verdict="effects", alike=None, p=0.9, site="actuation", channel="along"):
    """A diagnosis as `jaxident diagnose` writes it."""
    sets = (
        [{"effects": list(selected), "p": p}, {"effects": [], "p": 1.0 - p}]
        if selected
        else [{"effects": [], "p": 1.0}]
    )
    return {
        "schema": "jaxident.diagnosis/2",
        "verdict": verdict,
        "probability": {"gap": 1.0 - sets[-1]["p"], "unexplained": 0.0, "sets": sets},
        "selected": list(selected),
        "causes": [{"effect": name, "indistinguishable_from": (alike or {}).get(name, [])} for name in selected],
        "where": {"site": {site: 0.8, "camera": 0.1}, "channels": {channel: 0.7, "lateral": None}},
    }


@pytest.mark.parametrize(
    ("answer", "diagnosis", "right", "strict", "some", "extra"),
    [
        (DELAY, says("transport_delay"), True, True, True, False),
        (DELAY, says("motor_lag"), False, False, False, True),
        (DELAY, says("motor_lag", alike={"motor_lag": ["transport_delay"]}), True, False, True, False),
        (DELAY, says("transport_delay", "slope"), False, False, True, True),
        (DELAY, says("transport_delay", verdict="partly"), True, True, True, False),
        (DELAY, says("transport_delay", verdict="undecided"), False, False, False, False),
        (DELAY, says(verdict="no_gap"), False, False, False, False),
        (DELAY, None, False, False, False, False),
        (PAIR, says("slope", "transport_delay"), True, True, True, False),
        (PAIR, says("slope"), False, False, True, False),
        (PAIR, says("slope", "motor_lag", alike={"motor_lag": ["transport_delay"]}), True, False, True, False),
        (PAIR, says("slope", "backlash"), False, False, True, True),
        (GRIP, says("lateral_slip"), True, True, True, False),
        (GRIP, says("lateral_slip", "traction_limit"), True, True, True, False),
        (GRIP, says("slope"), False, False, False, True),
    ],
)
def test_naming(answer, diagnosis, right, strict, some, extra):
    found = mark(answer, diagnosis)
    assert (found["right"], found["strict"], found["some"], found["extra"]) == (right, strict, some, extra)


def test_one_name_for_two_effects_is_not_both():
    alike = {"motor_lag": ["transport_delay", "slope"]}
    assert not mark(PAIR, says("motor_lag", alike=alike))["right"]


@pytest.mark.parametrize("verdict", ["effects", "partly", "unknown", "no_gap", "parameters", "undecided"])
def test_which_verdicts_claim_a_gap_and_which_a_rest(verdict):
    found = mark(NONE, says(verdict=verdict))
    assert found["claimed"] is (verdict in ("effects", "partly", "unknown"))
    assert found["unexplained"] is (verdict in ("partly", "unknown"))
    assert found["right"] is None


def test_site_and_channel():
    found = mark(DELAY, says("transport_delay"))
    assert found["site"] is True
    assert found["channel"] is True
    assert mark(DELAY, says("transport_delay", site="contact"))["site"] is False
    assert mark(DELAY, says("x", site="contact", channel="lateral"))["channel"] is False
    assert mark(DELAY, None)["site"] is False
    assert mark(NONE, says())["site"] is None
    assert mark(OUTSIDE, says(verdict="unknown", site="drive"))["site"] is True
    assert mark(OUTSIDE, says(verdict="unknown"))["channel"] is None


def test_probabilities():
    assert mark(DELAY, says("transport_delay", p=0.7))["top"] == (0.7, True)
    assert mark(DELAY, says("slope", p=0.7))["probability_of_truth"] == 0.0
    assert mark(NONE, says())["top"] == (1.0, True)
    assert mark(NONE, None)["top"] is None
    outside = says(verdict="unknown") | {"probability": {"gap": 0.9, "unexplained": 0.8, "sets": []}}
    assert mark(OUTSIDE, outside)["top"] == (0.8, True)
    assert mark(OUTSIDE, outside)["unexplained"]
    sets = [{"effects": ["motor_lag"], "p": 0.5}, {"effects": ["transport_delay"], "p": 0.4}, {"effects": [], "p": 0.1}]
    both = says("motor_lag") | {"probability": {"gap": 0.9, "unexplained": 0.0, "sets": sets}}
    assert mark(DELAY, both)["top"] == (0.5, False)
    assert mark(DELAY, both)["probability_of_truth"] == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("diagnosis", "named", "extras", "right"),
    [
        (says("slope", "backlash", "turn_loss", "transport_delay"), 4, 0, True),
        (says("slope", "turn_loss", "mass_offset", verdict="partly"), 2, 1, False),
        (says("motor_lag", "slope", alike={"motor_lag": ["slope", "backlash"]}), 2, 0, False),
        (says("motor_lag", alike={"motor_lag": ["slope", "backlash"]}), 1, 0, False),
        (says(verdict="unknown"), 0, 0, False),
        (None, 0, 0, False),
    ],
)
def test_how_many_are_named(diagnosis, named, extras, right):
    found = mark(MANY, diagnosis)
    assert (found["hidden"], found["named"], found["extras"], found["right"]) == (4, named, extras, right)


@pytest.mark.parametrize(
    ("diagnosis", "some", "told", "extras"),
    [
        (says("transport_delay", verdict="partly"), True, True, 0),
        (says("transport_delay"), True, False, 0),
        (says("slope", verdict="partly"), False, True, 1),
        (says(verdict="unknown"), False, True, 0),
    ],
)
def test_one_of_the_catalogue_beside_one_outside(diagnosis, some, told, extras):
    found = mark(MIXED, diagnosis)
    assert (found["some"], found["unexplained"], found["extras"]) == (some, told, extras)
    assert found["channel"] is None  # the channel of most excess may be the outside effect's
    assert mark(MIXED, says("transport_delay", site="drive"))["site"] is True

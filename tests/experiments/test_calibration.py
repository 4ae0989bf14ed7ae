"""Claims that a cause takes part, against the answers, by hand."""

import numpy as np
import pytest
from withheld.scoring.calibration import calibration_error, claims, log_score, overconfidence, tallied, tally_error


def said(*causes, silent=()):
    """A diagnosis of causes (name, probability, names that cannot be told from it)."""
    listed = [{"effect": name, "probability": p, "indistinguishable_from": alike} for name, p, alike in causes]
    return {"causes": listed, "probability": {"sets": []}, "not_testable": list(silent)}


def test_causes_listed_and_hidden_effects_that_are_not():
    answer = {"accepted": [["slope"], ["backlash"]]}
    found = claims(answer, said(("slope", 0.9, []), ("turn_loss", 0.2, [])))
    assert sorted(found) == [(0.0, True), (0.2, False), (0.9, True)]


def test_look_alikes_are_one_claim():
    causes = ("motor_lag", 0.6, ["transport_delay", "backlash"]), ("transport_delay", 0.3, []), ("slope", 0.01, [])
    assert sorted(claims({"accepted": [["backlash"]]}, said(*causes))) == [
        (0.01, False),
        (pytest.approx(0.9), True),
    ]
    assert claims({"accepted": []}, said(*causes)) == [(pytest.approx(0.9), False), (0.01, False)]


def test_names_that_are_right_for_one_effect_are_one_claim():
    answer = {"accepted": [["traction_limit", "lateral_slip"]]}
    found = claims(answer, said(("traction_limit", 0.7, []), ("lateral_slip", 0.4, [])))
    assert found == [(1.0, True)]


def test_what_an_input_cannot_show_is_not_held_against_it():
    answer = {"accepted": [["slope"], ["direction_gain"]]}
    assert claims(answer, said(("slope", 0.9, []), silent=["direction_gain"])) == [(0.9, True)]
    found = claims(answer, said(("direction_gain", 0.2, []), silent=["direction_gain"]))
    assert sorted(found) == [(0.0, True), (0.2, True)]  # listed after all, and slope is not


def test_methods_without_probabilities_claim_nothing():
    assert claims({"accepted": [["slope"]]}, {"causes": [{"effect": "slope"}], "probability": None}) == []
    assert claims({"accepted": [["slope"]]}, None) == []


def test_tallies_add_up_to_the_error_of_all_claims():
    rng = np.random.default_rng(0)
    each = [[(float(p), bool(rng.random() < p**2)) for p in rng.random(5)] for _ in range(40)]
    tallies = np.stack([tallied(found) for found in each])
    every = np.array([claim for found in each for claim in found], float)
    assert tally_error(tallies) == pytest.approx(calibration_error(every))
    p, true = every.T
    assert log_score(tallies) == pytest.approx(np.mean(np.where(true > 0, np.log(p), np.log(1 - p))), rel=1e-3)
    sure = every[every[:, 0] >= 0.5]
    assert overconfidence(tallies) == pytest.approx(np.mean(sure[:, 0] - sure[:, 1]))


def test_a_hidden_effect_at_nought_costs_as_much_as_one_at_a_thousandth():
    assert log_score(tallied([(0.0, True)])[None]) == pytest.approx(np.log(1e-3))

"""A study that makes no sense is refused in one line that names the key."""

import dataclasses

import pytest
from support.studies import ROBOT, SMALL, UNDER_EFFECTS

from jaxident.errors import InputError
from jaxident.robot.model import Effect
from jaxident.study.design import Candidate, EffectSet, check_study
from jaxident.study.estimators import settings_of
from jaxident.study.sight import Choice

LAGGING = dataclasses.replace(ROBOT, effects=(Effect("motor_lag", {"time_constant": 0.05}),))


def test_shape_counts_trials():
    check_study(SMALL)
    assert SMALL.shape == (1, 1, 1, 1, 1, 2, 6)
    assert SMALL.trials == 12
    check_study(UNDER_EFFECTS)
    assert UNDER_EFFECTS.shape == (1, 1, 1, 3, 1, 1, 2, 6)
    assert UNDER_EFFECTS.axes[2:5] == ("robot", "effect", "period")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"noise": ()}, ["noise", "empty"]),
        ({"noise": (1e-3, -1e-3)}, ["noise", "-0.001", "negative"]),
        ({"noise": (float("nan"),)}, ["noise", "finite"]),
        ({"noise": (1e-3, 1e-3)}, ["noise", "twice"]),
        ({"excitations": ("staircase", "sawtooth")}, ["excitations", "sawtooth", "multisine"]),
        ({"amplitude": (0.0,)}, ["amplitude", "0"]),
        ({"period": (-0.1,)}, ["period", "-0.1"]),
        ({"samples": (5,)}, ["samples", "5", "20"]),
        ({"seeds": 0}, ["seeds", "at least 1"]),
        ({"chunk": 0}, ["chunk", "at least 1"]),
        ({"heading_per_position": -1.0}, ["heading_per_position"]),
        ({"correlation_time": 0.0}, ["correlation_time"]),
        ({"estimators": ()}, ["estimators", "empty"]),
        ({"estimators": (Choice("mine", "kalman"),)}, ["mine", "kalman", "recursive"]),
        ({"estimators": (Choice("mine", "batch", (("memory", 3),)),)}, ["memory", "setup_samples"]),
        ({"estimators": (Choice("mine", "recursive", (("forgetting", 1.5),)),)}, ["forgetting", "1.5", "at most 1"]),
        ({"robots": (Candidate("wide", ROBOT, (1.0, 0.0, 0.0, 0.0)),)}, ["wide", "spread", "below 1"]),
        ({"robots": (Candidate("free", dataclasses.replace(ROBOT, dynamics=ROBOT.difference)),)}, ["free", "physical"]),
        (
            {"robots": (Candidate("odd", dataclasses.replace(ROBOT, effects=(Effect("backlash", {"right": -1.0}),))),)},
            ["odd", "right is -1"],
        ),
        ({"effects": (EffectSet("none"), EffectSet("none"))}, ["effects", "'none'", "twice"]),
        ({"effects": (EffectSet("a", (Effect("lag", {}),)),)}, ["effects: 'a'", "unknown effect 'lag'"]),
        ({"effects": (EffectSet("a", (Effect("transport_delay", {"delay": 9.0}),)),)}, ["'a'", "delay is 9 s"]),
        (
            {"robots": (Candidate("slow", LAGGING),), "effects": (EffectSet("lag", LAGGING.effects),)},
            ["effects: 'lag'", "robot 'slow' has 'motor_lag' of its own", "one of the two"],
        ),
    ],
)
def test_what_makes_no_sense_is_refused(change, words):
    with pytest.raises(InputError) as error:
        check_study(SMALL._replace(**change), "study.toml")
    assert str(error.value).startswith("study.toml: ")
    assert "\n" not in str(error.value)
    for word in words:
        assert word in str(error.value)


def test_settings_are_defaults_and_what_is_given():
    settings = settings_of(Choice("mine", "recursive", (("forgetting", 0.99),)))
    assert settings["forgetting"] == 0.99
    assert settings["reading"] == "one_step"

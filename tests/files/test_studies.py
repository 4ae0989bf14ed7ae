"""Study files: the example reads, what is wrong is named."""

import re

import numpy as np
import pytest
from support.studies import SMALL, SMALL_TOML

from jaxident.effects.catalogue import CATALOGUE
from jaxident.errors import InputError
from jaxident.files.models import save_model
from jaxident.files.studies import parse_study, read_study
from jaxident.files.study_example import EXAMPLE
from jaxident.study.dataset import describe

ESTIMATORS = '[{ name = "key-term", method = "key-term-least-squares" }]'


def test_a_file_is_its_study():
    assert describe(parse_study(SMALL_TOML, "study.toml")) == describe(SMALL)


def test_the_example_reads_with_and_without_its_comments():
    study = parse_study(EXAMPLE, "study.toml")
    assert study.shape == (2, 1, 1, 1, 1, 4, 50)
    every = parse_study(re.sub(r"^# (?=\w+ = )", "", EXAMPLE, flags=re.MULTILINE), "study.toml")
    assert len(every.robots) == 3 * 4
    assert every.effect_names == {"motor_lag", "coulomb_friction", "turn_loss", "slope", "supply_sag"}
    assert [one.name for one in every.effects] == ["none", "turn_loss", "slope x0.5", "slope x2", "sag"]
    assert every.period == (0.0333, 0.1)
    assert every.correlation_time == 0.5


def test_a_grid_of_robots(tmp_path):
    save_model(SMALL.robots[0].model, tmp_path / "mine.json")
    text = SMALL_TOML.replace(
        'model = "published", spread = { gain = 0.2, dead_zone = 0.1 }',
        'model = "mine.json", name = "mine", scale = { dead_zone = [0.5, 2.0], rate = [1.0, 3.0] }',
    )
    (tmp_path / "study.toml").write_text(text)
    study = read_study(tmp_path / "study.toml")
    assert [robot.name for robot in study.robots] == [
        "mine ratex1 dead_zonex0.5", "mine ratex1 dead_zonex2", "mine ratex3 dead_zonex0.5", "mine ratex3 dead_zonex2",
    ]  # fmt: skip
    np.testing.assert_allclose(study.robots[3].model.dead_zone, [0.5, 0.4])
    np.testing.assert_allclose(
        study.robots[3].model.dynamics.rate, 3.0 * np.asarray(SMALL.robots[0].model.dynamics.rate)
    )


def test_sets_of_effects_become_robots():
    sets = "[{}, { motor_lag = 0.5, slope = 2 }, { stiction = { right = 0.1 } }, { input_saturation = [2, 4] }]"
    text = SMALL_TOML.replace(
        "spread = { gain = 0.2, dead_zone = 0.1 }", f"scale = {{ rate = [1, 2] }}, effects = {sets}"
    )
    study = parse_study(text, "study.toml")
    assert [robot.name for robot in study.robots[::2]] == [
        "published ratex1", "published ratex1 + motor_lag x0.5 + slope x2", "published ratex1 + stiction right=0.1",
        "published ratex1 + input_saturation x2", "published ratex1 + input_saturation x4",
    ]  # fmt: skip
    found = [{effect.name: effect.parameters for effect in robot.model.effects} for robot in study.robots[1::2]]
    assert found[0] == {}
    assert found[1]["motor_lag"] == {"time_constant": 0.03, "second_order": 0.0}
    assert found[1]["slope"] == {"acceleration": 0.1, "direction": 0.7}  # the direction is a shape
    assert found[2:4] == [{"stiction": {"right": 0.1}}, {"input_saturation": {"level": 0.3, "soft": 0.0}}]
    assert found[4] == {"input_saturation": {"level": 0.15, "soft": 0.0}}
    assert describe(study)["robots"][2]["effects"] == found[1]


def test_an_axis_of_effects():
    axis = (
        "['none', 'turn_loss', { motor_lag = [0.5, 1], slope = 2 }, { slope = { acceleration = 1 } }, { name = 'a' }]"
    )
    study = parse_study(SMALL_TOML.replace("hold = 3", f"hold = 3\neffects = {axis}"), "study.toml")
    assert [one.name for one in study.effects] == [
        "none", "turn_loss", "motor_lag x0.5 + slope x2", "motor_lag x1 + slope x2", "slope acceleration=1", "a",
    ]  # fmt: skip
    sizes = [{effect.name: effect.parameters for effect in one.effects} for one in study.effects]
    assert sizes[0] == sizes[5] == {}
    assert sizes[1]["turn_loss"] == CATALOGUE["turn_loss"].typical()
    assert sizes[2]["motor_lag"] == {"time_constant": 0.03, "second_order": 0.0}
    assert sizes[4] == {"slope": {"acceleration": 1.0}}
    assert [one["name"] for one in describe(study)["effects"]] == [one.name for one in study.effects]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("seeds = 6", "seeds = 6\nsedes = 7", ["unknown key 'sedes'"]),
        ("seeds = 6", "", ["no key 'seeds'"]),
        ("seeds = 6", "seeds = 6.5", ["seeds", "whole"]),
        ("seeds = 6", "seeds = true", ["seeds", "number"]),
        ("noise = [1e-6, 1e-4]", "noise = []", ["noise", "empty"]),
        ("noise = [1e-6, 1e-4]", "noise = 1e-6", ["noise", "list"]),
        ("noise = [1e-6, 1e-4]", "noise = [-1e-6]", ["noise", "negative"]),
        ("noise = [1e-6, 1e-4]", "noise = [inf]", ["noise[0]", "finite"]),
        (ESTIMATORS, '["kalman"]', ["kalman", "batch, recursive"]),
        (ESTIMATORS, '[{ method = "batch", settings = { reading = "x" } }]', ["reading", "one_step"]),
        (ESTIMATORS, '["batch", "batch"]', ["estimators", "twice"]),
        ("gain = 0.2", "mass = 0.2", ["robots[0]", "spread", "mass"]),
        ("gain = 0.2", "gain = 2.0", ["spread", "below 1"]),
        ('"published"', '"nobody"', ["robots[0]", "nobody", "no such file"]),
        ("spread = { gain = 0.2, dead_zone = 0.1 }", "scale = { gain = [] }", ["scale.gain", "empty"]),
        ("spread = {", "effects = [{ lag = 1.0 }], spread = {", ["robots[0]: effects[0]", "unknown effect 'lag'"]),
        ("spread = {", "effects = [{ motor_lag = 0 }], spread = {", ["effects[0]: motor_lag", "above 0"]),
        ("spread = {", "effects = [{ motor_lag = { tau = 1 } }], spread = {", ["effects[0]", "'tau'"]),
        ("spread = {", "effects = [{ transport_delay = { delay = 9 } }], spread = {", ["delay is 9 s", "longer"]),
        ("spread = {", "effects = [], spread = {", ["effects", "empty"]),
        ("hold = 3", "hold = 3\neffects = []", ["effects", "empty"]),
        ("hold = 3", "hold = 3\neffects = 'slope'", ["effects", "list"]),
        ("hold = 3", "hold = 3\neffects = [1]", ["effects[0]", "object"]),
        (
            "hold = 3",
            "hold = 3\neffects = ['none', 'turnloss']",
            ["effects[1]", "unknown effect 'turnloss'", "turn_loss"],
        ),
        ("hold = 3", "hold = 3\neffects = [{ lag = 1 }]", ["effects[0]", "unknown effect 'lag'"]),
        ("hold = 3", "hold = 3\neffects = [{ motor_lag = [1, 0] }]", ["effects[0]: motor_lag", "above 0"]),
        ("hold = 3", "hold = 3\neffects = [{ motor_lag = [] }]", ["effects[0]: motor_lag", "empty"]),
        ("hold = 3", "hold = 3\neffects = [{ motor_lag = {} }]", ["effects[0]: motor_lag", "no parameter"]),
        ("hold = 3", "hold = 3\neffects = [{ motor_lag = { tau = 1 } }]", ["effects", "'tau'", "time_constant"]),
        ("hold = 3", "hold = 3\neffects = ['slope', 'slope']", ["effects", "'slope'", "twice"]),
        ("hold = 3", "hold = 3\neffects = [{ name = 'a', slope = [1, 2] }]", ["effects[0]: name", "2 sets"]),
        ("hold = 3", "hold = = 3", ["not TOML", "line"]),
    ],
)
def test_what_is_wrong_is_named(old, new, words):
    assert old in SMALL_TOML
    with pytest.raises(InputError) as error:
        parse_study(SMALL_TOML.replace(old, new), "study.toml")
    assert str(error.value).startswith("study.toml: ")
    for word in words:
        assert word in str(error.value)


def test_a_file_that_is_not_there():
    with pytest.raises(InputError, match="no such file"):
        read_study("nowhere.toml")

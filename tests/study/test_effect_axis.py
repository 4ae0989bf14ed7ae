"""Effects as an axis: the same numbers as robots that have them, the same random draws under each."""

import dataclasses

import jax
import numpy as np
import pytest
from support.studies import ROBOT, SMALL, UNDER_EFFECTS

import jaxident as ji
from jaxident.robot.model import Discovered
from jaxident.study.dataset import FURTHER_AXES, coordinates, describe, study_arrays
from jaxident.study.design import Candidate
from jaxident.study.engine import cells, run_one
from jaxident.study.statistics import summarise
from jaxident.study.trial import commands, record


@pytest.fixture(scope="module")
def under_effects():
    return study_arrays(UNDER_EFFECTS)


def test_it_is_the_study_of_robots_that_have_these_effects(under_effects):
    plain = SMALL.robots[0]
    robots = tuple(
        plain._replace(name=one.name, model=dataclasses.replace(plain.model, effects=one.effects))
        for one in UNDER_EFFECTS.effects
    )
    other = study_arrays(SMALL._replace(robots=robots))
    for name in FURTHER_AXES:
        np.testing.assert_array_equal(under_effects[name].squeeze("robot"), other[name])


def test_the_axis_has_its_name_everywhere(under_effects):
    assert under_effects["estimate"].dims[2:5] == ("robot", "effect", "period")
    assert list(under_effects["effect"].values) == ["none", "payload", "late"]
    summary = summarise(under_effects)
    assert summary["rmse"].dims[:4] == ("excitation", "samples", "robot", "effect")
    error = summary["rmse"].sel(parameter="alpha_2").squeeze()
    assert np.all(error.sel(effect="late") > 3.0 * error.sel(effect="none"))


def test_without_it_nothing_changes():
    assert "effect" not in coordinates(SMALL)
    assert "effects" not in describe(SMALL)
    assert SMALL.effect_names == frozenset()


def test_effects_share_their_random_numbers(under_effects):
    """One robot for each seed, one input, one camera error; under no effect the study without the axis."""
    for effect in ("payload", "late"):
        truth = under_effects["truth"].sel(effect=[effect])
        np.testing.assert_array_equal(truth, under_effects["truth"].sel(effect=["none"]))
    seed, noise = 4, 1
    where = [np.ravel_multi_index((0, 0, 0, k, 0, 0, noise, seed), UNDER_EFFECTS.shape) for k in range(3)]
    made = [run_one(UNDER_EFFECTS, number)[0] for number in where]
    draws = [np.stack(one.measured) - np.stack(one.exact) for one in made]
    for other, draw in zip(made[1:], draws[1:], strict=True):
        np.testing.assert_array_equal(other.command.right, made[0].command.right)
        np.testing.assert_array_equal(other.robot.dead_zone, made[0].robot.dead_zone)
        np.testing.assert_allclose(draw, draws[0], rtol=1e-9, atol=1e-13)
        assert np.abs(np.stack(other.exact) - np.stack(made[0].exact)).max() > 1e-3
    np.testing.assert_allclose(under_effects["estimate"].sel(effect="none"), study_arrays(SMALL)["estimate"], rtol=1e-6)


@pytest.mark.parametrize("number", [0, 35])
def test_a_trial_alone_is_the_trial_in_the_study(under_effects, number):
    at = dict(zip(UNDER_EFFECTS.axes, np.unravel_index(number, UNDER_EFFECTS.shape), strict=True))
    outcome = run_one(UNDER_EFFECTS, number)[1]
    for name in FURTHER_AXES:
        np.testing.assert_array_equal(getattr(outcome, name), under_effects[name].isel(at))


def recorded(study, robot):
    """What the camera of one trial sees of a robot of a study: its second noise level, its third seed."""
    index = np.array([[0], [0], [robot], [0], [0], [1], [2]])
    where, base = cells(study, index), jax.random.key(study.seed)
    command = commands(base, where, "staircase", study.samples[0], study.hold)
    return jax.jit(record)(base, *(jax.tree.map(lambda leaf: leaf[0], part) for part in (where, command)))


@pytest.mark.slow  # two programs more, which take 12 s to compile
def test_robots_may_have_discovered_laws():
    """They move as the simulator says, those without as they do alone, and the law is told with the results."""
    plain = SMALL.robots[0]
    law = Discovered("acceleration along", "1", "v", np.linspace(-1.0, 1.0, 5), np.linspace(0.3, 0.1, 5))
    odd = Candidate("odd", dataclasses.replace(plain.model, discovered=(law,)), plain.spread)
    study = SMALL._replace(robots=(plain, odd))
    made, beside, alone = recorded(study, 1), recorded(study, 0), recorded(SMALL, 0)
    robot = dataclasses.replace(odd.model, dynamics=made.robot.dynamics, dead_zone=made.robot.dead_zone, noise=None)
    log = ji.make_log(study.period[0] * np.arange(study.samples[0]), *made.command)
    np.testing.assert_allclose(np.stack(made.exact), np.stack(ji.simulate(robot, log).pose), atol=1e-9)
    np.testing.assert_allclose(np.stack(beside.exact), np.stack(alone.exact), atol=1e-9)
    assert np.abs(made.exact.x - beside.exact.x).max() > 0.05
    assert describe(study)["robots"][1]["discovered"][0]["value"] == law.value.tolist()
    assert "discovered" not in describe(study)["robots"][0]


def test_they_come_on_top_of_what_a_robot_has():
    lagging = dataclasses.replace(ROBOT, effects=(dataclasses.replace(UNDER_EFFECTS.effects[2].effects[0]),))
    study = UNDER_EFFECTS._replace(
        robots=(*SMALL.robots, Candidate("late", lagging)), effects=UNDER_EFFECTS.effects[:2]
    )
    names = [[[effect.name for effect in effects] for effects in robot] for robot in study.in_force]
    assert names == [[[], ["payload_change"]], [["transport_delay"], ["transport_delay", "payload_change"]]]

"""Studies of robots that measure their wheels: the same trials seen with wheel speeds and without."""

import dataclasses

import jax
import numpy as np
import pytest
from support.studies import ROBOT, SMALL

import jaxident as ji
from jaxident.errors import InputError
from jaxident.robot.noise import Noise
from jaxident.robot.wheel_sensor import WheelSensor
from jaxident.study import bound, trial
from jaxident.study.design import Candidate, check_study
from jaxident.study.engine import cells, run_one
from jaxident.study.sight import Choice
from jaxident.study.synthetic import excite

SENSOR = WheelSensor(0.03, 0.1, 0.05)
MEASURED = dataclasses.replace(ROBOT, wheels=SENSOR)
BOTH, POSES = Choice("both", "maximum-likelihood"), Choice("poses", "maximum-likelihood", (("wheels", False),))
STUDY = SMALL._replace(robots=(Candidate("measured", MEASURED),), estimators=(BOTH, POSES), noise=(1e-4,),
                       samples=(200,), excitations=("multilevel",), seeds=2)  # fmt: skip


@pytest.fixture(scope="module")
def seen():
    return run_one(STUDY, 0)


def test_wheel_speeds_are_those_of_the_simulator():
    cell = jax.tree.map(lambda leaf: leaf[0], cells(STUDY, np.zeros((len(STUDY.axes), 1), int)))
    command = jax.tree.map(np.asarray, excite(jax.random.key(0), "multilevel", 200, ROBOT.sample_period).command)
    made = jax.jit(trial.record)(jax.random.key(0), cell, command)
    log = ji.make_log(ROBOT.sample_period * np.arange(200), *made.command)
    exact = ji.simulate(dataclasses.replace(MEASURED, wheels=SENSOR._replace(noise=0.0)), log)
    left = np.concatenate([made.wheels.right - exact.wheel_r, made.wheels.left - exact.wheel_l])
    assert np.sqrt(np.mean(left**2)) == pytest.approx(SENSOR.noise, rel=0.15)


@pytest.mark.slow
def test_the_estimator_uses_them_or_not_as_it_is_set(seen):
    made, found = seen
    poses = ji.make_log(ROBOT.sample_period * np.arange(200), *made.command, *made.measured)
    both = poses._replace(wheel_r=made.wheels.right, wheel_l=made.wheels.left)
    deviation = np.asarray(found.deviation)
    assert np.all(deviation[0] < deviation[1])
    for own, log in enumerate((both, poses)):
        whole = ji.identify(type(log)(*map(np.asarray, log)), noise_law="white")
        vector = np.concatenate([np.ravel(part) for part in (*whole.model.difference, whole.model.dead_zone)])
        np.testing.assert_allclose(np.asarray(found.estimate)[own], vector, rtol=1e-3, atol=1e-6)


@pytest.mark.slow
def test_the_bound_is_that_of_both_sensors(seen, monkeypatch):
    monkeypatch.setattr(bound, "SEEDS", 1)
    made, _ = seen
    every = bound.bounds(STUDY._replace(noise=(1e-4, 2e-4))).squeeze()
    log = ji.make_log(ROBOT.sample_period * np.arange(200), *made.command, *made.measured)
    log = log._replace(wheel_r=made.wheels.right, wheel_l=made.wheels.left)
    for place, level in enumerate((1e-4, 2e-4)):
        expected = ji.cramer_rao(MEASURED, log, Noise(level, 10.0 * level)).difference_deviation
        np.testing.assert_allclose(every[place], expected, rtol=1e-6)


def test_what_no_study_can_do_with_wheels_is_refused():
    mixed = STUDY._replace(robots=(*STUDY.robots, Candidate("plain", ROBOT)))
    with pytest.raises(InputError, match="1 of 2 measure their wheels; all should, or none"):
        check_study(mixed)
    exact = dataclasses.replace(ROBOT, wheels=SENSOR._replace(noise=0.0))
    with pytest.raises(InputError, match="wheels: noise should be above 0"):
        check_study(STUDY._replace(robots=(Candidate("exact", exact),)))
    with pytest.raises(InputError, match="wheels: is 3; true, or false for the poses alone"):
        check_study(STUDY._replace(estimators=(BOTH._replace(settings=(("wheels", 3),)),)))


@pytest.mark.slow
def test_under_effects_the_wheels_are_those_of_the_full_simulator():
    late = dataclasses.replace(MEASURED, effects=(ji.Effect("camera_latency", {"delay": 0.1}),))
    study = STUDY._replace(robots=(Candidate("late", late),))
    made, plain = run_one(study, 0)[0], run_one(STUDY, 0)[0]
    np.testing.assert_allclose(made.wheels.right, plain.wheels.right, atol=1e-6)
    assert np.abs(np.asarray(made.exact.x) - plain.exact.x).max() > 1e-3

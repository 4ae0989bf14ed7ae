"""Laws of a model that was given: every fit obeys them, whatever the angles at which wheels begin."""

import dataclasses

import jax
import numpy as np
import pytest

import jaxident as ji
from jaxident.diagnosis.motion.windows import take
from jaxident.diagnosis.preparation.given_laws import obeying_as
from jaxident.diagnosis.preparation.prepare import Prepared, prepare
from jaxident.effects.law_arrays import acting, joined, laws_of
from jaxident.log import join, make_log
from jaxident.robot.drive import Physical
from jaxident.robot.model import Discovered, Model
from jaxident.robot.noise import Noise

ROWS, RUNS, STEP = 320, 4, 0.05
NOISE = Noise(3e-4, 2e-3)
ROBOT = Model(STEP, Physical(np.array([3.0, 5.0]), np.array([[0.4, 0.39], [4.5, -4.6]])), np.array([0.16, 0.2]), NOISE)
AT, ROUND, FLOOR = np.linspace(-3.0, 3.0, 9), np.linspace(-np.pi, np.pi, 10), np.linspace(-1.0, 1.0, 5)
SLOW_TURNS = Discovered("acceleration along", "v", "w", AT, -0.25 * AT**2)
NOT_ROUND = Discovered(
    "push of the right wheel", "1", "own angle", ROUND, 0.2 * np.cos(ROUND), period=0.16, half_track=0.089
)
CARPET = Discovered("acceleration along", "v", "x", FLOOR, np.outer(FLOOR, FLOOR), None, "y", FLOOR)


def runs_of(model: Model, seed: int = 0):
    """Some runs of a robot with noise; in a unit in which the largest command is near 2."""
    rng, t, logs = np.random.default_rng(seed), STEP * np.arange(ROWS), []
    for run in range(RUNS):
        u = np.repeat(rng.uniform(-2.0, 2.0, (ROWS // 16, 2)), 16, axis=0)
        log = make_log(t, u[:, 0], u[:, 1], *np.zeros((3, ROWS)))
        logs.append(ji.simulate(model, log, key=jax.random.key(10 * seed + run)))
    return join(logs)


@pytest.mark.parametrize("pair", [(SLOW_TURNS, NOT_ROUND), (SLOW_TURNS, CARPET), (CARPET, SLOW_TURNS)])
def test_laws_that_are_joined_are_those_laws_together(pair):
    one, other = (laws_of([law]) for law in pair)
    together = laws_of(pair)
    found = joined(one, other)
    assert acting(found) == 2
    for column, expected in zip(found, together, strict=True):
        np.testing.assert_array_equal(column, expected)


def test_more_laws_than_a_model_may_have_are_left_out():
    full = laws_of([SLOW_TURNS] * 3)
    assert joined(full, laws_of([CARPET])).act.tolist() == full.act.tolist()


@pytest.fixture(scope="module")
def prepared() -> Prepared:
    """Of a robot that obeys the laws of the model that is given: one of turns, one of a wheel."""
    laws = (SLOW_TURNS, NOT_ROUND)
    return prepare(runs_of(dataclasses.replace(ROBOT, discovered=laws)), None, laws=laws)


def test_a_fit_that_obeys_the_robots_laws_leaves_noise(prepared):
    """Wheels begin at angles that nobody tells. Without a law, a robot that has the wheel's alone is missed by 2 mm."""
    apart = prepared.nominal.linear.residual.reshape(-1, 3)[:, :2]
    assert np.sqrt(np.mean(apart**2)) < 1.2 * NOISE.position


def test_a_laws_phase_goes_with_its_window(prepared):
    windows = take(prepared.windows, np.arange(len(prepared.windows.run))[::-1])
    phase = prepared.windows.laws.phase
    assert np.ptp(phase[1]) > 0.0
    np.testing.assert_array_equal(windows.laws.phase, phase[:, ::-1])
    fewer = take(prepared.windows._replace(laws=None), np.array([1, 4, 5]))
    np.testing.assert_array_equal(obeying_as(windows, fewer).laws.phase, phase[:, [1, 4, 5]])
    assert obeying_as(fewer, fewer) is fewer


@pytest.mark.slow
def test_a_robot_with_the_laws_of_the_given_model_has_no_gap():
    slipping = NOISE._replace(slip_along=0.004, slip_heading=0.02)
    model = dataclasses.replace(ROBOT, noise=slipping, discovered=(SLOW_TURNS, NOT_ROUND))
    found = ji.diagnose(runs_of(model, 2), model=model)
    assert found.verdict == "no_gap"
    assert found.corrected_model.discovered == found.nominal_model.discovered == model.discovered
    assert found.gap.after < 2.0 * found.gap.floor

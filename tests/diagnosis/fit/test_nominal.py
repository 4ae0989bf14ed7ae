"""The nominal fit that a search begins from: it does not stay in a wrong valley."""

from types import SimpleNamespace

import jax
import numpy as np
import pytest

from jaxident.diagnosis.fit.nominal import coasts, first_starts, hold_rates, lower_valley, rough_fit, steady_point
from jaxident.diagnosis.fit.refit import Data, refit
from jaxident.diagnosis.motion.windows import cut
from jaxident.diagnosis.noise.law import Law, white_whitener
from jaxident.effects.coordinates import natural, natural_slopes, neutral_vector, nominal_vector
from jaxident.estimation.poses.prior import RATE, RATE_SPREAD
from jaxident.log import Log, join
from jaxident.robot.drive import Physical
from jaxident.robot.model import Model
from jaxident.robot.noise import Noise
from jaxident.robot.simulate import simulate
from jaxident.study.synthetic import excite

STEP, ROWS = 0.0375, 40
LAW = Law(3e-4, 2e-3)
DRIVE = Physical(np.array([3.0, 5.0]), np.array([[0.5, 0.45], [9.0, -8.5]]))


def windows_of(hold):
    """Windows of three runs of the nominal robot whose commands are held for so many rows."""
    robot = Model(STEP, DRIVE, np.zeros(2), noise=Noise(3e-4, 2e-3))
    plain = [excite(jax.random.key(k), "multilevel", 320, STEP, hold=hold) for k in range(3)]
    runs = [simulate(robot, log, key=jax.random.key(10 + k)) for k, log in enumerate(plain)]
    return cut(join([Log(*map(np.asarray, run)) for run in runs]), ROWS)


def test_steady_speeds_answer_the_commands():
    """Windows last 1.5 s, the time constants are 0.3 and 0.2 s. The speed at the beginning of a window still comes from
    the command before, so that the answers are only about right."""
    point = steady_point(windows_of(20))
    answers = point[2:6] / np.exp(point[[0, 0, 1, 1]])
    truth = np.ravel(DRIVE.gain) / np.repeat(DRIVE.rate, 2)
    assert answers == pytest.approx(truth, rel=0.35)
    assert np.exp(point[:2]) == pytest.approx(4.0 / (ROWS * STEP))


def test_a_fit_in_a_wrong_valley_gives_way_to_a_lower_one():
    """From a robot that hardly answers its commands, each held for two windows, the fit crawls; from one that follows
    them it arrives."""
    windows = windows_of(80)
    slow = Physical(np.array([0.02, 0.02]), np.array([[1e-4, -1e-4], [1e-3, 1e-3]]))
    data = Data(windows, white_whitener(LAW, windows))
    wrong = refit(data, neutral_vector(nominal_vector(slow, np.zeros(2))), first_starts(windows), (), most=1)
    right = rough_fit(windows, neutral_vector(nominal_vector(DRIVE, np.zeros(2))), LAW)
    assert np.exp(wrong.vector[0]) < 0.1 * DRIVE.rate[0]
    found = lower_valley(wrong, windows)
    assert np.exp(found.vector[:2]) == pytest.approx(DRIVE.rate, rel=0.02)
    assert natural(found.vector)[2:6] == pytest.approx(np.ravel(DRIVE.gain), rel=0.1)
    assert lower_valley(right, windows) is right


def fit_with(rates, gain, deviation=0.01):
    vector = neutral_vector(nominal_vector(Physical(np.array(rates), np.array(gain)), np.zeros(2)))
    back = deviation * np.linalg.inv(natural_slopes(vector))
    return SimpleNamespace(vector=vector, covariance=back @ back.T)


@pytest.mark.parametrize(
    ("rates", "gain", "unexplained", "expected"),
    [
        ([0.05, 5.0], [[0.5, 0.4], [9.0, -8.5]], True, [True, False]),
        ([0.05, 5.0], [[0.5, 0.4], [9.0, -8.5]], False, [False, False]),  # slow, but it answers, and nothing is missing
        ([0.05, 0.1], [[0.5, -0.4], [9.0, -8.5]], False, [True, False]),  # one wheel drives backwards
        ([0.05, 0.1], [[0.02, 0.4], [0.01, 0.02]], False, [True, True]),  # gains without a sign
        ([0.4, 5.0], [[0.5, 0.4], [9.0, -8.5]], True, [False, False]),
    ],
)
def test_a_robot_that_coasts_is_told_from_a_slow_one(rates, gain, unexplained, expected):
    windows = windows_of(20)
    assert coasts(fit_with(rates, gain), windows, unexplained).tolist() == expected
    beside_wheels = windows._replace(wheels=np.zeros((*windows.seen.shape, 2)))
    assert not coasts(fit_with(rates, gain), beside_wheels, unexplained).any()


def test_a_rate_that_is_held_is_the_priors_and_as_uncertain():
    """The other speed is fitted as before: this robot's rates are 3 and 5 1/s, and the prior's is 3 by chance."""
    free = windows_of(20)
    data = Data(free, white_whitener(LAW, free))
    found = refit(data, neutral_vector(steady_point(free)), first_starts(free), ())
    windows, _ = hold_rates(free, np.array([False, True]), None)
    np.testing.assert_array_equal(windows.held, [np.nan, np.log(RATE), 0.0, 0.0])
    held = refit(data._replace(windows=windows), found.vector, found.starts, (), most=60)
    assert np.exp(held.vector[1]) == pytest.approx(RATE, rel=1e-4)
    assert held.vector[8:10] == pytest.approx([0.0, 0.0], abs=1e-4)
    assert np.sqrt(held.covariance[1, 1]) == pytest.approx(RATE_SPREAD)
    steady, slower = (natural(fit.vector)[4:6] / np.exp(fit.vector[1]) for fit in (found, held))
    assert slower == pytest.approx(steady, rel=0.1), "the steady turn rate is told whatever the rate"
    across = (natural_slopes(held.vector) @ held.covariance)[4:6, 1] / held.covariance[1, 1]
    assert across == pytest.approx(natural(held.vector)[4:6], rel=0.2), "a faster robot has larger gains"


def test_rates_are_held_as_a_given_model_has_them():
    told = np.concatenate([np.log([2.0, 4.0]), np.ravel(DRIVE.gain), np.zeros(2), [0.1, 0.3]])
    windows, fit = hold_rates(windows_of(20), np.array([True, False]), told)
    np.testing.assert_array_equal(windows.held, [np.log(2.0), np.nan, 0.1, 0.3])
    assert np.exp(fit.vector[0]) == pytest.approx(2.0, rel=1e-4)
    assert fit.vector[8:10] == pytest.approx([0.1, 0.3], abs=1e-3)

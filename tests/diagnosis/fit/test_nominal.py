"""The nominal fit that a search begins from: it does not stay in a wrong valley."""

import jax
import numpy as np
import pytest

from jaxident.diagnosis.fit.nominal import first_starts, lower_valley, rough_fit, steady_point
from jaxident.diagnosis.fit.refit import Data, refit
from jaxident.diagnosis.motion.windows import cut
from jaxident.diagnosis.noise.law import Law, white_whitener
from jaxident.effects.coordinates import neutral_vector, nominal_vector
from jaxident.log import Log, join
from jaxident.robot.drive import Physical
from jaxident.robot.model import Model
from jaxident.robot.noise import Noise
from jaxident.robot.simulate import simulate
from jaxident.study.synthetic import excite

STEP, ROWS = 0.03, 50
LAW = Law(3e-4, 2e-3)
DRIVE = Physical(np.array([3.0, 5.0]), np.array([[0.5, 0.45], [9.0, -8.5]]))


def windows_of(hold):
    """Windows of three runs of the nominal robot whose commands are held for so many rows."""
    robot = Model(STEP, DRIVE, np.zeros(2), noise=Noise(3e-4, 2e-3))
    plain = [excite(jax.random.key(k), "multilevel", 400, STEP, hold=hold) for k in range(3)]
    runs = [simulate(robot, log, key=jax.random.key(10 + k)) for k, log in enumerate(plain)]
    return cut(join([Log(*map(np.asarray, run)) for run in runs]), ROWS)


def test_steady_speeds_answer_the_commands():
    """Windows last 1.5 s, the time constants are 0.3 and 0.2 s. The speed at the beginning of a window still comes from
    the command before, so that the answers are only about right."""
    point = steady_point(windows_of(25))
    answers = point[2:6] / np.exp(point[[0, 0, 1, 1]])
    truth = np.ravel(DRIVE.gain) / np.repeat(DRIVE.rate, 2)
    assert answers == pytest.approx(truth, rel=0.35)
    assert np.exp(point[:2]) == pytest.approx(4.0 / (ROWS * STEP))


def test_a_fit_in_a_wrong_valley_gives_way_to_a_lower_one():
    """From a robot that hardly answers its commands, each held for two windows, the fit crawls; from one that follows
    them it arrives."""
    windows = windows_of(100)
    slow = Physical(np.array([0.02, 0.02]), np.array([[1e-4, -1e-4], [1e-3, 1e-3]]))
    data = Data(windows, white_whitener(LAW, windows))
    wrong = refit(data, neutral_vector(nominal_vector(slow, np.zeros(2))), first_starts(windows), (), most=1)
    right = rough_fit(windows, neutral_vector(nominal_vector(DRIVE, np.zeros(2))), LAW)
    assert np.exp(wrong.vector[0]) < 0.1 * DRIVE.rate[0]
    found = lower_valley(wrong, windows)
    assert np.exp(found.vector[:2]) == pytest.approx(DRIVE.rate, rel=0.02)
    assert found.vector[2:6] == pytest.approx(np.ravel(DRIVE.gain), rel=0.1)
    assert lower_valley(right, windows) is right

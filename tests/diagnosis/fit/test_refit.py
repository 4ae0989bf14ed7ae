"""A refit stays at a robot that can be, also where the runs say nothing of one wheel, and ends where it has arrived."""

import jax
import numpy as np
import pytest
from support.small_robot import VECTOR, nominal_fit, windows_of

from jaxident.diagnosis.fit.nominal import first_starts
from jaxident.diagnosis.fit.refit import ENOUGH, WIDE, Data, refit, speeds_up
from jaxident.diagnosis.motion.windows import cut
from jaxident.diagnosis.noise.law import Law, white_whitener
from jaxident.effects.coordinates import neutral_vector, nominal_vector, sizes
from jaxident.log import Log, join
from jaxident.robot.drive import Physical
from jaxident.robot.model import Model
from jaxident.robot.noise import Noise
from jaxident.robot.simulate import simulate
from jaxident.study.synthetic import excite

STEP = 0.03
DRIVE = Physical(np.array([3.0, 5.0]), np.array([[0.5, 0.45], [9.0, -8.5]]))


def runs_that_contradict():
    """Windows of three runs whose left wheel gets a command of one size or none. It passes the dead zone in the second
    run alone, where the dead zone is smaller."""
    runs = []
    for k, (command, zone) in enumerate([(0.3, 0.305), (0.31, 0.1), (0.3, 0.305)]):
        robot = Model(STEP, DRIVE, np.array([0.1, zone]), noise=Noise(3e-4, 2e-3))
        plain = excite(jax.random.key(k), "multilevel", 400, STEP, hold=20)
        left = np.where(np.abs(plain.u_l) > 0.4, command, 0.0) * np.sign(plain.u_l)
        runs.append(simulate(robot, plain._replace(u_l=left), key=jax.random.key(10 + k)))
    return cut(join([Log(*map(np.asarray, run)) for run in runs]), 50)


def test_the_gain_of_a_wheel_that_never_passes_its_dead_zone_follows_the_other_wheel():
    """One dead zone fits no such robot. The first fit puts it above every command, so that only the prior knows the
    left wheel; each further fit begins where the last one ended, as in a search."""
    windows = runs_that_contradict()
    data = Data(windows, white_whitener(Law(3e-4, 2e-3), windows))
    vector, starts = neutral_vector(nominal_vector(DRIVE, np.array([0.1, 0.2]))), first_starts(windows)
    for effects in ((), ("dead_zone_drift",), (), ("dead_zone_drift",)):
        fit = refit(data, vector, starts, effects)
        vector, starts = fit.vector, fit.starts
        assert np.isfinite(fit.cost)
        assert np.all(np.diagonal(fit.covariance) <= 1.001 * (WIDE * sizes()[fit.places]) ** 2)
    right, left = vector[[2, 4]], vector[[3, 5]]
    assert vector[7] > 0.3, "no command passes the left dead zone: otherwise this test shows nothing"
    assert left == pytest.approx(right * np.array([1.0, -1.0]), rel=1e-3)


def test_a_robot_whose_coupling_outdoes_its_rates_speeds_up_by_itself():
    """Against the eigenvalues of its speeds' equation."""
    for coupling in ((0.0, 0.0), (2.0, 5.0), (2.0, 8.0), (-3.0, 6.0), (-3.0, -6.0)):
        drive = DRIVE._replace(coupling=np.array(coupling))
        system = np.diag(-np.asarray(drive.rate)) + np.array([[0.0, coupling[0]], [coupling[1], 0.0]])
        grows = np.linalg.eigvals(system).real.max() > 0.0
        assert speeds_up(neutral_vector(nominal_vector(drive, np.zeros(2)))) == grows


def test_a_fit_ends_only_where_its_start_states_have_arrived():
    """From the right robot and start speeds of zero: the coordinates have arrived first. The fit once ended there, 4.7
    above the valley's floor."""
    windows = windows_of(VECTOR)
    data, fit = nominal_fit(windows)
    again = refit(data, fit.vector, fit.starts, ())
    assert fit.cost - again.cost < ENOUGH

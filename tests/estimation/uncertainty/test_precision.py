"""The Cramer-Rao bound: against finite differences, scaling, what an input cannot show, errors."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support.diagonal_robot import DEAD_ZONE, DRIVE, PERIOD, logged

from jaxident.array_types import State
from jaxident.errors import InputError
from jaxident.estimation.uncertainty.precision import cramer_rao
from jaxident.files.models import load_model
from jaxident.log import make_log
from jaxident.robot.drive import Physical
from jaxident.robot.model import Model, difference_vector
from jaxident.robot.noise import Noise
from jaxident.robot.simulate import run_physical

ROBOT = Model(PERIOD, DRIVE, DEAD_ZONE)
CAMERA = Noise(1e-3, 1e-2)


def test_bound_is_the_inverse_information_by_finite_differences():
    log = logged(0)

    @jax.jit
    def poses(values):
        model = Model(PERIOD, Physical(values[:2], values[2:6].reshape(2, 2)), values[6:8])
        state = run_physical(model, log.command, jnp.asarray(PERIOD), State(*values[8:]))
        return jnp.concatenate([state.x / 1e-3, state.y / 1e-3, state.theta / 1e-2])

    centre = np.concatenate([DRIVE.rate, np.ravel(DRIVE.gain), DEAD_ZONE, np.zeros(5)])
    columns = []
    for k, value in enumerate(centre):
        size = 1e-6 * max(abs(value), 1.0)
        ahead, behind = (jnp.asarray(centre + sign * size * (np.arange(13) == k)) for sign in (1.0, -1.0))
        columns.append((poses(ahead) - poses(behind)) / (2.0 * size))
    slope = np.stack(columns, axis=1)
    expected = np.sqrt(np.diag(np.linalg.inv(slope.T @ slope)))[:8]
    bound = cramer_rao(ROBOT, log, CAMERA)
    np.testing.assert_allclose(bound.standard_deviation[:8], expected, rtol=1e-4)
    assert bound.order[:2] == ("rate_1", "rate_2")


def test_difference_deviations_follow_from_the_physical_ones():
    bound = cramer_rao(ROBOT, logged(0), CAMERA)
    moved = DRIVE.rate * np.array([1.0 + 1e-6, 1.0])
    slope = (
        difference_vector(Model(PERIOD, DRIVE._replace(rate=moved), DEAD_ZONE).difference, DEAD_ZONE)
        - difference_vector(ROBOT.difference, DEAD_ZONE)
    ) / (DRIVE.rate[0] * 1e-6)
    expected = abs(float(slope[0])) * float(bound.standard_deviation[0])
    assert float(bound.difference_deviation[0]) == pytest.approx(expected, rel=1e-4)
    np.testing.assert_allclose(bound.difference_deviation[10:], bound.standard_deviation[6:8], rtol=1e-9)


def test_runs_add_up_and_noise_scales():
    log = logged(1)
    one = cramer_rao(ROBOT, log, CAMERA).standard_deviation
    np.testing.assert_allclose(cramer_rao(ROBOT, [log] * 4, CAMERA).standard_deviation, one / 2.0, rtol=1e-6)
    louder = cramer_rao(ROBOT, log, Noise(2e-3, 2e-2)).standard_deviation
    np.testing.assert_allclose(louder[:8], 2.0 * one[:8], rtol=1e-6)


def test_inputs_need_no_poses_and_slip_costs_precision():
    log = logged(1)
    blind = make_log(log.t, log.u_r, log.u_l)
    plain = cramer_rao(ROBOT, log, CAMERA).standard_deviation[:8]
    np.testing.assert_allclose(cramer_rao(ROBOT, blind, CAMERA).standard_deviation[:8], plain, rtol=1e-9)
    slipping = cramer_rao(ROBOT, blind, CAMERA._replace(slip_along=0.02, slip_heading=0.2))
    assert np.all(np.asarray(slipping.standard_deviation[:8]) > plain)


def test_one_level_shows_no_dead_zone_and_says_why():
    """Commands of one size determine gain times (u - D) alone."""
    sign = np.where(np.arange(300) % 40 < 20, 1.0, -1.0)
    other = np.where(np.arange(300) % 60 < 30, 1.0, -1.0)
    bound = cramer_rao(ROBOT, make_log(PERIOD * np.arange(300), sign, other), CAMERA)
    verdicts = {verdict.parameter: verdict for verdict in bound.verdicts}
    assert verdicts["dead_zone_r"].verdict == "not determined"
    assert "together with" in verdicts["dead_zone_r"].reason
    assert verdicts["rate_2"].verdict == "determined"


def test_wrong_models_are_named():
    with pytest.raises(InputError, match="physical"):
        cramer_rao(load_model("published-simplified"), logged(1), CAMERA)
    with pytest.raises(InputError, match="noise"):
        cramer_rao(ROBOT, logged(1), Noise())

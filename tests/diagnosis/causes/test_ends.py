"""Which end of a search is taken: the one with more log evidence, unless another surely foretells the poses better."""

import numpy as np
import pytest
from support.small_robot import nominal_fit, robot_with, windows_of

from jaxident.diagnosis.causes.ends import misses, preferred
from jaxident.diagnosis.fit.refit import refit
from jaxident.diagnosis.noise.law import first_law
from jaxident.diagnosis.preparation.prepare import BURN
from jaxident.effects.coordinates import PLACES

LAG = "motor_lag", "time_constant"


@pytest.fixture(scope="module")
def lagging():
    """Windows of a robot with a lag, and its fits without and with it."""
    windows = windows_of(robot_with({LAG: 0.1}))
    data, nominal = nominal_fit(windows)
    vector = nominal.vector.copy()
    vector[PLACES[LAG]] = 0.1
    return windows, nominal, refit(data, vector, nominal.starts, ("motor_lag",))


def slow_misses(fit, windows):
    """The same window by window: least squares for the start state, the mean of squares after it."""
    rows, count = windows.seen.shape
    law = first_law(windows)
    found = []
    for k in range(count):
        residual, slopes = fit.linear.residual[k].reshape(rows, 3), fit.linear.starts[k].reshape(rows, 3, 5)
        seen = np.asarray(windows.seen)[:, k]
        weight = np.array([1.0 / law.position, 1.0 / law.position, 1.0 / law.heading])
        early, late = seen & (np.arange(rows) < BURN), seen & (np.arange(rows) >= BURN)
        moved, *_ = np.linalg.lstsq(
            (slopes[early] * weight[:, None]).reshape(-1, 5), (residual[early] * weight).ravel(), rcond=None
        )
        left = (residual[late] - slopes[late] @ moved) * weight
        found.append(np.mean(left**2) if late.any() else np.nan)
    return np.array(found)


def test_what_a_fit_misses_is_what_least_squares_leave_window_by_window(lagging):
    windows, nominal, fit = lagging
    seen = np.array(windows.seen)
    seen[BURN + 3 :, 0] = seen[BURN:, 1] = False  # one window ends early, one shows nothing to foretell
    windows = windows._replace(seen=seen)
    for each in (nominal, fit):
        found, slow = misses(each, windows), slow_misses(each, windows)
        assert np.isnan(found[1])
        np.testing.assert_allclose(found, slow, rtol=1e-4)


def test_the_true_model_misses_what_camera_and_start_state_make(lagging):
    windows, nominal, fit = lagging
    assert 1.0 < np.mean(misses(fit, windows)) < 2.0 < np.mean(misses(nominal, windows))


def test_an_end_that_foretells_better_is_taken_in_spite_of_its_evidence(lagging):
    windows, nominal, fit = lagging
    missed = [misses(nominal, windows), misses(fit, windows)]
    assert preferred([100.0, 0.0], missed) == 1
    assert preferred([0.0, 100.0], missed) == 1


def test_evidence_decides_between_ends_that_foretell_about_equally():
    """In at most one of ten pairs by chance: 400 pairs, five standard errors."""
    rng, wrong = np.random.default_rng(0), 0
    for _ in range(400):
        missed = rng.chisquare(3, (2, 60))
        wrong += preferred([1.0, 0.0], list(missed))
    assert 0 < wrong < 400 * 0.05 + 5.0 * np.sqrt(400 * 0.05 * 0.95)


def test_an_end_that_runs_away_is_not_taken(lagging):
    windows, nominal, fit = lagging
    residual = np.array(nominal.linear.residual)
    residual[3] = np.nan
    wild = misses(nominal._replace(linear=nominal.linear._replace(residual=residual)), windows)
    assert np.isposinf(wild[3])
    fine = misses(fit, windows)
    assert preferred([9.0, 0.0], [wild, fine]) == 1
    assert preferred([0.0, 9.0], [wild, 10.0 * fine]) == 1
    assert preferred([9.0], [wild]) == 0

"""Which end of a search is taken: the one with more log evidence, unless another surely foretells the poses better."""

import numpy as np
import pytest
from support.small_robot import LAW, nominal_fit, robot_with, windows_of

from jaxident.diagnosis.causes.ends import misses, preferred
from jaxident.diagnosis.causes.settled import whiten
from jaxident.diagnosis.fit.refit import refit
from jaxident.diagnosis.motion.responses import respond
from jaxident.diagnosis.noise.law import Law, covariance, first_law
from jaxident.diagnosis.preparation.prepare import BURN
from jaxident.effects.coordinates import PLACES

LAG = "motor_lag", "time_constant"


@pytest.fixture(scope="module")
def lagging():
    """Data of a robot with a lag, and its fits without and with it."""
    data, nominal = nominal_fit(windows_of(robot_with({LAG: 0.1})))
    vector = nominal.vector.copy()
    vector[PLACES[LAG]] = 0.1
    return data, nominal, refit(data, vector, nominal.starts, ("motor_lag",))


def slow_misses(fit, windows, law):
    """The same window by window: generalised least squares for the start state, the mean of what is random later given
    what was random before, the mean of squares."""
    unit = np.array([first_law(windows).position] * 2 + [first_law(windows).heading])
    every = covariance(law, windows, respond(np.exp(fit.vector[:2]), fit.linear.residual, windows))
    found = []
    for k, (own, residual, slopes) in enumerate(zip(every, fit.linear.residual, fit.linear.starts, strict=True)):
        seen, row = np.repeat(np.asarray(windows.seen)[:, k], 3), np.repeat(np.arange(len(windows.seen)), 3)
        early, late = np.flatnonzero(seen & (row < BURN)), np.flatnonzero(seen & (row >= BURN))
        inverse = np.linalg.inv(own[np.ix_(early, early)])
        start = np.linalg.solve(slopes[early].T @ inverse @ slopes[early], slopes[early].T @ inverse @ residual[early])
        random = own[np.ix_(late, early)] @ inverse @ (residual[early] - slopes[early] @ start)
        missed = (residual[late] - slopes[late] @ start - random) / unit[late % 3]
        found.append(np.mean(missed**2) if len(late) else np.nan)
    return np.array(found)


@pytest.mark.parametrize("law", [LAW, Law(2e-4, 2e-3, (0.1, 0.5), 0.1)], ids=["white", "slip"])
def test_what_a_fit_misses_is_what_a_filter_cannot_foretell_window_by_window(lagging, law):
    data, *fits = lagging
    seen = np.array(data.windows.seen)
    seen[BURN + 3 :, 0] = seen[BURN:, 1] = False  # one window ends early, one shows nothing to foretell
    windows = data.windows._replace(seen=seen)
    for fit in fits:
        found = misses(whiten(fit, windows, law)[0], fit)
        assert np.isnan(found[1])
        np.testing.assert_allclose(found, slow_misses(fit, windows, law), rtol=1e-4)


def test_the_true_model_misses_what_camera_and_start_state_make(lagging):
    data, nominal, fit = lagging
    assert 1.0 < np.mean(misses(data, fit)) < 2.0 < np.mean(misses(data, nominal))


def test_an_end_that_foretells_better_is_taken_in_spite_of_its_evidence(lagging):
    data, nominal, fit = lagging
    missed = [misses(data, nominal), misses(data, fit)]
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
    data, nominal, fit = lagging
    residual = np.array(nominal.linear.residual)
    residual[3] = np.nan
    wild = misses(data, nominal._replace(linear=nominal.linear._replace(residual=residual)))
    assert np.isposinf(wild[3])
    fine = misses(data, fit)
    assert preferred([9.0, 0.0], [wild, fine]) == 1
    assert preferred([0.0, 9.0], [wild, 10.0 * fine]) == 1
    assert preferred([9.0], [wild]) == 0

"""The priors of the nominal robot: its two wheels are alike, and where windows say that it coasts, it answers."""

import numpy as np
import pytest
from support.small_robot import VECTOR, nominal_fit, windows_of

from jaxident.diagnosis.fit.prior import SPREAD, departures, unlikeliness, with_prior
from jaxident.diagnosis.fit.refit import refit
from jaxident.effects.coordinates import NOMINAL

WINDOWS = windows_of(VECTOR)
HELD = WINDOWS._replace(held=np.array([np.log(3.0), np.nan, 0.0, 0.1]))
GAINS = slice(NOMINAL.index("gain_11"), NOMINAL.index("gain_22") + 1)


def robot(gains):
    vector = np.array(VECTOR)
    vector[GAINS] = gains
    return vector


def test_equal_wheels_are_likeliest_whatever_their_strength():
    for strength in (0.01, 1.0, 300.0):
        assert unlikeliness(robot([strength, strength, 7.0 * strength, -7.0 * strength]), WINDOWS) == pytest.approx(0.0)
    assert unlikeliness(robot([1.2, 1.0, 5.0, -5.0]), WINDOWS) == pytest.approx(
        0.5 * (np.arctan(0.2 / 2.2) / SPREAD) ** 2
    )
    for turned in ([-1.0, -1.0, 5.0, -5.0], [1.0, 1.0, -5.0, 5.0], [-1.0, -1.0, -5.0, 5.0]):
        assert unlikeliness(robot(turned), WINDOWS) == pytest.approx(0.0, abs=1e-12), "commands or axes the other way"
    assert unlikeliness(robot([2.2, -0.9, 5.0, -5.0]), WINDOWS) > 50.0, "one wheel drives backwards"


@pytest.mark.parametrize("windows", [WINDOWS, HELD], ids=["free", "held"])
def test_derivatives_are_those_of_the_departures(windows):
    vector = robot([1.3, 0.8, 5.0, -6.0])
    away, slopes = departures(vector, windows)
    for place in range(len(NOMINAL)):
        moved = np.array(vector)
        moved[place] += 1e-6
        np.testing.assert_allclose((departures(moved, windows)[0] - away) / 1e-6, slopes[:, place], atol=1e-4)


def test_products_have_what_the_prior_adds_to_half_the_squares():
    vector = robot([1.3, 0.8, 5.0, -6.0])
    found = with_prior(np.zeros((len(NOMINAL) + 3, len(NOMINAL) + 3)), vector, WINDOWS)
    assert 0.5 * found[-1, -1] == pytest.approx(unlikeliness(vector, WINDOWS))
    assert np.all(found[len(NOMINAL) : -1] == 0.0)


def test_a_log_that_tells_the_wheels_apart_overrules_it():
    """Wheels that differ by a tenth, from an informative log: the gains are found within 2 per cent."""
    gains = np.array(VECTOR[GAINS]) * [1.1, 1.0, 1.1, 1.0]
    data, nominal = nominal_fit(windows_of(robot(gains)))
    fit = refit(data, nominal.vector, nominal.starts, ())
    rates = np.exp([fit.vector[0], VECTOR[0]])
    np.testing.assert_allclose(fit.vector[GAINS] / rates[0], gains / rates[1], rtol=2e-2)
    alike = departures(fit.vector, WINDOWS)[0][:2] / departures(robot(gains), WINDOWS)[0][:2]
    np.testing.assert_allclose(alike, 1.0, atol=0.1)

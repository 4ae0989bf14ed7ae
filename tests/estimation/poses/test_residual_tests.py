"""Tests of residuals: silent on white ones, loud on each departure, and equal to slow loops."""

import numpy as np
import pytest

from jaxident.array_types import Pose, Wheels
from jaxident.estimation.poses.residual_tests import (
    LAGS,
    WHITE_CHANNEL,
    correlations,
    fit_percent,
    residual_tests,
    whiteness,
)
from jaxident.log import make_log

RUNS, ROWS = 3, 500


def white(seed):
    rng = np.random.default_rng(seed)
    seen = rng.uniform(size=(RUNS, ROWS)) < 0.9
    command = Wheels(*np.repeat(rng.uniform(-1.0, 1.0, (2, RUNS, ROWS // 10)), 10, axis=2))
    return rng.normal(size=(RUNS, 3, ROWS)) * seen[:, None], seen, command


def test_correlations_are_those_of_a_loop():
    normalised, seen, _ = white(0)
    found = correlations(normalised, seen, (1, 7))
    for k in range(3):
        value = normalised[:, k]
        power = np.mean(value[seen] ** 2)
        for column, lag in enumerate((1, 7)):
            pairs = [
                value[r, i] * value[r, i - lag]
                for r in range(RUNS)
                for i in range(lag, ROWS)
                if seen[r, i] and seen[r, i - lag]
            ]
            assert found[k, column] == pytest.approx(np.mean(pairs) / power, rel=1e-12)


def test_white_residuals_pass():
    """9 tests of at most 1 in 100 on 40 sets: 3.6 failures expected at most; 10 are more than three deviations off."""
    failed = sum(not one.passed for seed in range(40) for one in residual_tests(*white(seed)))
    assert failed < 10


@pytest.mark.parametrize(
    ("spoil", "question"),
    [
        (lambda z, seen, u: z + np.roll(z, 1, axis=2), "white"),
        (lambda z, seen, u: z + 0.3 * u.left[:, None] * seen[:, None], "unrelated"),
        (lambda z, seen, u: np.where(np.arange(ROWS) % 100 == 7, 6.0, z) * seen[:, None], "share"),
    ],
)
def test_each_departure_is_found(spoil, question):
    normalised, seen, command = white(1)
    tests = residual_tests(spoil(normalised, seen, command), seen, command)
    assert not any(one.passed for one in tests if one.question.startswith(question))


def test_fit_percent_by_hand():
    """Two runs with means of their own; the heading wraps; a row without a pose counts nowhere."""
    x = np.array([0.0, 2.0, np.nan, 10.0, 12.0])
    theta = np.array([3.0, -3.0, np.nan, 0.0, 1.0])
    log = make_log(np.arange(5.0), *np.ones((2, 5)), x, x, theta, run=np.array([0, 0, 0, 1, 1]))
    residual = np.array([0.5, -0.5, np.nan, 0.5, 0.5])
    turn = (2 * np.pi - 6.0) ** 2 / 2 + 0.5
    expected = 100.0 * (1.0 - np.sqrt([0.25, 0.25, 1.0 / turn]))
    np.testing.assert_allclose(fit_percent(log, Pose(residual, residual, residual)), expected)


def test_white_residuals_are_white_whatever_rows_miss():
    """400 logs, three rows of four missing at random: chi-squared with a degree of freedom per lag has mean 5 and
    exceeds its limit in 1 of 100. A sum that counts rows where it should count pairs of rows has mean 20."""
    found = []
    for seed in range(400):
        normalised, seen = (
            np.random.default_rng(seed).normal(size=(2, 3, 400)),
            np.random.default_rng(seed).random((2, 400)) < 0.25,
        )
        found.append(whiteness(normalised * seen[:, None], seen))
    assert np.mean(found) == pytest.approx(len(LAGS), abs=0.4)
    assert np.mean(np.array(found) > WHITE_CHANNEL) < 0.025

"""Statistics against plain NumPy, trial by trial, and their standard errors against many repetitions."""

import numpy as np
import pytest
from support.studies import SMALL

from jaxident.study.dataset import coordinates
from jaxident.study.statistics import INTERVAL, LEVELS, error_statistics, quantiles, summarise

SHAPE = (*SMALL.shape, 1, 12)


@pytest.fixture
def trials():
    """Random trials of the small study's shape, one failed, one without an interval."""
    rng = np.random.default_rng(0)
    truth = np.broadcast_to(np.linspace(1.0, 2.0, 12), (*SMALL.shape, 12))
    level = np.array(SMALL.noise)[:, None, None, None] * 1e3
    estimate = truth[..., None, :] * (1.0 + level * rng.normal(size=SHAPE))
    deviation = np.abs(rng.normal(size=SHAPE)) * level
    reason = np.zeros(SHAPE[:-1], np.int8)
    estimate[0, 0, 0, 0, 0, 1, 2] = deviation[0, 0, 0, 0, 0, 1, 2] = np.nan
    reason[0, 0, 0, 0, 0, 1, 2] = 2
    deviation[0, 0, 0, 0, 0, 0, 3] = np.nan
    axes = ("excitation", "samples", "robot", "period", "amplitude", "noise", "seed")
    return coordinates(SMALL).assign(
        estimate=((*axes, "estimator", "parameter"), estimate),
        deviation=((*axes, "estimator", "parameter"), deviation),
        truth=((*axes, "parameter"), truth),
        reason=((*axes, "estimator"), reason),
    )


def test_statistics_are_those_of_numpy(trials):
    summary = summarise(trials).squeeze()
    error = (trials["estimate"] - trials["truth"]).transpose(*trials["estimate"].dims).values.reshape(2, 6, 12)
    deviation = trials["deviation"].values.reshape(2, 6, 12)
    for level, parameter in np.ndindex(2, 12):
        kept = [e for e in error[level, :, parameter] if np.isfinite(e)]
        at = summary.isel(noise=level, parameter=parameter)
        squares = np.square(kept)
        inside = [
            abs(e) <= INTERVAL * d
            for e, d in zip(error[level, :, parameter], deviation[level, :, parameter], strict=True)
            if np.isfinite(e) and np.isfinite(d)
        ]
        expected = {
            "trials": len(kept),
            "bias": np.mean(kept),
            "bias_se": np.std(kept, ddof=1) / np.sqrt(len(kept)),
            "sd": np.std(kept, ddof=1),
            "rmse": np.sqrt(np.mean(squares)),
            "rmse_se": np.std(squares, ddof=1) / np.sqrt(len(kept)) / 2.0 / np.sqrt(np.mean(squares)),
            "coverage": np.mean(inside),
            "coverage_se": np.sqrt(np.mean(inside) * (1 - np.mean(inside)) / len(inside)),
            "truth": trials["truth"].values.ravel()[parameter],
        }
        for name, value in expected.items():
            np.testing.assert_allclose(float(at[name]), value, rtol=1e-12, err_msg=name)
        np.testing.assert_allclose(at["quantiles"], np.quantile(kept, LEVELS), rtol=1e-12)


def test_failures_are_counted_by_reason(trials):
    failures = summarise(trials)["failures"].squeeze()
    assert int(failures.sum()) == 1
    assert int(failures.sel(reason="no start values", noise=SMALL.noise[1])) == 1


def test_standard_errors_are_the_spread_over_repetitions():
    """5000 repetitions of 400 trials: the typical standard error meets the spread, known to 1 %, within 4 %."""
    rng = np.random.default_rng(1)
    estimate = 0.5 + rng.normal(size=(5000, 400, 1))
    found = error_statistics(estimate, np.ones_like(estimate), np.zeros_like(estimate))
    for name in ("bias", "sd", "rmse", "coverage"):
        spread = np.std(getattr(found, name))
        typical = np.sqrt(np.mean(getattr(found, f"{name}_se") ** 2))
        np.testing.assert_allclose(typical, spread, rtol=0.04, err_msg=name)


def test_quantiles_without_values_are_nan():
    assert np.all(np.isnan(quantiles(np.full((3, 2), np.nan), (0.5,))))
    np.testing.assert_allclose(quantiles(np.array([[1.0], [np.nan], [3.0]]), (0.0, 0.5, 1.0)), [[1.0, 2.0, 3.0]])


def test_breakdown_is_the_lowest_level_that_breaks(trials):
    assert float(summarise(trials)["breakdown"].squeeze()) == SMALL.noise[1]  # a tenth of error, and a sixth failed
    fine = trials.isel(noise=[0])
    assert np.isnan(summarise(fine)["breakdown"].squeeze())


def test_error_over_bound(trials):
    plain = summarise(trials)
    bounded = summarise(trials, bound=2.0 * plain["rmse"].isel(estimator=0))
    np.testing.assert_allclose(bounded["rmse_over_bound"], 0.5)


def test_a_study_read_in_small_parts_sums_up_alike(trials, monkeypatch):
    whole = summarise(trials)
    monkeypatch.setattr("jaxident.study.statistics.NUMBERS", 7)
    np.testing.assert_array_equal(summarise(trials)["quantiles"], whole["quantiles"])

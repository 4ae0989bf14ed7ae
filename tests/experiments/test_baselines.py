"""Baselines on short cases, and effects injected into logs."""

import numpy as np
import pytest
from support.withheld_cases import model_of
from withheld import inject
from withheld.baselines import methods as baselines
from withheld.baselines.refit import refit_errors
from withheld.baselines.regression import regression
from withheld.protocol import cases

from jaxident.log import make_log

ROWS = 301


NAMES = ([], ["slope"], ["lateral_slip"])


@pytest.fixture(scope="module")
def drawn():
    """The same robot with nothing hidden, and with either effect, each with two runs of one batch."""
    drawn = [cases.describe(2, "single" if names else "none", names, slip=False, sim=None) for names in NAMES]
    plans = [run for case in drawn for run in cases.plan(case)[:2]]
    logs = cases.simulate_runs([run | {key: run[key][:ROWS] for key in ("u", "slip")} for run in plans])
    runs = [make_log(*log.T) for log in logs]
    return [(case, runs[2 * k : 2 * k + 2]) for k, case in enumerate(drawn)]


@pytest.mark.parametrize("names", NAMES, ids="+".join)
def test_simple_ways_find_plain_effects(names, drawn):
    case, runs = drawn[NAMES.index(names)]
    given = regression(model_of(case, effects=False), runs)
    assert baselines.correlation(given)["selected"] == names
    assert baselines.sparse(given)["selected"][:1] == names
    assert baselines.commonest(given)["selected"] == [baselines.COMMONEST]


@pytest.mark.slow
def test_full_refits_predict_runs_kept_apart_best_with_what_is_there(drawn):
    """With it they miss by little more than the camera's variance, which the filtered start adds to; without, by many
    times that."""
    _, runs = drawn[NAMES.index(["lateral_slip"])]
    errors = refit_errors(runs)
    assert baselines.smallest(errors)["selected"] == ["lateral_slip"]
    assert errors["lateral_slip"] < 3.0 < 0.2 * errors[""]


@pytest.fixture
def log():
    rng, rows = np.random.default_rng(0), 200
    x, y, theta = rng.normal(size=(3, rows)).cumsum(axis=1) * 0.01
    x[::7] = y[::7] = theta[::7] = np.nan
    return make_log(0.05 * np.arange(rows), np.ones(rows), np.ones(rows), x, y, theta)


def test_injected_latency_is_a_shift(log):
    late = inject.inject(log, "transport_delay", {"delay": 0.15}, None)
    assert np.array_equal(late.x[3:], log.x[:-3], equal_nan=True)
    assert np.all(np.isnan(late.x[:3]))
    assert np.array_equal(late.u_r, log.u_r)


def test_injected_marker_turns_with_the_robot(log):
    moved = inject.inject(log, "marker_offset", {"ahead": 0.3, "left": 0.4}, None)
    seen = np.isfinite(log.x)
    assert np.allclose(np.hypot(moved.x - log.x, moved.y - log.y)[seen], 0.5)
    assert np.array_equal(np.isfinite(moved.x), seen)


def test_injected_frames_repeat_the_one_before(log):
    late = inject.inject(log, "frozen_frames", {"probability": 0.5}, np.random.default_rng(1))
    seen = np.flatnonzero(np.isfinite(log.x))
    repeated = late.x[seen][1:] == late.x[seen][:-1]
    assert 0.3 < repeated.mean() < 0.7
    assert np.array_equal(late.x[seen][1:][~repeated], log.x[seen][1:][~repeated])


def test_injected_outliers_are_rare(log):
    hit = inject.inject(
        log, "outliers", {"probability": 0.1, "position": 1.0, "heading": 0.1}, np.random.default_rng(1)
    )
    moved = np.abs(hit.x - log.x)[np.isfinite(log.x)] > 1e-9
    assert 0.02 < moved.mean() < 0.2

"""Free-run prediction: exact where model and data are, blind to the future, and honest about its start."""

import dataclasses
import warnings

import jax
import numpy as np
import pytest
from support.records import without_poses

from jaxident.effects.simulate import simulate as simulate_with_effects
from jaxident.errors import InputError
from jaxident.estimation.ahead.session_check import new_session
from jaxident.estimation.poses.parameters import NAMES
from jaxident.estimation.predict import predict, prediction_error
from jaxident.files.models import load_model
from jaxident.log import Log, join
from jaxident.robot.model import Effect, Provenance
from jaxident.robot.noise import Noise
from jaxident.robot.simulate import simulate
from jaxident.study.synthetic import excite

ROBOT = load_model("published")
ROWS = 200
CAMERA = np.array([1e-3, 1e-3, 1e-2])


def made(seed=0, rows=ROWS, noise=None):
    robot = dataclasses.replace(ROBOT, noise=noise)
    key = None if noise is None else jax.random.key(seed)
    log = simulate(robot, excite(jax.random.key(1), "staircase", rows, ROBOT.sample_period, hold=5), key=key)
    return Log(*(np.asarray(column) for column in log))


@pytest.fixture(scope="module")
def log():
    return made()


def test_the_true_model_predicts_exact_data_exactly(log):
    """To 3 um and 3 urad: the filter weighs what its linearisation leaves out, and integrates positions by Simpson's
    rule."""
    found = predict(ROBOT, log, 30)
    rows = (found.start + found.step).astype(int)
    np.testing.assert_allclose(found.x, log.x[rows], atol=3e-6)
    np.testing.assert_allclose(found.y, log.y[rows], atol=3e-6)
    np.testing.assert_allclose(np.angle(np.exp(1j * (found.theta - log.theta[rows]))), 0.0, atol=3e-6)
    np.testing.assert_allclose(found.t, log.t[rows])
    assert prediction_error(found, log)["position_median"] < 1e-6


def test_effects_are_predicted():
    """A delay that remembers, a lag, a marker off the axle and a gain that drifts from run to run: exact data are
    predicted by the model with them, and missed without. The full simulator integrates with eight times the substeps:
    hence 0.1 mm."""
    effects = (
        Effect("transport_delay", {"delay": 0.07}),
        Effect("motor_lag", {"time_constant": 0.05}),
        Effect("marker_offset", {"ahead": 0.02, "left": 0.01}),
        Effect("gain_drift", {"rate": 0.02}),
    )
    robot = dataclasses.replace(ROBOT, effects=effects)
    plain = excite(jax.random.key(1), "multilevel", ROWS, ROBOT.sample_period, hold=10)
    duration = float(plain.t[-1] - plain.t[0])
    runs = [simulate_with_effects(robot, plain, session_time=k * duration) for k in range(2)]
    log = join([Log(*(np.asarray(column) for column in run)) for run in runs])
    found = predict(robot, log, 30)
    assert prediction_error(found, log)["position_rms"] < 2e-4
    assert prediction_error(predict(ROBOT, log, 30), log)["position_rms"] > 2e-3
    np.testing.assert_array_equal(np.unique(found.run), [0, 1])


def test_rows_are_those_of_the_contract(log):
    found = predict(ROBOT, log, 40, burn_in=25, stride=60)
    starts, counts = np.unique(found.start, return_counts=True)
    np.testing.assert_array_equal(starts, [25, 85, 145])
    np.testing.assert_array_equal(counts, 40)
    late = predict(ROBOT, log, 40, burn_in=25, stride=145)
    np.testing.assert_array_equal(np.unique(late.start, return_counts=True)[1], [40, 29])


def test_no_row_after_the_start_is_used(log):
    other = log._replace(x=np.where(np.arange(ROWS) > 20, 7.0, log.x))
    one, same = (predict(ROBOT, each, 50, burn_in=20, stride=ROWS) for each in (log, other))
    np.testing.assert_array_equal(one.x, same.x)


def test_short_runs_with_missing_poses():
    whole = made(rows=160)
    runs = [whole.rows(k, k + 40) for k in range(0, 160, 40)]
    log = join([without_poses(run, np.arange(40) % 3 == 1) for run in runs])
    found = predict(ROBOT, log, 19)
    assert len(np.unique(found.run)) == 4
    for k, run in enumerate(runs):
        own = found.run == np.unique(found.run)[k]
        np.testing.assert_allclose(found.x[own], run.x[21:40], atol=3e-6)


def test_deviations_are_the_spread_over_seeds():
    """120 seeds: the standard error of a standard deviation is 6.5 %; the bound is four of them."""
    noise = Noise(1e-3, 1e-2)
    robot = dataclasses.replace(ROBOT, noise=noise)
    runs = [predict(robot, made(seed, 60, noise), 30, burn_in=20, stride=60) for seed in range(120)]
    for value, deviation in (("x", "sd_x"), ("y", "sd_y"), ("theta", "sd_theta")):
        ends = np.array([getattr(run, value)[-1] for run in runs])
        told = np.median([getattr(run, deviation)[-1] for run in runs])
        assert np.std(ends, ddof=1) == pytest.approx(told, rel=0.26)


@pytest.mark.slow
@pytest.mark.parametrize("noise", [Noise(1e-3, 1e-2, 0.1), Noise(1e-3, 1e-2, None, 0.01, 0.2)])
def test_bands_cover_under_slip_and_uncertain_parameters(noise):
    """200 runs, each predicted by a model of its own whose parameters are 1 % off: 95 % bands of three channels cover
    the true pose within four standard errors, 4 * sqrt(0.05 * 0.95 / 200) of each channel."""
    rng, hits = np.random.default_rng(0), []
    truth = np.concatenate([np.ravel(part) for part in (ROBOT.physical.rate, ROBOT.physical.gain, ROBOT.dead_zone)])
    for seed in range(200):
        values = truth * (1.0 + 0.01 * rng.normal(size=8))
        drive = ROBOT.physical._replace(rate=values[:2], gain=values[2:6].reshape(2, 2))
        model = dataclasses.replace(
            ROBOT, dynamics=drive, dead_zone=values[6:], noise=noise,
            covariance=np.diag((0.01 * truth) ** 2), parameter_order=NAMES[:8],
        )  # fmt: skip
        log = made(seed, 61, noise)
        found = predict(model, log, 30, burn_in=30, stride=60)
        deviations = np.sqrt(np.array([found.sd_x, found.sd_y, found.sd_theta])[:, -1] ** 2 + CAMERA**2)
        missed = np.array([found.x, found.y, found.theta])[:, -1] - np.array([log.x, log.y, log.theta])[:, -1]
        hits.append(np.abs(missed) < 1.96 * deviations)
    np.testing.assert_allclose(np.mean(hits, axis=0), 0.95, atol=0.062)


def test_what_cannot_be_predicted_says_why(log):
    for settings, words in (
        ({"horizon": 0}, "horizon 0"),
        ({"horizon": 5, "stride": 0}, "stride 0"),
        ({"horizon": 5, "burn_in": 0}, "burn-in 0"),
        ({"horizon": 5, "burn_in": 300}, "burn-in of 300 rows"),
    ):
        with pytest.raises(InputError, match=words):
            predict(ROBOT, log, **settings)
    delayed = dataclasses.replace(ROBOT, effects=(Effect("transport_delay", {"delay": -0.05}),))
    with pytest.raises(InputError, match="transport_delay"):
        predict(delayed, log, 5)


@pytest.mark.parametrize("began", [0.0, 60.0])
def test_a_log_whose_poses_begin_a_session_is_told(began):
    """The model's logs took 60 s. A log of a later session is told of, with the option; one that goes on is not."""
    model = dataclasses.replace(
        ROBOT, effects=(Effect("gain_drift", {"rate": -0.005}),), provenance=Provenance(duration=60.0)
    )
    plain = excite(jax.random.key(3), "multilevel", 600, ROBOT.sample_period, hold=10)
    log = Log(*(np.asarray(c) for c in simulate_with_effects(model, plain, session_time=began)))
    line = new_session(model, log, 30, 20, 60.0)
    assert (line is None) == (began == 60.0)
    assert line is None or "--session-time 0 " in line
    assert new_session(dataclasses.replace(model, effects=()), log, 30, 20, 60.0) is None
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        predict(model, log, 30)
        predict(model, log, 30, session_time=60.0)
    assert len(told) == (began == 0.0)


@pytest.mark.slow
def test_logs_that_go_on_are_not_told_of_and_those_that_begin_a_session_are():
    """Of 20 noisy logs of 10 s each; one false line is expected in some thousands."""
    effects, noise = (Effect("gain_drift", {"rate": 0.004, "growth": -0.03}),), Noise(5e-4, 5e-3)
    model = dataclasses.replace(ROBOT, effects=effects, noise=noise, provenance=Provenance(duration=70.0))
    told = {0.0: 0, 70.0: 0}
    for key in jax.random.split(jax.random.key(5), 20):
        plain = excite(key, "multilevel", 300, ROBOT.sample_period, hold=10)
        for began in told:
            made = simulate_with_effects(model, plain, key=key, session_time=began)
            log = Log(*(None if column is None else np.asarray(column) for column in made))
            told[began] += new_session(model, log, 30, 20, 70.0) is not None
    assert told[70.0] == 0
    assert told[0.0] >= 19

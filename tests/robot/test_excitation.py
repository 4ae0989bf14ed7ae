"""Properties of every input signal, and of each by name."""

import jax
import numpy as np
import pytest

from jaxident.robot.excitation import EXCITATIONS, chirp, multilevel, multisine, prbs, staircase

KEY = jax.random.key(3)
SAMPLES, AMPLITUDE, HOLD = 960, 1.5, 20


@pytest.mark.parametrize("name", EXCITATIONS)
def test_every_signal(name):
    """Shape, bounds, the same key the same signal, another key another, and two wheels that do not move in step."""
    program = jax.jit(jax.vmap(lambda key: EXCITATIONS[name](key, SAMPLES, AMPLITUDE, HOLD)))
    keys = jax.random.split(KEY, 10)
    signals, again = np.stack(program(keys)), np.stack(program(keys))
    assert signals.shape == (2, 10, SAMPLES)
    sizes = np.max(np.abs(signals), axis=2)
    assert np.all((sizes > 0.7 * AMPLITUDE) & (sizes <= AMPLITUDE))
    np.testing.assert_array_equal(signals, again)
    assert np.all(np.any(signals[:, 1:] != signals[:, :1], axis=(0, 2)))
    for right, left in zip(*signals, strict=True):
        assert abs(np.corrcoef(right, left)[0, 1]) < 0.7


@pytest.mark.parametrize("name", EXCITATIONS)
@pytest.mark.parametrize("samples", [1, 61])
def test_any_length(name, samples):
    signal = jax.jit(lambda key: EXCITATIONS[name](key, samples))(KEY)
    assert signal.right.shape == signal.left.shape == (samples,)
    assert np.all(np.isfinite(np.stack(signal)))


@pytest.mark.parametrize("excite", [staircase, multilevel, prbs])
def test_levels_are_held(excite):
    for wheel in excite(KEY, SAMPLES, AMPLITUDE, HOLD):
        held = np.asarray(wheel).reshape(-1, HOLD)
        assert np.all(held == held[:, :1])


def test_staircase_dwells_about_the_dead_zone():
    for wheel in staircase(KEY, SAMPLES, AMPLITUDE, HOLD):
        size = np.abs(wheel) / AMPLITUDE
        assert np.mean(size <= 0.2 + 1e-12) >= 0.3
        assert np.mean(size > 0.25) >= 0.3
        assert np.min(wheel) == -np.max(wheel)


def test_multilevel_is_uniform():
    """Mean and variance of 4000 levels within four standard errors: 1 / sqrt(3 n) and sqrt(4 / 45 n)."""
    for wheel in multilevel(KEY, 4000, 1.0, 1):
        assert abs(np.mean(wheel)) < 4 / np.sqrt(3 * 4000)
        assert abs(np.var(wheel) - 1 / 3) < 4 * np.sqrt(4 / 45 / 4000)


def test_prbs_has_two_levels():
    for wheel in prbs(KEY, SAMPLES, AMPLITUDE, HOLD):
        np.testing.assert_array_equal(np.unique(wheel), [-AMPLITUDE, AMPLITUDE])


def test_multisine_has_odd_harmonics_of_one_size():
    harmonics = np.arange(1, SAMPLES // (2 * HOLD), 2)
    for wheel in multisine(KEY, SAMPLES, AMPLITUDE, HOLD):
        spectrum = np.abs(np.fft.rfft(wheel))
        others = np.delete(spectrum, harmonics)
        np.testing.assert_allclose(spectrum[harmonics], spectrum[1], rtol=1e-10)
        assert np.max(others) < 1e-10 * spectrum[1]
        assert np.max(np.abs(wheel)) == pytest.approx(AMPLITUDE, rel=1e-14)


def test_chirp_speeds_up():
    """Zero crossings: two per period, from one period per run to one period per 2 hold samples."""
    for wheel in chirp(KEY, SAMPLES, AMPLITUDE, HOLD):
        crossings = np.flatnonzero(np.diff(np.sign(wheel)) != 0)
        assert len(crossings) == pytest.approx(SAMPLES / (2 * HOLD) + 1, abs=1.0)
        assert crossings[-1] - crossings[-2] == pytest.approx(HOLD, abs=2)
        assert crossings[1] - crossings[0] > 4 * HOLD

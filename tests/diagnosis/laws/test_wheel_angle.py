"""What comes once per turn of a wheel: whether it is found, and how much is found by chance."""

from typing import Any, NamedTuple

import numpy as np
import pytest
from jax.scipy.special import gammaincc

from jaxident.diagnosis.discovery.curves import precision
from jaxident.diagnosis.fit.refit import Data, Solution
from jaxident.diagnosis.laws import wheel_angle
from jaxident.diagnosis.laws.candidates import Path
from jaxident.diagnosis.laws.wheel_angle import (
    _exceeded,
    _explained,
    _powers,
    _Seen,
    _steps,
    _strongest,
    _waves,
    parts_of,
    turnings,
)
from jaxident.diagnosis.motion.linear import Linear
from jaxident.diagnosis.motion.responses import Responses

RUNS, WINDOWS, ROWS, STEP = 3, 12, 30, 0.05
PERIOD, HALF = 0.19, 0.075


class Stub(NamedTuple):
    """What the search asks of windows."""

    run: Any
    session: Any


def seen_by(rng, size: float) -> _Seen:
    """Noise of unit variance and a pattern of some size of the right wheel, along random ways of three runs."""
    speed = np.repeat(rng.normal(0.0, 0.25, RUNS * WINDOWS * 3), ROWS // 3).reshape(RUNS, -1)
    spin = np.repeat(rng.normal(0.0, 1.5, RUNS * WINDOWS * 3), ROWS // 3).reshape(RUNS, -1)
    way, turn = (np.cumsum(STEP * part, axis=1).reshape(RUNS * WINDOWS, ROWS) for part in (speed, spin))
    run = np.repeat(np.arange(RUNS), WINDOWS)
    phase = rng.uniform(0.0, 2.0 * np.pi, RUNS)
    angle = 2.0 * np.pi * (way + HALF * turn) / PERIOD + phase[run][:, None]
    asked = rng.normal(size=way.shape) + size * np.cos(angle)
    gone, turned = way[:, 0], turn[:, 0]
    own = [np.flatnonzero(run == k) for k in range(RUNS)]
    unit = np.broadcast_to(np.eye(ROWS), (len(run), ROWS, ROWS))
    return _Seen(unit[None], asked[None], way - gone[:, None], turn - turned[:, None], gone, turned, own)


def path() -> Path:
    return Path({}, {}, None, None, None, None, None, np.full((1, 1), STEP))


@pytest.mark.parametrize("seed", range(3))
def test_a_pattern_in_noise_is_found_with_its_period_and_its_place(seed):
    (found,) = _strongest(seen_by(np.random.default_rng(seed), 0.7), path(), 1.3 * HALF, 1.0)
    assert abs(found.period - PERIOD) < 0.02 * PERIOD
    assert abs(found.half_track - HALF) < 0.1 * HALF
    assert found.power > found.by_chance


def test_what_a_pattern_explains_is_what_a_plain_fit_explains():
    seen = seen_by(np.random.default_rng(9), 0.7)
    k, q = np.array([30.0, 33.0]), np.array([2.4, 2.6])
    gain, phase = _explained(seen, 0, k, q)
    for n in range(2):
        angle = k[n] * (seen.gone[:, None] + seen.way) + q[n] * (seen.turned[:, None] + seen.turn)
        total = 0.0
        for run, own in enumerate(seen.parts):
            columns = np.stack([np.cos(angle[own]).ravel(), np.sin(angle[own]).ravel()], axis=1)
            (a, b), *_ = np.linalg.lstsq(columns, seen.asked[0, own].ravel())
            total += 0.5 * np.sum((columns @ [a, b]) ** 2)
            best = np.cos(angle[own] + phase[run, n]).ravel()
            assert np.allclose(columns @ [a, b], np.hypot(a, b) * best, atol=1e-4)
        assert gain[n] == pytest.approx(total, rel=1e-4)


def test_kinds_that_are_searched_together_are_found_as_each_by_itself():
    one, other = (seen_by(np.random.default_rng(seed), 0.7) for seed in (3, 3))
    rng = np.random.default_rng(12)
    other = other._replace(asked=other.asked + rng.normal(size=other.asked.shape), products=2.0 * other.products)
    both = one._replace(**{key: np.concatenate([getattr(one, key), getattr(other, key)])
                           for key in ("products", "asked")})  # fmt: skip
    alone = [_strongest(each, path(), 1.3 * HALF, 1.0)[0] for each in (one, other)]
    for found, expected in zip(_strongest(both, path(), 1.3 * HALF, 1.0), alone, strict=True):
        assert found.period == pytest.approx(expected.period)
        assert found.half_track == pytest.approx(expected.half_track)
        np.testing.assert_allclose(np.exp(1j * found.phase), np.exp(1j * expected.phase), atol=1e-9)
    assert alone[0].power != alone[1].power


@pytest.mark.parametrize("count", [1, 7, 400])
def test_sums_of_exponential_variables_have_the_gamma_distribution(count):
    sums = np.linspace(0.1, 40.0 + 4.0 * count, 200)
    np.testing.assert_allclose(_exceeded(sums, count), gammaincc(count, sums), rtol=1e-9, atol=1e-300)


def test_noise_alone_hardly_brings_more_than_it_may_by_chance():
    seen = [seen_by(np.random.default_rng(100 + seed), 0.0) for seed in range(20)]
    found = [_strongest(each, path(), 1.3 * HALF, 1.0)[0] for each in seen]
    over = np.array([each.power - each.by_chance for each in found])
    assert np.sum(over > 0.0) <= 4
    assert over.max() < 5.0
    # nor is the price far too high: the patterns that are tried are not all independent
    assert np.median(over) > -8.0


def test_the_power_of_patterns_is_what_a_plain_sum_says():
    seen = seen_by(np.random.default_rng(5), 0.5)
    k, q, more_k, more_q = 31.0, np.array([2.0, 2.4]), np.array([-0.2, 0.1]), np.array([0.0, 0.05, 0.1])
    waves = _waves(seen.turn, q) * _waves(seen.turned, q)[:, None]
    (found,) = _powers(seen, k, waves, _waves(seen.gone, more_k), _waves(seen.turned, more_q))
    for i, j, m in np.ndindex(found.shape):
        angle = k * (seen.gone[:, None] + seen.way) + q[j] * (seen.turned[:, None] + seen.turn)
        each = np.sum(seen.asked[0] * np.exp(1j * angle), axis=1)
        moved = each * np.exp(1j * (more_k[i] * seen.gone + more_q[m] * seen.turned))
        plain = sum(abs(moved[own].sum()) ** 2 / np.sum(np.abs(each[own]) ** 2) for own in seen.parts)
        assert abs(found[i, j, m] - plain) < 1e-4 * plain


def test_steps_tell_patterns_apart_at_the_end_of_a_run():
    seen = seen_by(np.random.default_rng(6), 0.0)
    step, more = _steps(seen, seen.way, seen.gone)
    rates = np.sort(np.add.outer(step * np.arange(5), more).ravel())
    wide = max(np.ptp(seen.gone[own]) for own in seen.parts)
    np.testing.assert_allclose(np.diff(rates), np.diff(rates)[0])
    assert np.diff(rates)[0] * wide <= wheel_angle.APART


def test_a_closed_curve_ends_where_it_begins():
    at = np.linspace(-np.pi, np.pi, 10)
    rows = np.array([0.5, *np.ones(8), 0.5])  # half as many lie nearest to each end
    stiff = precision((at,), rows[:, None], closed=True)
    for shape, free in ((np.cos(at), True), (at, False), (np.ones(10), False)):
        cost = shape @ stiff @ shape / (shape @ shape)
        assert (cost < 1.0) == free, cost


def test_a_wheel_that_does_nothing_is_left_out():
    """Of a robot that coasts no half track is known."""
    gain = np.array([[0.0, 0.8], [0.0, -9.0]])
    seen = seen_by(np.random.default_rng(7), 0.0)
    way, turn = seen.gone[:, None] + seen.way, seen.turned[:, None] + seen.turn
    own = {name: np.ones((*way.shape, 2)) for name in ("1", "own push", "own speed")}
    step = np.full(way.shape, STEP)
    run = np.repeat(np.arange(RUNS), WINDOWS)
    whole = Path({}, own, gain, np.array([3.0, 5.0]), None, way, turn, step)
    rng = np.random.default_rng(8)
    answer = np.cumsum(rng.normal(size=(len(run), ROWS, ROWS)), axis=1)
    linear = Linear(None, None, rng.normal(size=(len(run), ROWS, 5)))
    data = Data(Stub(run, np.zeros(RUNS)), np.broadcast_to(np.eye(ROWS), (len(run), ROWS, ROWS)))
    base = rng.normal(size=(len(run), ROWS, 3))
    found = turnings(data, Solution(None, None, [], linear, 0.0, None, 0), base, whole, Responses(answer, answer, None))
    assert [kind.acts_on for kind, _ in found] == ["push of the left wheel"] * 2 + ["rolling of the left wheel"]
    assert all(np.isfinite([turning.period, turning.half_track]).all() for _, turning in found)
    assert all(turning.half_track < 0.0 for _, turning in found)
    away = base.copy()
    away[3, 2, 1] = np.inf
    fit = Solution(None, None, [], linear, 0.0, None, 0)
    assert turnings(data, fit, away, whole, Responses(answer, answer, None)) == []


def test_a_long_run_is_searched_in_parts():
    run = np.repeat([0, 1, 2], [70, 1, 20])
    parts = parts_of(run)
    assert max(map(len, parts)) <= wheel_angle.LONGEST
    np.testing.assert_array_equal(np.concatenate(parts), np.arange(91))
    assert [len(np.unique(run[own])) for own in parts] == [1] * len(parts)


def test_a_robot_that_mostly_stands_asks_for_no_more_patterns():
    """Steps follow the widest windows where nearly all are narrow."""
    seen = seen_by(np.random.default_rng(11), 0.0)
    still = np.where(np.arange(len(seen.gone)) % 12 == 0, 1.0, 1e-4)[:, None]
    gone = np.concatenate([np.cumsum((still * seen.way)[own][:, -1]) for own in seen.parts])
    _, more = _steps(seen._replace(gone=gone), still * seen.way, gone)
    assert len(more) < 50

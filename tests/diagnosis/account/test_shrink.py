"""The shrink of a gap from errors whose answer is known."""

import numpy as np
import pytest

from jaxident.diagnosis.account.shrink import interval, shrink_of

COUNT = 90
NOTHING = np.zeros(400)


def floor(rng, value=1.0, spread=0.03):
    """A floor, and draws of it as a law known to some per cent leaves them."""
    return value, value * (1.0 + spread * rng.normal(size=400))


def errors(rng, level):
    return level * rng.chisquare(1, (COUNT, 3))


def test_an_effect_that_explains_all_shrinks_all():
    rng = np.random.default_rng(0)
    found = shrink_of(errors(rng, 30.0), errors(rng, 1.0), *floor(rng), NOTHING)
    assert found.value == pytest.approx(1.0, abs=0.02)
    assert found.interval[0] < found.value < found.interval[1]


def test_an_effect_that_explains_nothing_shrinks_nothing():
    rng = np.random.default_rng(1)
    same = errors(rng, 30.0)
    found = shrink_of(same, same, *floor(rng), NOTHING)
    assert found.value == 0.0
    assert found.interval == (0.0, 0.0)


def test_without_a_gap_no_shrink_is_told():
    rng = np.random.default_rng(2)
    assert shrink_of(errors(rng, 1.0), errors(rng, 1.0), *floor(rng, 1.1), NOTHING) == (None, None)


def test_one_window_alone_makes_no_gap():
    before = errors(np.random.default_rng(6), 1.0)
    before[3] *= 300.0
    assert before.mean() > 2.0
    assert shrink_of(before, before, *floor(np.random.default_rng(7)), NOTHING) == (None, None)


def test_unseen_windows_are_left_out():
    rng = np.random.default_rng(3)
    before, after = errors(rng, 30.0), errors(rng, 1.0)
    whole = shrink_of(before[10:], after[10:], *floor(rng), NOTHING)
    before[:10] = np.nan
    found = shrink_of(before, after, *floor(np.random.default_rng(4)), NOTHING)
    assert found.value == pytest.approx(whole.value, abs=1e-12)
    assert np.isfinite(interval(before)).all()


def test_low_noise_by_chance_is_no_shrink_above_one_for_sure():
    """A model that misses by 0.2 beside noise that came out 15 % low: what is left is not below what it misses."""
    rng = np.random.default_rng(8)
    found = shrink_of(errors(rng, 30.0), errors(rng, 0.85), *floor(rng), 0.2 * rng.chisquare(5, 400) / 5)
    assert found.value > 1.0
    assert found.interval[0] < 1.0 - 0.2 / 30.0


def test_a_floor_that_may_be_lower_moves_the_low_end_alone():
    """A model that misses by 1.5 beside a floor of 2, of which half may be a regular rest: up to 0.5 of 29 is left."""
    rng = np.random.default_rng(10)
    before, after, one = errors(rng, 30.0), errors(rng, 1.5), floor(rng, 2.0)
    sure = shrink_of(before, after, *one, NOTHING)
    found = shrink_of(before, after, *one, NOTHING, least=0.5 * one[1])
    assert (found.value, found.interval[1]) == (sure.value, sure.interval[1])
    assert found.interval[0] < 1.0 - 0.5 / 29.0 < sure.interval[0]


def test_interval_of_a_mean_covers_it():
    """90 % intervals of independent errors cover 85 to 95 % of the time: 200 draws, standard error 2 %."""
    hits = []
    for seed in range(200):
        low, high = interval(np.random.default_rng(seed).chisquare(1, (COUNT, 3)))
        hits.append(low <= 1.0 <= high)
    assert 0.83 <= np.mean(hits) <= 0.97


def test_a_floor_that_is_hardly_known_leaves_the_shrink_open():
    """Before 1.5, after 1.4, floor 1 give or take a third: nobody knows whether much or little of a gap is left."""
    rng = np.random.default_rng(9)
    before = np.full((COUNT, 3), 1.5)
    sure, open_ = (shrink_of(before, before - 0.1, 1.0, rng.normal(1.0, s, 400), NOTHING) for s in (0.01, 0.25))
    assert sure.value == open_.value == pytest.approx(0.2)
    assert sure.interval[1] < 0.3
    assert open_.interval[0] < 0.2
    assert open_.interval[1] > 0.9

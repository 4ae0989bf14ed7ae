"""Gap, shrink and place from errors whose answer is known."""

import numpy as np
import pytest
from support.arcs import along_arcs

from jaxident.diagnosis.extent import gap
from jaxident.diagnosis.extent.floor import Floor
from jaxident.diagnosis.extent.measure import judging_windows
from jaxident.diagnosis.extent.shrink import interval, shrink_of
from jaxident.diagnosis.extent.where import Region, _discoveries, _regions, increments
from jaxident.diagnosis.motion.responses import modelled_path
from jaxident.diagnosis.prepare import BURN, FEWEST, Prepared, roles, stretches
from jaxident.errors import InputError
from jaxident.log import make_log

COUNT = 90
NOTHING = np.zeros(400)


def floor(rng, value=1.0):
    return Floor(value, value * rng.chisquare(3 * COUNT, 400) / (3 * COUNT), np.full((COUNT, 3), value))


def errors(rng, level):
    return level * rng.chisquare(1, (COUNT, 3))


def test_an_effect_that_explains_all_shrinks_all():
    rng = np.random.default_rng(0)
    found = shrink_of(errors(rng, 30.0), errors(rng, 1.0), floor(rng), NOTHING)
    assert found.value == pytest.approx(1.0, abs=0.02)
    assert found.interval[0] < found.value < found.interval[1]


def test_an_effect_that_explains_nothing_shrinks_nothing():
    rng = np.random.default_rng(1)
    same = errors(rng, 30.0)
    found = shrink_of(same, same, floor(rng), NOTHING)
    assert found.value == 0.0
    assert found.interval == (0.0, 0.0)


def test_without_a_gap_no_shrink_is_told():
    rng = np.random.default_rng(2)
    assert shrink_of(errors(rng, 1.0), errors(rng, 1.0), floor(rng, 1.1), NOTHING) == (None, None)


def test_one_window_alone_makes_no_gap():
    before = errors(np.random.default_rng(6), 1.0)
    before[3] *= 300.0
    assert before.mean() > 2.0
    assert shrink_of(before, before, floor(np.random.default_rng(7)), NOTHING) == (None, None)


def test_unseen_windows_are_left_out():
    rng = np.random.default_rng(3)
    before, after = errors(rng, 30.0), errors(rng, 1.0)
    whole = shrink_of(before[10:], after[10:], floor(rng), NOTHING)
    before[:10] = np.nan
    found = shrink_of(before, after, floor(np.random.default_rng(4)), NOTHING)
    assert found.value == pytest.approx(whole.value, abs=1e-12)
    assert np.isfinite(interval(before)).all()


def test_low_noise_by_chance_is_no_shrink_above_one_for_sure():
    """A model that misses by 0.2 beside noise that came out 15 % low: what is left is not below what it misses."""
    rng = np.random.default_rng(8)
    found = shrink_of(errors(rng, 30.0), errors(rng, 0.85), floor(rng), 0.2 * rng.chisquare(5, 400) / 5)
    assert found.value > 1.0
    assert found.interval[0] < 1.0 - 0.2 / 30.0


def test_a_floor_that_may_be_lower_moves_the_low_end_alone():
    """A model that misses by 1.5 beside a floor of 2, of which half may be a regular rest: up to 0.5 of 29 is left."""
    rng = np.random.default_rng(10)
    before, after, one = errors(rng, 30.0), errors(rng, 1.5), floor(rng, 2.0)
    sure = shrink_of(before, after, one, NOTHING)
    found = shrink_of(before, after, one, NOTHING, least=0.5 * one.replays)
    assert (found.value, found.interval[1]) == (sure.value, sure.interval[1])
    assert found.interval[0] < 1.0 - 0.5 / 29.0 < sure.interval[0]


def test_a_floor_that_is_hardly_known_leaves_the_shrink_open():
    """Before 1.5, after 1.4, floor 1 give or take a third: nobody knows whether much or little of a gap is left."""
    rng = np.random.default_rng(9)
    known = Floor(1.0, rng.normal(1.0, 0.01, 400), np.full((COUNT, 3), 1.0))
    loose = known._replace(replays=rng.normal(1.0, 0.25, 400))
    before = np.full((COUNT, 3), 1.5)
    sure, open_ = (shrink_of(before, before - 0.1, one, NOTHING) for one in (known, loose))
    assert sure.value == open_.value == pytest.approx(0.2)
    assert sure.interval[1] < 0.3
    assert open_.interval[0] < 0.2
    assert open_.interval[1] > 0.9


def test_a_start_state_never_leaves_for_a_worse_one(monkeypatch):
    """Residuals like a cube root: a plain Gauss-Newton step doubles the distance each time. One window is linear."""

    def corner(vector, starts, windows, numbers):
        power = np.array([1.0 / 3.0, 1.0])
        found = -np.sign(starts) * np.abs(starts) ** power
        slope = power * np.abs(starts) ** (power - 1.0)
        return found.T, slope.T[:, :, None] * np.eye(5)

    monkeypatch.setattr(gap, "_by_start", corner)
    begun = np.full((5, 2), 0.3)
    found = gap.settle(np.zeros(2), begun, None, np.tile(np.eye(5), (2, 1, 1)))
    assert np.all(np.abs(found[:, 0]) <= 0.3)
    np.testing.assert_allclose(found[:, 1], 0.0, atol=1e-8)


def test_interval_of_a_mean_covers_it():
    """90 % intervals of independent errors cover 85 to 95 % of the time: 200 draws, standard error 2 %."""
    hits = []
    for seed in range(200):
        low, high = interval(np.random.default_rng(seed).chisquare(1, (COUNT, 3)))
        hits.append(low <= 1.0 <= high)
    assert 0.83 <= np.mean(hits) <= 0.97


def test_the_region_that_causes_the_excess_is_found():
    rng = np.random.default_rng(5)
    speed, other = rng.uniform(-1.0, 1.0, 200), rng.uniform(-1.0, 1.0, 200)
    excess = np.where(speed > 0.5, 5.0, 0.0) + rng.normal(size=200)
    regions, table = _regions(excess, {"v": speed, "other": other})
    assert regions[0].variable == "v"
    assert regions[0].low == pytest.approx(0.5, abs=0.15)
    assert regions[0].share > 0.5
    assert not any(region.variable == "other" for region in regions)
    assert set(table) == {"v", "other"}


def test_false_regions_stay_below_their_rate():
    """No excess anywhere: of 60 sets of eight regions at most a few hold one (5 % expected, standard error 3 %)."""
    claimed = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        regions, _ = _regions(rng.normal(size=80), {"v": rng.uniform(size=80), "w": rng.uniform(size=80)})
        claimed += bool(regions)
    assert claimed <= 9


def test_adjusted_probabilities_are_those_of_benjamini_and_hochberg():
    given = [Region("v", 0.0, 1.0, 0.5, p) for p in (0.001, 0.02, 0.2, 0.8)]
    assert sorted(round(region.p_value, 6) for region in _discoveries(given)) == [0.004, 0.04]


def prepared(windows):
    """One run whose first half of windows names; what judging does not read is left out."""
    naming = np.arange(len(windows.run)) < len(windows.run) // 2
    return Prepared(None, 1.0, windows, naming, 1.0, None, None, None)


def test_windows_without_early_poses_do_not_judge():
    windows = along_arcs(40, 6)
    windows.seen[: BURN - FEWEST + 1, 4] = False  # one pose short
    windows.seen[: BURN - FEWEST, 5] = False
    judging = judging_windows(prepared(windows), 40)
    assert len(judging.run) == 6  # filled up for the program that is compiled already
    np.testing.assert_array_equal(judging.first[:2], windows.first[[3, 5]])
    assert not judging.seen[2:, 2:].any()


def test_a_log_without_early_poses_to_judge_by_is_refused():
    windows = along_arcs(40, 4)
    windows.seen[:BURN, 2:] = False
    with pytest.raises(InputError, match="no stretch of the runs kept for judging"):
        judging_windows(prepared(windows), 40)


def test_a_turned_marker_looks_like_sideways_movement():
    windows, turned = along_arcs(40, 3, 40), np.zeros((3, 40, 3))
    turned[..., 2] = -0.1
    along, lateral, heading = increments(modelled_path(np.zeros((3, 120)), windows))
    seen = increments(modelled_path(turned.reshape(3, -1), windows))
    np.testing.assert_allclose(seen[0], along * np.cos(0.1) + lateral * np.sin(0.1), atol=1e-12)
    np.testing.assert_allclose(seen[1], lateral * np.cos(0.1) - along * np.sin(0.1), atol=1e-12)
    np.testing.assert_allclose(seen[2], heading, atol=1e-12)
    assert np.abs(along).max() > 0.0


@pytest.mark.parametrize("runs", [1, 4])
def test_windows_that_do_not_show_their_start_take_no_part(runs):
    """Of 24 windows every fifth has a pose too few among its first rows, every fourth just enough; no log none."""
    rows, count = 40, 24
    x = np.zeros((count, rows))
    x[::4, : BURN - FEWEST] = np.nan
    x[::5, : BURN + 1 - FEWEST] = np.nan
    t = 0.03 * np.arange(rows * count)
    log = make_log(t, t, t, x.ravel(), 0.0 * t, 0.0 * t)._replace(run=np.repeat(np.arange(runs), rows * count // runs))
    windows = stretches(log, rows)
    assert len(windows.run) == np.sum(np.arange(count) % 5 > 0)
    assert windows.seen[:BURN].sum(axis=0).min() == FEWEST
    assert 0 < roles(windows).sum() < len(windows.run)
    with pytest.raises(InputError, match="poses among its first"):
        stretches(log._replace(x=np.full(len(t), np.nan)), rows)

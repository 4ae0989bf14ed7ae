"""Where a gap lies, from errors whose answer is known."""

import numpy as np
import pytest
from support.arcs import along_arcs

from jaxident.diagnosis.account.where import Region, _discoveries, _regions, increments
from jaxident.diagnosis.motion.responses import modelled_path


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


def test_a_turned_marker_looks_like_sideways_movement():
    windows, turned = along_arcs(40, 3, 40), np.zeros((3, 40, 3))
    turned[..., 2] = -0.1
    along, lateral, heading = increments(modelled_path(np.zeros((3, 120)), windows))
    seen = increments(modelled_path(turned.reshape(3, -1), windows))
    np.testing.assert_allclose(seen[0], along * np.cos(0.1) + lateral * np.sin(0.1), atol=1e-12)
    np.testing.assert_allclose(seen[1], lateral * np.cos(0.1) - along * np.sin(0.1), atol=1e-12)
    np.testing.assert_allclose(seen[2], heading, atol=1e-12)
    assert np.abs(along).max() > 0.0


def test_no_region_stands_out_where_the_floor_is_above_every_error():
    rng = np.random.default_rng(0)
    regions, _ = _regions(-1e10 * rng.uniform(size=80), {"v": rng.uniform(size=80)})
    assert regions == []

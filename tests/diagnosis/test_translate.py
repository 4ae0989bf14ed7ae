"""Coordinates of a search as parameters of the catalogue, with their deviations."""

import numpy as np
import pytest

from jaxident.diagnosis.causes.search import Solution
from jaxident.diagnosis.motion.coordinates import PLACES, free_places, neutral_vector
from jaxident.diagnosis.translate import effect_of

PLACE = {key: PLACES["traction_limit", key] for key in ("inverse_square", "dry", "spin")}


@pytest.mark.parametrize(("spin", "told"), [(0.02, 0.02), (4e-9, 0.0), (0.0, 0.0)])
def test_a_spin_that_poses_cannot_tell_from_none_is_none(spin, told):
    """The search finds no slope there, and an enormous variance."""
    places = [place for place in free_places(("traction_limit",)) if place != PLACE["dry"]]
    vector = neutral_vector(np.ones(10))
    vector[[PLACE["inverse_square"], PLACE["dry"], PLACE["spin"]]] = 4.0, 1.0, spin
    variance = np.full(len(places), 1e-6)
    variance[places.index(PLACE["spin"])] = 1e-6 if told else 1e212
    found = effect_of("traction_limit", Solution(vector, None, places, None, 0.0, np.diag(variance), 1), 2.0)
    assert found.parameters == pytest.approx({"limit": 1.0, "dry": 1.0, "spin": told})
    assert found.standard_deviation == pytest.approx(
        {"limit": 2.0 * 0.5 * 0.5**3 * 1e-3, "dry": 0.0, "spin": 1e-3 if told else 0.0}, rel=1e-4
    )


def test_where_nothing_tells_how_far_left_a_marker_is_it_may_lie_anywhere():
    places = free_places(("marker_offset",))
    solution = Solution(neutral_vector(np.ones(10)), None, places, None, 0.0, 1e-6 * np.eye(len(places)), 1)
    found = effect_of("marker_offset", solution, 2.0)
    assert found.parameters == {"ahead": 0.0, "left": 0.0}
    assert found.standard_deviation == pytest.approx({"ahead": 1e-3, "left": 0.3 / 3.0**0.5})

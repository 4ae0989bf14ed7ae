"""Coordinates of a search as parameters of the catalogue, with their deviations."""

from types import SimpleNamespace

import numpy as np
import pytest

from jaxident.diagnosis.decide import compare_parameters
from jaxident.diagnosis.fit.refit import Solution
from jaxident.diagnosis.motion.windows import FREE
from jaxident.diagnosis.noise.law import Law
from jaxident.diagnosis.preparation.translate import effect_of, to_model
from jaxident.effects.coordinates import PLACES, free_places, neutral_vector
from jaxident.log import make_log

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


def test_a_limit_that_never_acts_is_none_of_the_model_and_has_no_size():
    """As robot and simulator may have it in common, whose commands never change fast enough: no file holds infinity."""
    effects = "input_rate_limit", "turn_loss"
    places = free_places(effects)
    vector = neutral_vector(np.ones(10))
    vector[PLACES["turn_loss", "loss"]] = 0.3
    solution = Solution(vector, None, places, None, 0.0, 1e-6 * np.eye(len(places)), 1)
    log = make_log(0.03 * np.arange(9), np.ones(9), np.ones(9))
    prepared = SimpleNamespace(log=log, largest=1.0, windows=SimpleNamespace(held=FREE), told=None, laws=())
    model = to_model(prepared, vector, Law(1e-3, 5e-3), effects, None, solution)
    assert [effect.name for effect in model.effects] == ["turn_loss"]
    finding = SimpleNamespace(fit=solution, selected=effects)
    rows = compare_parameters(prepared, finding, vector, effects)
    assert all(np.isfinite(row.refitted) for row in rows)
    assert rows[-1].name == "turn_loss loss"

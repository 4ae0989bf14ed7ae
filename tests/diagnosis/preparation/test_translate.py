"""Coordinates of a search as parameters of the catalogue, with their deviations."""

from types import SimpleNamespace

import numpy as np
import pytest

from jaxident.diagnosis.decide import compare_parameters
from jaxident.diagnosis.fit.refit import Solution
from jaxident.diagnosis.motion.windows import FREE
from jaxident.diagnosis.noise.law import Law
from jaxident.diagnosis.preparation.translate import effect_of, effect_values, in_user_units, to_model
from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.coordinates import (
    COORDINATES,
    PLACES,
    REACH,
    free_places,
    natural,
    natural_slopes,
    neutral_vector,
    pace,
    vector_of,
)
from jaxident.effects.fast_motion import drive_of
from jaxident.log import make_log
from jaxident.robot.drive import Physical
from jaxident.robot.model import Effect, Model

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


@pytest.mark.parametrize("name", COORDINATES)
def test_a_model_leads_to_coordinates_and_back_whatever_its_rates(name):
    """Accelerations are searched for as those of a robot of the typical rate; commands here are over 2 units."""
    drive = Physical(np.array([0.7, 11.0]), np.array([[1.2, 1.1], [9.0, -8.5]]), np.zeros(2))
    typical = CATALOGUE[name].typical()
    vector = vector_of(Model(0.03, drive, np.zeros(2), effects=(Effect(name, typical),)), 2.0)
    found = effect_values(name, vector, 2.0)
    assert [found[key] for key in typical] == pytest.approx(list(typical.values()), rel=1e-9)


def test_a_loss_is_as_uncertain_as_its_rate_makes_it():
    """Where the coordinate is known and the rate to 10 %, the loss is known to 10 %: this robot settles at once."""
    places, vector = free_places(("turn_loss",)), neutral_vector(np.zeros(10))
    vector[0], vector[PLACES["turn_loss", "loss"]] = np.log(60.0), 0.5
    variance = np.full(len(places), 1e-10)
    variance[places.index(0)] = 0.01
    found = effect_of("turn_loss", Solution(vector, None, places, None, 0.0, np.diag(variance), 1), 1.0)
    assert found.parameters["loss"] == pytest.approx(0.5 * pace(np.log([60.0, 1.0]))[0])
    assert found.standard_deviation["loss"] == pytest.approx(0.1 * found.parameters["loss"], rel=1e-3)


def test_the_follower_and_the_files_have_the_same_robot():
    """From coordinates for commands over 2 units, at a slow and a fast rate."""
    drive = Physical(np.array([0.05, 40.0]), np.array([[1.2, 1.1], [9.0, -8.5]]), np.array([0.1, -2.0]))
    dead_zone = np.array([0.2, 0.3])
    vector = vector_of(Model(0.03, drive, dead_zone), 2.0)
    told = [*drive.rate, *np.ravel(drive.gain), *dead_zone, *drive.coupling]
    assert in_user_units(vector, 2.0) == pytest.approx(told, rel=1e-12)
    followed = drive_of(vector)
    robot = [*followed.rate, *np.ravel(followed.gain), *vector[6:8], *followed.coupling]
    assert np.array(robot) == pytest.approx(natural(vector), rel=1e-12)


def test_robots_alike_in_coordinates_reach_the_same_speeds():
    """After REACH under the same push, whatever their rates."""
    reached = []
    for rates in ([0.02, 0.5], [3.0, 3.0], [9.0, 200.0]):
        vector = neutral_vector(np.concatenate([np.log(rates), [0.5, 0.4, 9.0, -8.5], np.zeros(4)]))
        robot = natural(vector)
        reached.append(robot[[2, 4]] * -np.expm1(-robot[:2] * REACH) / robot[:2])
    np.testing.assert_allclose(reached, np.tile(reached[1], (3, 1)), rtol=1e-9)


def test_slopes_of_the_nominal_parameters_are_those_of_small_steps():
    vector = np.concatenate([np.log([0.7, 11.0]), [0.5, 0.4, 9.0, -8.5, 0.1, 0.2, 0.3, -1.0]])
    step = 1e-3 * np.random.default_rng(0).normal(size=10)
    moved = natural(vector + step) - natural(vector - step)
    np.testing.assert_allclose(2.0 * natural_slopes(vector) @ step, moved, rtol=1e-4)

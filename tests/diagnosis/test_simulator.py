"""A simulator in other units than the robot is refused with a word on which; a model serves as one."""

from types import SimpleNamespace

import numpy as np
import pytest

from jaxident.diagnosis.causes import chance_effects
from jaxident.diagnosis.decide import compare_parameters
from jaxident.diagnosis.noise.law import Law
from jaxident.diagnosis.preparation.pose_screening import Frames
from jaxident.diagnosis.preparation.translate import abreast_of_marker
from jaxident.diagnosis.simulator import Simulator, _direct, as_simulator, check_units, is_noisy, rarer, shared
from jaxident.effects.coordinates import PLACES, free_places, neutral_vector, nominal_vector, pace
from jaxident.errors import InputError
from jaxident.log import make_log
from jaxident.robot.drive import Physical
from jaxident.robot.model import Effect, Model


def drive(length=1.0, angle=1.0, command=1.0, rows=200):
    t = 0.05 * np.arange(rows)
    u = np.repeat([[0.5, 0.3], [-0.4, 0.6], [0.8, 0.8], [0.2, -0.9]], rows // 4, axis=0)
    v, w = 0.3 * u.sum(axis=1), 4.0 * (u[:, 0] - u[:, 1])
    theta = np.cumsum(0.05 * w)
    x, y = np.cumsum(0.05 * v * np.cos(theta)), np.cumsum(0.05 * v * np.sin(theta))
    return make_log(t, command * u[:, 0], command * u[:, 1], length * x, length * y, angle * theta)


def test_the_same_units_pass():
    check_units(drive(length=0.8, angle=1.2), drive())
    check_units([drive(), drive()], drive(length=2.0, angle=0.7))


@pytest.mark.parametrize(
    ("units", "words"),
    [
        ({"length": 1000.0}, "moves 1e\\+03 times as fast .* are lengths"),
        ({"angle": 180.0 / np.pi}, "turns .* are angles"),
        ({"command": 100.0}, "moves 0.01 times"),
    ],
)
def test_other_units_are_told(units, words):
    with pytest.raises(InputError, match=words):
        check_units(drive(**units), drive())


def test_logs_without_noise_are_told_from_noisy_ones_beside_a_camera_whose_memory_took_all():
    robot, nothing = Law(3e-4, 1e-7, coloured=(4e-4, 1e-2), coloured_time=0.5), Law(1e-7, 1e-7)
    assert not is_noisy(nothing, robot)
    assert is_noisy(nothing._replace(heading=1e-3), robot)
    assert is_noisy(nothing._replace(position=3e-4), robot)


def test_a_model_with_effects_is_a_simulator():
    """Commands up to 90 in the user's unit are up to 1 in coordinates: levels shrink by 90, gains grow."""
    effects = (
        Effect("input_saturation", {"level": 72.0}),
        Effect("transport_delay", {"delay": 0.12}),
        Effect("slope", {"acceleration": 0.2, "direction": np.pi / 2}),
        Effect("mass_offset", {"along": 0.1}),
        Effect("coloured_noise", {"correlation_time": 0.5, "position": 1e-3, "heading": 1e-2}),
    )
    gain = np.array([[0.01, 0.01], [0.1, -0.1]])
    model = Model(0.05, Physical(np.array([2.0, 3.0]), gain, None), np.array([9.0, 4.5]), effects=effects)
    found = as_simulator(model, drive(command=100.0))
    drive_here = Physical(np.array([2.0, 3.0]), 90.0 * gain, None)
    expected = neutral_vector(nominal_vector(drive_here, np.array([0.1, 0.05])))
    slower = pace(np.log([2.0, 3.0]))[0]
    expected[PLACES["input_saturation", "level"]] = 0.8
    expected[PLACES["transport_delay", "delay"]] = 0.12
    expected[PLACES["slope", "y"]] = 0.2 / slower
    expected[PLACES["mass_offset", "along"]] = 0.1 / slower
    np.testing.assert_allclose(found.vector, expected, atol=1e-12)
    assert found.effects == tuple(effect.name for effect in effects)


def test_effects_in_common_are_no_gap():
    simulator = Simulator(np.zeros(3), ("slope", "turn_loss"))
    assert shared(("transport_delay", "slope"), simulator) == (("slope",), ("turn_loss",))
    assert shared(("slope",), None) == ((), ())


def test_the_right_effect_of_the_wrong_size_is_a_parameter():
    """The model has a delay of 0.05 s, the robot one of 0.10 +- 0.01 s; commands up to 90 leave seconds alone."""
    place = PLACES["transport_delay", "delay"]
    given, fitted = (neutral_vector(np.ones(10)) for _ in range(2))
    given[place], fitted[place] = 0.05, 0.10
    solution = SimpleNamespace(vector=fitted, places=[*range(10), place], covariance=1e-4 * np.eye(11))
    finding = SimpleNamespace(selected=("transport_delay",), fit=solution)
    prepared = SimpleNamespace(largest=90.0)
    last = compare_parameters(prepared, finding, given, ("transport_delay",))[-1]
    assert last.name == "transport_delay delay"
    np.testing.assert_allclose(last[1:], [0.05, 0.10, 0.01], rtol=1e-6)
    assert len(compare_parameters(prepared, finding, given)) == 10


def test_what_the_simulator_has_hardly_any_of_is_rarer_there():
    theirs = {
        "outliers": {"probability": 0.001},
        "frozen_frames": {"probability": 0.05},
        "coloured_noise": {"position": 1.0},
    }
    own = {
        "outliers": {"probability": 0.02},
        "frozen_frames": {"probability": 0.08},
        "coloured_noise": {"position": 2.0},
    }
    beyond = {"outliers": 30.0, "frozen_frames": 30.0, "coloured_noise": 30.0}
    assert rarer(theirs, own, beyond, price=9.0) == ["outliers"]
    assert rarer(theirs, own, beyond, price=40.0) == []  # as much is made up easily where something is missing
    assert rarer(theirs, {}, beyond, price=9.0) == []


def test_what_looks_like_a_memory_in_both_cameras_is_no_difference(monkeypatch):
    """Few windows show the simulator's, so that it alone is none; of a simulator without any it is the robot's."""
    rows = np.zeros(100)
    prepared = SimpleNamespace(log=SimpleNamespace(t=rows), frames=Frames(rows > 0, rows > 0), lost=(0.0, 0.0))

    def side(coloured):
        law = Law(1e-3, 1e-2, coloured=coloured, coloured_time=0.5 if coloured else None)
        return prepared, SimpleNamespace(law=law)

    monkeypatch.setattr(chance_effects, "_memory", lambda finding, price: 0.0)
    assert _direct(side((1e-3, 1e-2)), side((1e-3, 1e-2)), 9.0) == ["coloured_noise"]
    assert _direct(side(None), side((1e-3, 1e-2)), 9.0) == []


def test_a_model_that_knows_the_side_of_its_marker_is_compared_as_seen_from_there():
    """The refit has the same robot with the marker ahead alone: no parameter differs."""
    given = neutral_vector(np.array([1.0, 1.5, 0.5, 0.4, 5.0, -4.0, 0.1, 0.1, 0.2, -1.0]))
    given[PLACES["marker_offset", "ahead"]], given[PLACES["marker_offset", "left"]] = 0.02, 0.03
    places = free_places(("marker_offset",))
    solution = SimpleNamespace(vector=abreast_of_marker(given), places=places, covariance=1e-4 * np.eye(len(places)))
    finding = SimpleNamespace(selected=("marker_offset",), fit=solution)
    rows = compare_parameters(SimpleNamespace(largest=2.0), finding, given, ("marker_offset",))
    np.testing.assert_allclose([row.nominal for row in rows], [row.refitted for row in rows], atol=1e-12)
    assert [row.name for row in rows[10:]] == ["marker_offset ahead", "marker_offset left"]

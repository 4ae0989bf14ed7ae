"""The angles at which wheels begin, from sums of squares at a few angles."""

import numpy as np

from jaxident.estimation.ahead.stretches import Starts
from jaxident.estimation.ahead.wheel_phase import FOLLOWED, UNKNOWN, closer, followed, phases_of

TRUE = np.array([[0.3, 2.0, 5.1], [6.1, 1.2, 3.3]])
SIZE = np.array([[40.0, 90.0, 200.0], [30.0, 10.0, 70.0]])


def squares(phases, acting):
    return np.array([squares_at(phase, acting) for phase in phases])


def squares_at(phase, acting):
    """Each law that acts at a wrong angle, or does not act, leaves squares; the first disturbs the second."""
    left = sum(SIZE[k] * (1.0 - np.cos(phase[k] - TRUE[k])) if k in acting else SIZE[k] for k in (0, 1))
    return left + (8.0 * np.cos(phase[1] - phase[0]) if 0 not in acting else 0.0)


def apart(angle, other):
    return np.abs((angle - other + np.pi) % (2.0 * np.pi) - np.pi)


def test_one_law_is_found_between_the_angles_that_are_tried():
    phase, deviation = phases_of(squares, [1], (3, 3))
    fine = np.linspace(0.0, 2.0 * np.pi, 10_001)
    best = fine[squares([np.array([np.zeros(3), np.full(3, angle)]) for angle in fine], [1]).argmin(axis=0)]
    assert apart(phase[1], best).max() < 0.02
    assert np.all(phase[[0, 2]] == 0.0)
    # half the squares bend by SIZE / 2 at their least: a deviation is the root of one over that
    np.testing.assert_allclose(deviation[1], np.sqrt(2.0 / SIZE[1]), rtol=0.5)


def test_several_laws_are_found_beside_each_other():
    phase, _ = phases_of(squares, [0, 1], (2, 3))
    assert apart(phase, TRUE).max() < 0.02


def test_an_angle_that_nothing_tells_is_unknown():
    _, deviation = phases_of(lambda phases, acting: np.zeros((len(phases), 3)), [0], (1, 3))
    np.testing.assert_allclose(deviation, UNKNOWN)


def test_phases_near_the_best_ones_become_these():
    phase, deviation = closer(squares, [0, 1], TRUE + np.array([[0.1, -0.1, 0.15], [0.0, 0.12, -0.08]]))
    assert apart(phase, TRUE).max() < 0.02
    np.testing.assert_allclose(deviation, np.sqrt(2.0 / SIZE), rtol=0.1)


def test_a_start_goes_on_from_one_before_it_in_its_run():
    """One that knew less than two thirds of its rows, or that lies far behind, says nothing."""
    row = np.array([20, 29, 50, 400, 400 + FOLLOWED - 1, 400 + FOLLOWED, 20, 25])
    run = np.array([0, 0, 0, 0, 0, 0, 1, 1])
    own = np.array([0, 0, 2, 3, 3, 5, 6, 6])
    np.testing.assert_array_equal(followed(Starts(run, row)), own)
    order = np.array([5, 3, 7, 1, 0, 4, 2, 6])
    found = followed(Starts(run[order], row[order]))
    np.testing.assert_array_equal(order[found], own[order])

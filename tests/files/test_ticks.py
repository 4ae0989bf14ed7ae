"""Counts of wheel encoders to wheel speeds: by hand, across wraps, with holes, and what is refused."""

import numpy as np
import pytest

from jaxident.array_types import Wheels
from jaxident.errors import InputError
from jaxident.files.streams import WheelSpeeds
from jaxident.files.ticks import speeds_of_counts

TURN = 1000
T = 0.1 * np.arange(200)
SPEED = 8.0 * np.sin(T), 5.0 * np.cos(T)
ANGLE = -8.0 * np.cos(T), 5.0 * np.sin(T)


def counts(modulus=None):
    whole = [np.floor(angle * TURN / (2.0 * np.pi)) for angle in ANGLE]
    return WheelSpeeds(T, Wheels(*(each if modulus is None else each % modulus for each in whole)))


def test_speeds_are_those_of_the_wheels_to_a_count():
    found, line = speeds_of_counts(counts(), TURN)
    np.testing.assert_array_equal(found.t, T)
    fine = 2.0 * np.pi / TURN / 0.2
    for own, speed in zip(found.speed, SPEED, strict=True):
        assert np.abs(own - speed)[1:-1].max() < fine + 0.1**2 / 6.0 * 8.0
    assert line == f"one count more in 0.2 s is {fine:.3g} rad/s"


def test_a_counter_that_wraps_goes_the_short_way_round():
    whole, _ = speeds_of_counts(counts(), TURN)
    wrapped, _ = speeds_of_counts(counts(65536), TURN, 65536.0)
    np.testing.assert_allclose(np.stack(wrapped.speed), np.stack(whole.speed), atol=1e-9)


def test_a_wrap_that_nobody_told_of_is_refused_with_the_option_that_mends_it():
    with pytest.raises(InputError, match=r"does the counter begin again there\? `--wheel-counter 65536`"):
        speeds_of_counts(counts(65536), TURN)


def test_an_angle_that_wraps_is_a_counter_of_a_turn():
    wrapped = WheelSpeeds(T, Wheels(*(angle % (2.0 * np.pi) for angle in ANGLE)))
    with pytest.raises(InputError, match=r"`--wheel-counter 6\.283185`"):
        speeds_of_counts(wrapped, 2.0 * np.pi)


def test_angles_are_counts_of_which_a_turn_has_two_pi():
    found, _ = speeds_of_counts(WheelSpeeds(T, Wheels(*ANGLE)), 2.0 * np.pi)
    np.testing.assert_allclose(found.speed.right, np.gradient(ANGLE[0], 0.1), atol=1e-9)


def test_rows_with_one_wheel_alone_are_left_out():
    given = counts()
    given.speed.right[50] = np.nan
    found, _ = speeds_of_counts(given, TURN)
    np.testing.assert_array_equal(found.t, np.delete(T, 50))
    with pytest.raises(InputError, match="1 rows have those of both wheels"):
        speeds_of_counts(WheelSpeeds(T[:1], Wheels(*(each[:1] for each in given.speed))), TURN)


def test_wheels_that_stand_have_no_speed():
    still = np.full(len(T), 7.0)
    found, _ = speeds_of_counts(WheelSpeeds(T, Wheels(still, still)), TURN)
    assert not np.stack(found.speed).any()

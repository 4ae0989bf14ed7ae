"""Which discovered curves judging rows confirm, on errors whose answer is known."""

import numpy as np
import pytest

from jaxident.diagnosis.account.discovered import confirms

COUNT = 60
UNIT = np.array([1e-6, 1e-6, 1e-4])


def errors(*levels):
    """Errors (starts, 3) of one model after the other, in deviations of the camera: levels of the same mistakes, and
    noise of their own."""
    rng = np.random.default_rng(0)
    mistake, noise = rng.normal(size=(COUNT, 3)), rng.normal(size=(len(levels), COUNT, 3))
    return [np.sqrt(UNIT) * (level * mistake + 0.3 * own) for level, own in zip(levels, noise, strict=True)]


@pytest.mark.parametrize(
    ("levels", "confirmed", "expected"),
    [
        ((5.0, 1.0), 0, True),  # the first takes most away
        ((5.0, 5.1), 0, False),  # it takes nothing away
        ((5.0, 6.0), 0, False),  # it adds some
        ((5.0, 2.0, 1.0), 1, True),  # so does a second one
        ((5.0, 2.0, 2.1), 1, False),  # the second takes nothing away beside the first
        ((5.0, 5.1, 1.0), 0, True),  # two halves of one law: together only
        ((5.0, 1.0, 2.0), 0, False),  # the second adds some, however good both together are
        ((5.0, 2.0, 4.0, 3.0), 1, False),  # better than with a refused one, worse than with those confirmed
    ],
)
def test_a_curve_is_confirmed_by_what_it_takes_away_itself(levels, confirmed, expected):
    assert confirms(errors(*levels), confirmed, UNIT, seed=0) is expected


def test_noise_confirms_one_useless_curve_in_twenty():
    """Of 400; 20 are expected, with a standard error of 4.4 (blocks of three starts: some more)."""
    rng = np.random.default_rng(1)
    pairs = rng.normal(size=(400, 2, COUNT, 3)) * np.sqrt(UNIT)
    taken = sum(confirms([before, after], 0, UNIT, seed) for seed, (before, after) in enumerate(pairs))
    assert 8 <= taken <= 40


def test_a_model_that_throws_the_robot_out_of_the_room_confirms_nothing():
    before, after = errors(5.0, 1.0)
    after[7] = np.nan
    assert not confirms([before, after], 0, UNIT, seed=0)

"""What wheel speeds say against themselves: every doubt with its evidence and the option that mends it."""

import re

import jax
import numpy as np
import pytest

import jaxident as ji
from jaxident.columns import parse_columns
from jaxident.errors import InputError
from jaxident.estimation.suspicions.wheel_answer import answer_of_wheels
from jaxident.estimation.suspicions.wheel_suspicions import check_wheels, wheel_offset
from jaxident.files.shifted import shift_wheels
from jaxident.robot.drive import Physical
from jaxident.robot.wheel_sensor import WheelSensor
from jaxident.study.synthetic import excite, simulate_runs

ROBOT = ji.Model(0.05, Physical(np.array([3.0, 5.0]), np.array([[0.5, 0.4], [9.0, -8.5]])), np.array([0.1, 0.12]),
                 wheels=WheelSensor(0.033, 0.16))  # fmt: skip


@pytest.fixture(scope="module")
def log():
    inputs = excite(jax.random.key(3), "multilevel", 500, 0.05)
    return simulate_runs(ROBOT, inputs, noise=(1e-3, 5e-3), wheel_noise=0.1, key=jax.random.key(4))


def with_speeds(log, change):
    right, left = change(log.wheel_r, log.wheel_l)
    return log._replace(wheel_r=right, wheel_l=left)


def test_a_right_log_raises_no_doubt(log):
    assert check_wheels(log) == (True, ())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda r, s: (s, r), "right and left are swapped"),
        (lambda r, s: (-r, -s), "both wheel speeds have the wrong sign:"),
        (lambda r, s: (-s, -r), "both wheel speeds have the wrong sign and are swapped"),
        (lambda r, s: (-r, s), "the right wheel's speed has the wrong sign"),
        (lambda r, s: (r, -s), "the left wheel's speed has the wrong sign"),
    ],
)
def test_swaps_and_signs_are_told_and_their_option_mends_them(log, change, words):
    wrong = with_speeds(log, change)
    usable, (line,) = check_wheels(wrong)
    assert not usable
    assert words in line
    mended = {name: getattr(wrong, column.source) * column.multiply / column.divide for name, column in
              parse_columns(re.search(r"--columns (\S+?)`", line)[1]).items()}  # fmt: skip
    assert check_wheels(wrong._replace(**mended)) == (True, ())


@pytest.mark.parametrize(
    ("factor", "words"),
    [(30.0 / np.pi, "in rpm"), (0.033, "rim speeds in m/s"), (50.0, "the motor before its gear")],
)
def test_another_unit_is_told_by_the_radius_it_implies(log, factor, words):
    usable, (line,) = check_wheels(with_speeds(log, lambda r, s: (factor * r, factor * s)))
    assert usable
    assert words in line


def test_zeros_of_another_robot_and_wheels_that_turn_alone(log):
    still = with_speeds(log, lambda r, s: (r, 0.0 * s))
    line = "wheel_l is 0 in all 500 rows while the robot moves: the wheel speeds are not used"
    assert check_wheels(still) == (False, (line,))
    random = np.random.default_rng(0)
    foreign = with_speeds(log, lambda r, s: (random.normal(size=500), random.normal(size=500)))
    usable, (line,) = check_wheels(foreign)
    assert not usable
    assert "are they of this robot, and on its clock?" in line
    told = np.where(np.arange(500) < 300, 1.0, 0.0)
    usable, lines = check_wheels(log._replace(u_r=log.u_r * told, u_l=log.u_l * told))
    assert usable
    assert "though every command has been 0 for 2 s" in lines[0]


@pytest.mark.parametrize("late", [0.2, -0.2])
def test_another_clock_is_told_with_its_error_and_mended(log, late):
    wrong = log[20:-20]._replace(
        wheel_r=np.interp(log.t[20:-20] - late, log.t, log.wheel_r),
        wheel_l=np.interp(log.t[20:-20] - late, log.t, log.wheel_l),
    )
    usable, (line,) = check_wheels(wrong)
    assert usable
    told = re.search(r"the wheel speeds come (\S+) s (late|early) beside the poses", line)
    assert abs(float(told[1]) - 0.2) < 0.02  # a lag of the fit takes up part of it; rows are 0.05 s apart
    assert told[2] == ("late" if late > 0 else "early")
    offset, error = wheel_offset(wrong)
    assert abs(offset + late) < max(5.0 * error, 0.02)
    assert abs(float(re.search(r"--wheels-offset (\S+)", line)[1]) - offset) < 0.005
    assert check_wheels(shift_wheels(wrong, offset)) == (True, ())


def test_a_delay_before_the_wheel_is_measured_with_the_lag_behind_it(log):
    """Commands two rows earlier are a delay of 0.1 s; the rates of this robot are 3 and 5 per second."""
    found = answer_of_wheels(log)
    assert abs(found.delay) < max(5.0 * found.standard_error, 0.01)
    np.testing.assert_allclose(found.lag, [1 / 3, 1 / 5], rtol=0.1)
    early = log._replace(u_r=np.append(log.u_r[2:], [0.0, 0.0]), u_l=np.append(log.u_l[2:], [0.0, 0.0]))
    found = answer_of_wheels(early)
    assert abs(found.delay - 0.1) < max(5.0 * found.standard_error, 0.01)
    usable, lines = check_wheels(early)
    assert usable
    assert any("not the ground" in line for line in lines)
    random = np.random.default_rng(0)
    assert answer_of_wheels(with_speeds(log, lambda r, s: (random.normal(size=500), random.normal(size=500)))) is None


def test_wheels_in_the_air_are_named(log):
    random = np.random.default_rng(0)
    air = log._replace(**{name: 1e-3 * random.normal(size=500) for name in ("x", "y", "theta")})
    with pytest.raises(InputError, match=r"nothing moves.*its wheels turn: are they in the air.*answer the commands"):
        ji.identify(air)


@pytest.mark.slow
def test_identify_leaves_contradicting_wheels_aside_and_says_so(log):
    alone = ji.identify(log._replace(wheel_r=None, wheel_l=None), noise_law="white")
    found = ji.identify(with_speeds(log, lambda r, s: (s, r)), noise_law="white")
    assert found.model.wheels is None
    assert any("they are not used" in line for line in found.suspicions)
    np.testing.assert_array_equal(found.covariance, alone.covariance)
    paper = ji.identify(log, method="paper")
    assert any("wheel speeds are not used: the method paper" in line for line in paper.suspicions)

"""Motors by wheel speeds alone: against the truth over seeds, against the simulator, and what is refused."""

import dataclasses

import jax
import numpy as np
import pytest

import jaxident as ji
from jaxident.estimation.identify_motors import DELAY, ORDER, against
from jaxident.estimation.suspicions.clock_offset import follow_commands
from jaxident.log import join
from jaxident.robot.drive import Physical
from jaxident.robot.simulate import run_physical

RADIUS, TRACK, NOISE, STEP, ROWS = 0.03, 0.1, 0.3, 1.0 / 30.0, 600
RATE, GAIN, ZONE = np.array([3.0, 5.0]), np.array([[0.6, 0.55], [9.0, -8.5]]), np.array([0.25, 0.2])


def robot_with(delay: float = 0.0, noise: float = NOISE):
    late = (ji.Effect(DELAY, {"delay": delay}),) if delay else ()
    return ji.Model(STEP, Physical(RATE, GAIN), ZONE, effects=late, wheels=ji.WheelSensor(RADIUS, TRACK, noise))


def driven(robot, seed: int):
    made = ji.simulate(robot, ji.excite(jax.random.key(seed), "multilevel", ROWS, STEP), key=jax.random.key(100 + seed))
    return type(made)(*map(np.asarray, made))


def on_blocks(log):
    """The log of a robot that stands, whose camera sees nothing."""
    blind = np.full(len(log.t), np.nan)
    return log._replace(x=blind, y=blind, theta=blind)


def departures(delay: float, seeds: int) -> np.ndarray:
    """Errors over deviations (seeds, 9): the numbers of ORDER, then the delay."""
    true, found = np.array([*RATE, *GAIN.ravel(), *ZONE, delay]), []
    robot = robot_with(delay)
    for seed in range(seeds):
        one = ji.identify_motors(on_blocks(driven(robot, seed)), RADIUS, TRACK)
        value = np.array([*one.drive.rate, *np.ravel(one.drive.gain), *one.model.dead_zone, one.delay])
        deviation = [*np.sqrt(np.diagonal(one.model.covariance))[: len(ORDER)], one.delay_deviation]
        found.append((value - true) / deviation)
    return np.array(found)


@pytest.mark.slow
def test_intervals_hold_over_seeds():
    """Sixty robots tell a deviation to 9 %, nine numbers together to less."""
    away = departures(0.05, 60)
    assert np.sqrt(np.mean(away**2)) == pytest.approx(1.0, abs=0.15)
    assert np.mean(np.abs(away) < 1.96) > 0.92
    assert np.abs(away.mean(axis=0)).max() < 4.0 / np.sqrt(60.0)


def test_a_few_robots_with_a_delay_and_without():
    assert np.abs(departures(0.05, 2)).max() < 4.0
    assert np.abs(departures(0.0, 2)[:, : len(ORDER)]).max() < 4.0


def test_wheels_that_are_exact_give_the_exact_motors():
    found = ji.identify_motors([driven(robot_with(noise=0.0), seed) for seed in (0, 1)], RADIUS, TRACK)
    np.testing.assert_allclose(found.drive.rate, RATE, rtol=1e-4)
    np.testing.assert_allclose(found.drive.gain, GAIN, rtol=1e-4)
    np.testing.assert_allclose(found.model.dead_zone, ZONE, rtol=1e-4)
    assert found.explained.min() > 1.0 - 1e-8
    np.testing.assert_allclose(found.modelled, found.measured, atol=1e-3)


def test_the_model_predicts_what_the_wheels_do():
    found = ji.identify_motors(driven(robot_with(0.05), 0), RADIUS, TRACK)
    assert found.model.effects[0].name == DELAY
    assert found.sensor.noise == pytest.approx(NOISE, rel=0.1)
    other = driven(robot_with(0.05, 0.0), 7)
    made = ji.simulate(dataclasses.replace(found.model, wheels=found.sensor._replace(noise=0.0)), other)
    assert np.abs(made.wheel_r - other.wheel_r).max() < 0.1 * np.abs(other.wheel_r).max()


def test_the_lag_is_that_of_the_simulator():
    log = driven(robot_with(noise=0.0), 3)
    states = run_physical(robot_with(), log.command, STEP, ji.State(0.0, 0.0, 0.0, 0.0, 0.0))
    passed = np.stack(
        [np.sign(u) * np.maximum(np.abs(u) - zone, 0.0) for u, zone in zip(log.command, ZONE, strict=True)]
    )
    speed = follow_commands(log.t, passed.T, RATE[0], log.t)[1] @ GAIN[0] / RATE[0]
    np.testing.assert_allclose(speed, states.v, atol=1e-9)


def test_a_missing_row_and_a_second_run_change_little():
    log = join([driven(robot_with(), seed) for seed in (0, 1)])
    holes = np.arange(len(log.t)) % 7 == 0
    some = log._replace(wheel_r=np.where(holes, np.nan, log.wheel_r))
    whole, fewer = (ji.identify_motors(each, RADIUS, TRACK) for each in (log, some))
    deviation = np.sqrt(np.diagonal(whole.model.covariance))
    assert np.abs(fewer.drive.rate - whole.drive.rate).max() < 2.0 * deviation[:2].max()
    assert np.array_equal(np.isnan(fewer.measured[0]), holes)


@pytest.mark.parametrize(
    ("change", "mend"),
    [
        (lambda right, left: (left, right), "wheel_r=wheel_l,wheel_l=wheel_r"),
        (lambda right, left: (-right, -left), "wheel_r=wheel_r:-1,wheel_l=wheel_l:-1"),
        (lambda right, left: (right, -left), "wheel_l=wheel_l:-1"),
        (lambda right, left: (-right, left), "wheel_r=wheel_r:-1"),
    ],
)
def test_wheels_in_a_wrong_order_or_sign_are_told(change, mend):
    log = driven(robot_with(), 0)
    assert against(ji.identify_motors(log, RADIUS, TRACK)) == ()
    right, left = change(log.wheel_r, log.wheel_l)
    (line,) = against(ji.identify_motors(log._replace(wheel_r=right, wheel_l=left), RADIUS, TRACK))
    assert f"`--columns {mend}`" in line


def test_what_tells_nothing_of_motors_is_refused():
    log = driven(robot_with(), 0)
    noise = np.random.default_rng(0).normal(size=(2, ROWS))
    cases = [
        (log._replace(wheel_r=None, wheel_l=None), "no wheel speeds"),
        (log._replace(wheel_r=noise[0], wheel_l=noise[1]), "do not follow the commands"),
        (log.rows(0, 20), "20 rows with both wheel speeds: at least 50"),
        (log._replace(u_l=0.0 * log.u_l), "u_l is 0 throughout"),
    ]
    for bad, line in cases:
        with pytest.raises(ji.InputError, match=line):
            ji.identify_motors(bad, RADIUS, TRACK)
    with pytest.raises(ji.InputError, match="radius 0 m"):
        ji.identify_motors(log, 0.0, TRACK)

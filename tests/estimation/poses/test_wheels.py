"""Wheel speeds as a second sensor: what identify makes of them, against the truth and the bound."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxident as ji
from jaxident.array_types import Wheels
from jaxident.errors import InputError
from jaxident.estimation.poses.maximum_likelihood import fit_runs
from jaxident.estimation.poses.parameters import Law, names
from jaxident.estimation.poses.runs import Runs
from jaxident.estimation.uncertainty.precision import bound_covariance, natural_values
from jaxident.robot.drive import Physical
from jaxident.robot.wheel_sensor import WheelSensor, measure_wheels, wheel_rates
from jaxident.study.synthetic import excite, simulate_runs

SENSOR = WheelSensor(0.08, 0.2, 0.1)
DRIVE = Physical(np.array([3.0, 5.0]), np.array([[0.5, 0.4], [9.0, -8.5]]))
ROBOT = ji.Model(0.05, DRIVE, np.array([0.1, 0.12]), wheels=SENSOR)
NOISE = ji.Noise(1e-3, 5e-3)


def recorded(seed, rows=300, commands=None, noise=(1e-3, 5e-3), wheel_noise=0.1, robot=ROBOT):
    """A log of the robot with both sensors."""
    log = excite(jax.random.key(seed), "multilevel", rows, 0.05)
    log = log if commands is None else log._replace(u_r=commands(log)[0], u_l=commands(log)[1])
    return simulate_runs(robot, log, noise=noise, wheel_noise=wheel_noise, key=jax.random.key(seed + 1))


def word(found, name):
    return next(row.verdict for row in found.verdicts if row.parameter == name)


def test_wheels_turn_as_the_drive_moves_the_robot_and_not_as_it_slips():
    slipping = dataclasses.replace(ROBOT, noise=ji.Noise(0.0, 0.0, None, 0.05, 0.2))
    log = excite(jax.random.key(0), "multilevel", 200, 0.05)
    exact, slipped = (ji.simulate(slipping, log, key=key) for key in (None, jax.random.key(1)))
    assert not np.allclose(exact.x, slipped.x, atol=1e-3)
    np.testing.assert_allclose(np.std(slipped.wheel_r - exact.wheel_r), SENSOR.noise, rtol=0.2)
    turn = np.diff(np.unwrap(exact.theta)) / 0.05
    middle = 0.5 * (exact.wheel_r + exact.wheel_l)
    turning = (exact.wheel_r - exact.wheel_l) * SENSOR.radius / SENSOR.track
    np.testing.assert_allclose(turn, 0.5 * (turning[1:] + turning[:-1]), atol=0.02 * np.abs(turn).max())
    run = np.abs(turn) < 0.2
    path = np.hypot(np.diff(exact.x), np.diff(exact.y)) / 0.05
    speed = np.abs(0.5 * (middle[1:] + middle[:-1])) * SENSOR.radius
    np.testing.assert_allclose(path[run], speed[run], atol=0.02 * path.max())
    assert ji.simulate(dataclasses.replace(slipping, wheels=None), slipped).wheel_r is None


def test_both_sensors_find_the_robot_and_its_wheels(tmp_path):
    """Estimates within five deviations of the truth, tighter than from poses alone; and the file keeps them."""
    found = ji.identify(recorded(2), noise_law="white")
    told = {row.parameter: row for row in found.verdicts}
    truth = {"wheel_radius": 0.08, "wheel_track": 0.2, "wheel_noise": 0.1, "rate_1": 3.0, "gain_21": 9.0}
    for name, value in truth.items():
        assert told[name].verdict == "determined"
        assert abs(told[name].estimate - value) < 5.0 * (told[name].high - told[name].low) / 3.92
    ji.save_model(found.model, tmp_path / "m.json")
    again = ji.load_model(tmp_path / "m.json")
    assert again.wheels == found.model.wheels
    np.testing.assert_allclose(again.standard_deviation.wheels, found.model.standard_deviation.wheels)
    with pytest.raises(InputError, match="with wheel speeds draw whole 'runs'"):
        ji.bootstrap(jax.random.key(0), found, recorded(2))
    bound = ji.cramer_rao(ROBOT, recorded(2), NOISE)
    alone = ji.cramer_rao(ROBOT, recorded(2)._replace(wheel_r=None, wheel_l=None), NOISE)
    assert bound.order[-3:] == ("wheel_radius", "wheel_track", "wheel_noise")
    assert np.all(bound.standard_deviation[:8] < alone.standard_deviation[:8])
    np.testing.assert_allclose(np.sqrt(np.diagonal(found.covariance)), bound.standard_deviation, rtol=0.15)


@pytest.mark.parametrize(
    ("commands", "free"),
    [
        (lambda log: (log.u_r, log.u_r), "wheel_track"),
        (lambda log: (log.u_r, -log.u_r), "wheel_radius"),
    ],
    ids=["straight lines", "spins"],
)
def test_what_the_log_cannot_show_is_not_called_determined(commands, free):
    """The robot's wheels are alike here, so that it goes quite straight, or spins on the spot."""
    even = dataclasses.replace(ROBOT, dynamics=Physical(np.array([3.0, 5.0]), np.array([[0.5, 0.5], [9.0, -9.0]])),
                               dead_zone=np.array([0.1, 0.1]))  # fmt: skip
    found = ji.identify(recorded(4, commands=commands, robot=even), noise_law="white")
    assert word(found, free) in ("not determined", "from the prior")


def test_cells_may_be_empty_anywhere_and_a_bound_needs_noise():
    log = recorded(2)
    random = np.random.default_rng(0)
    holes = log._replace(wheel_r=np.where(random.random(300) < 0.5, np.nan, log.wheel_r),
                         wheel_l=np.where(random.random(300) < 0.5, np.nan, log.wheel_l))  # fmt: skip
    found = ji.identify(holes, noise_law="white")
    wide = ji.cramer_rao(ROBOT, holes, NOISE).standard_deviation
    np.testing.assert_allclose(np.sqrt(np.diagonal(found.covariance)), wide, rtol=0.2)
    with pytest.raises(InputError, match="noise above 0"):
        ji.cramer_rao(dataclasses.replace(ROBOT, wheels=None), log, NOISE)


def trials(count, rows, slip):
    """Standard errors over the bound, and whether 95 % intervals hold the truth: (trials, unknowns) each."""
    law = Law(slip=slip, wheels=True)
    noise = NOISE._replace(slip_along=0.02, slip_heading=0.1) if slip else NOISE
    robot = dataclasses.replace(ROBOT, noise=noise)
    log = excite(jax.random.key(7), "multilevel", rows, 0.05)
    command = Wheels(*(jnp.asarray(u)[None] for u in log.command))
    still = np.ones((1, rows), bool)

    def one(key):
        made = ji.simulate(robot, log, key=key)
        pose = type(made.pose)(*(column[None] for column in made.pose))
        runs = Runs(0.05, command, pose, still, Wheels(made.wheel_r[None], made.wheel_l[None]), Wheels(still, still))
        fit = fit_runs(runs, jnp.asarray(0.9), law)
        return natural_values(fit.robot, law), jnp.sqrt(jnp.diagonal(fit.covariance)), fit.ok, fit.starts

    values, deviation, ok, _ = jax.lax.map(one, jax.random.split(jax.random.key(8), count), batch_size=25)
    truth = jnp.array([3.0, 5.0, 0.5, 0.4, 9.0, -8.5, 0.1, 0.12, 1e-3, 5e-3, *((0.02, 0.1) if slip else ()), *SENSOR])
    vector = jnp.where(jnp.array([n in LOGS for n in names(law)]), jnp.log(jnp.abs(truth)), truth)
    blank = jnp.zeros((1, rows))
    runs = Runs(0.05, command, ji.Pose(blank, blank, blank), still, Wheels(blank, blank), Wheels(still, still))
    bound = jnp.sqrt(jnp.diagonal(bound_covariance(vector, jnp.zeros(5), runs, law)))
    error = values - truth
    return np.asarray(error / bound), np.asarray(jnp.abs(error) < 1.96 * deviation), np.asarray(ok)


LOGS = ("rate_1", "rate_2", "position", "heading", "slip_along", "slip_heading", "wheel_radius", "wheel_track",
        "wheel_noise")  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("slip", "count"), [(False, 1000), (True, 400)])
def test_errors_reach_the_bound_of_both_sensors_and_intervals_cover(slip, count):
    """Robots of 15 s. The ratio of root mean square to bound has a standard error of 2.2 % (1000 robots) or 3.5 %,
    of about 1.5 % over the ten numbers of robot and wheels, which hang together; their coverage one of 0.5 %."""
    error, covered, ok = trials(count, 300, slip)
    assert ok.mean() > 0.995
    ratio = np.sqrt(np.mean(error[ok] ** 2, axis=0))
    order = names(Law(slip=slip, wheels=True))
    robot = [k for k, name in enumerate(order) if k < 8 or name in ("wheel_radius", "wheel_track")]
    assert np.sqrt(np.mean(ratio[robot] ** 2)) < 1.05
    assert ratio[robot].max() < 1.15
    assert 0.93 < covered[ok][:, robot].mean() < 0.97


def test_a_sensor_without_error_reports_the_rim():
    v, w = np.array([1.0, -0.5]), np.array([2.0, 0.0])
    right, left = wheel_rates(SENSOR, v, w)
    np.testing.assert_allclose(right, (v + 0.1 * w) / 0.08)
    np.testing.assert_allclose(left, (v - 0.1 * w) / 0.08)
    np.testing.assert_array_equal(measure_wheels(SENSOR, v, w), [right, left])

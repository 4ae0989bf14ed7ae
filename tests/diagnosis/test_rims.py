"""Wheel speeds in a diagnosis: rims against differences of the simulator, the joint likelihood, logs without them."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support.small_robot import ROWS, RUNS, STEP, VECTOR, robot_with, windows_of

import jaxident as ji
from jaxident.diagnosis.causes.finding import find_effects
from jaxident.diagnosis.fit.refit import Data, refit
from jaxident.diagnosis.motion.linear import follow, linearise
from jaxident.diagnosis.motion.paths import track
from jaxident.diagnosis.motion.rims import first_noise, rim_speeds, rims_of, sized_noise, white_noise
from jaxident.diagnosis.motion.windows import cut
from jaxident.diagnosis.noise.law import Law, white_whitener
from jaxident.diagnosis.preparation.prepare import prepare, suspected_wheels
from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.coordinates import COORDINATES, PLACES, STEPPED, sizes
from jaxident.log import join, make_log
from jaxident.robot.noise import Noise
from jaxident.robot.wheel_sensor import WheelSensor

LAW, RADIUS, TRACK, NOISE = Law(2e-4, 2e-3), 0.03, 0.2, 0.02
AFTER = {"lateral_slip"}
"""Effects beside those of the camera that move the robot and no rim."""


def robot_windows(vector, rows=40, seed=3, noise=NOISE):
    """Windows with poses and wheel speeds that the follower makes of a vector."""
    rng = np.random.default_rng(seed)
    t = np.arange(ROWS) * STEP
    commands = [np.repeat(rng.uniform(-1.0, 1.0, (ROWS // 10, 2)), 10, axis=0) for _ in range(RUNS)]
    none = 0.0 * t
    logs = [make_log(t, u[:, 0], u[:, 1], none, none, none) for u in commands]
    whole, starts = cut(join(logs), ROWS), np.zeros((1, 5, RUNS))
    path = -follow(vector[None], starts, whole)[0].reshape(RUNS, ROWS, 3)
    path = path + rng.normal(size=path.shape) * [LAW.position, LAW.position, LAW.heading]
    v, w = np.split(rim_speeds(vector[None], starts, whole)[0], 2, axis=1)
    made = []
    for k, log in enumerate(logs):
        wheels = [(v[k] + s * 0.5 * w[k] * TRACK) / RADIUS + noise * rng.normal(size=ROWS) for s in (1.0, -1.0)]
        made.append(log._replace(x=path[k, :, 0], y=path[k, :, 1], theta=path[k, :, 2], wheel_r=wheels[0],
                                 wheel_l=wheels[1]))  # fmt: skip
    return cut(join(made), rows)


@pytest.fixture(scope="module")
def windows():
    return robot_windows(robot_with({("motor_lag", "time_constant"): 0.08}))


def first_starts(windows):
    starts = np.zeros((5, len(windows.run)))
    starts[:3] = windows.pose[0].T
    return starts


def joint(windows, fit):
    """Data of both sensors about a fit."""
    rims = rims_of(fit.linear.rims, np.exp(fit.vector[:2]), NOISE, windows)
    return Data(windows, white_whitener(LAW, windows), rims)


def first_pair(name):
    """The first coordinate of an effect by which there is a derivative."""
    return next(((name, c.name) for c in COORDINATES[name] if (name, c.name) not in STEPPED), None)


@pytest.mark.parametrize("name", sorted(name for name in COORDINATES if first_pair(name)))
def test_rims_answer_every_effect_as_central_differences_say(windows, name):
    """By the first coordinate that is no step, about a robot that has some of the effect."""
    pair = first_pair(name)
    place, step = PLACES[pair], 1e-4 * sizes()[PLACES[pair]]
    about = VECTOR.copy()
    for coordinate in COORDINATES[name]:
        about[PLACES[name, coordinate.name]] = coordinate.neutral + 0.3 * min(coordinate.size, 1.0)
    starts = first_starts(windows)
    starts[3:] = 0.1
    linear = linearise(about, starts, windows, [place])
    both = np.tile(about, (2, 1))
    both[:, place] += [-step, step]
    low, high = rim_speeds(both, np.tile(starts, (2, 1, 1)), windows)
    found, wanted = linear.rims.slopes[..., 0], (high - low) / (2.0 * step)
    apart = np.abs(found - wanted) > 1e-2 * np.abs(wanted).max() + 1e-6
    assert apart.mean() < 0.02  # corners of friction, play and steps of commands move by the step of a difference


def test_camera_and_slides_sideways_move_no_rim(windows):
    starts = first_starts(windows)
    starts[3:] = 0.2
    base = rim_speeds(VECTOR[None], starts[None], windows)[0]
    for name, coordinates in COORDINATES.items():
        moved = VECTOR.copy()
        moved[PLACES[name, coordinates[0].name]] += 0.3 * min(coordinates[0].size, 1.0)
        change = np.abs(rim_speeds(moved[None], starts[None], windows)[0] - base).max()
        if CATALOGUE[name].site == "camera" or name in AFTER:
            assert change == 0.0, name
        elif name in ("motor_lag", "turn_loss", "coulomb_friction", "transport_delay", "quadratic_drag"):
            assert change > 1e-3, name


def test_a_joint_fit_finds_the_lag_and_knows_it_better(windows):
    poses = refit(Data(windows, white_whitener(LAW, windows)), VECTOR, first_starts(windows), ())
    pair = ("motor_lag", "time_constant")
    alone, both = (refit(data, poses.vector, poses.starts, ("motor_lag",))
                   for data in (Data(windows, white_whitener(LAW, windows)), joint(windows, poses)))  # fmt: skip
    again = refit(joint(windows, both), both.vector, both.starts, ("motor_lag",))
    place = again.places.index(PLACES[pair])
    deviations = [float(np.sqrt(fit.covariance[place, place])) for fit in (alone, again)]
    assert deviations[1] < deviations[0]
    assert abs(again.vector[PLACES[pair]] - 0.08) < 4.0 * deviations[1]
    data = joint(windows, again)
    assert sized_noise(data.rims, again.linear.rims, windows) == pytest.approx(NOISE, rel=0.2)
    assert white_noise(windows) == pytest.approx(NOISE, rel=0.6)


def test_whitened_rims_forget_radius_track_and_the_rims_own_start(windows):
    starts = first_starts(windows)
    linear = linearise(VECTOR, starts, windows, [])
    rims = rims_of(linear.rims, np.exp(VECTOR[:2]), NOISE, windows)
    rows = len(windows.step)
    scaled = linear.rims.residual * np.repeat([1.3, 0.7], rows)
    left = rims.whitener @ (rims.scale * (scaled - linear.rims.residual))[..., None]
    assert np.abs(left).max() < 1e-6 * np.abs(rims.scale * scaled).max() / NOISE


@pytest.mark.parametrize(("sizes", "low", "high"), [({}, 0.8, 1.3), ({("motor_lag", "time_constant"): 0.08}, 3.0, 1e3)])
def test_what_a_first_fit_misses_counts_as_noise_of_the_wheels(sizes, low, high):
    """Before an effect is found the wheels may not outweigh the poses; without one their noise is what it is."""
    windows = robot_windows(robot_with(sizes))
    fit = refit(Data(windows, white_whitener(LAW, windows)), VECTOR, first_starts(windows), ())
    found = first_noise(fit.linear.rims, np.exp(fit.vector[:2]), windows)
    assert low * NOISE < found < high * NOISE


def test_a_slide_turns_the_rim_faster_than_the_ground():
    windows = robot_windows(VECTOR)
    sliding = robot_with({("traction_limit", "inverse_square"): 6.0, ("traction_limit", "dry"): 1.0,
                          ("traction_limit", "spin"): 0.05})  # fmt: skip
    starts = first_starts(windows)
    ground = np.asarray(jax.jit(track)(sliding, starts, jax.tree.map(jnp.asarray, windows)).v).T
    rim = rim_speeds(sliding[None], starts[None], windows)[0][:, : ground.shape[1]]
    assert np.abs(rim - ground).max() > 0.01


def test_a_window_without_wheel_speeds_counts_for_nothing(windows):
    blind = np.array(windows.turning)
    blind[:, 0] = False
    some = windows._replace(turning=blind)
    linear = linearise(VECTOR, first_starts(windows), some, [])
    rims = rims_of(linear.rims, np.exp(VECTOR[:2]), NOISE, some)
    assert not rims.whitener[0].any()
    assert rims.whitener[1].any()


def test_logs_without_the_columns_have_no_rims():
    windows = windows_of(VECTOR)
    assert windows.wheels is None
    assert windows.turning is None
    linear = linearise(VECTOR, first_starts(windows), windows, [0])
    assert linear.rims is None
    assert Data(windows, None).of_rims(linear.rims, residual=True) is None


@pytest.mark.slow
def test_a_search_uses_wheel_speeds_and_sets_those_aside_that_contradict_the_poses():
    robot = dataclasses.replace(ji.load_model("published"), effects=(ji.Effect("motor_lag", {"time_constant": 0.08}),),
                                noise=Noise(0.001, 0.005), wheels=WheelSensor(0.03, 0.1, 0.1))  # fmt: skip
    key = jax.random.key(2)
    log = ji.simulate(robot, ji.excite(key, "multilevel", 900, robot.sample_period), key=key)
    log = type(log)(*(None if column is None else np.asarray(column) for column in log))
    prepared = prepare(log, None)
    _, finding = find_effects(prepared)
    assert finding.selected == ("motor_lag",)
    assert finding.data.rims is not None
    assert finding.law.wheel == pytest.approx(0.1, rel=0.3)
    backward = log._replace(wheel_r=-log.wheel_r, wheel_l=-log.wheel_l)
    assert prepare(backward, None).windows.wheels is None
    assert "wrong sign" in suspected_wheels(backward)[0]

"""Wheel speeds of a robot whose wheels slide: by hand, and beside the fast integrator of a diagnosis."""

import dataclasses

import jax
import numpy as np
import pytest

import jaxident as ji
from jaxident.diagnosis.motion.rims import rim_speeds
from jaxident.diagnosis.motion.windows import cut
from jaxident.effects.coordinates import vector_of
from jaxident.log import make_log
from jaxident.robot.drive import Physical
from jaxident.robot.wheel_sensor import WheelSensor

RATE, GAIN, STEP, SENSOR = 4.0, 2.0, 0.02, WheelSensor(0.05, 0.3)
STRAIGHT = ji.Model(STEP, Physical(np.array([RATE, 5.0]), np.array([[GAIN, GAIN], [20.0, -20.0]])), np.zeros(2),
                    wheels=SENSOR)  # fmt: skip


def sliding(model, limit: float, spin: float):
    """The robot on ground that takes so much of a wheel's net push."""
    law = ji.Effect("traction_limit", {"limit": limit, "dry": 1.0, "spin": spin})
    return dataclasses.replace(model, effects=(law,))


def by_hand(command: np.ndarray, limit: float, spin: float, parts: int = 200) -> np.ndarray:
    """Rim speed less ground speed [m/s] of a robot that drives straight: v' = gain of what the ground takes, and
    spin e' = c - limit - e while the wheel slides."""
    v = e = 0.0
    found = []
    for u in command:
        found.append(2.0 * GAIN * e / RATE)
        for _ in range(parts):
            h, c = STEP / parts, u - RATE * v / (2.0 * GAIN)
            slides = abs(c) > limit or e != 0.0
            side = np.sign(e) if e != 0.0 else np.sign(c)
            push = side * limit if slides else c
            v += h * 2.0 * GAIN * push
            after = e + h * (c - side * limit - e) / spin if slides else 0.0
            e = after if side * after > 0.0 else 0.0
    return np.array(found)


def test_a_wheel_that_slides_turns_faster_by_what_the_ground_does_not_take():
    command = np.repeat([1.0, -1.0, 0.2], 30)
    log = make_log(STEP * np.arange(90), command, command)
    made = ji.simulate(sliding(STRAIGHT, 0.4, 0.05), log)
    ground = np.gradient(np.asarray(made.x), STEP)
    rim = SENSOR.radius * np.asarray(made.wheel_r)
    wanted = by_hand(command, 0.4, 0.05)
    assert wanted.max() > 0.2
    inner = np.abs(np.diff(command, prepend=1.0, append=0.2)[:-1] + np.diff(command, append=0.2)) == 0.0
    np.testing.assert_allclose((rim - ground)[inner][1:-1], wanted[inner][1:-1], atol=0.03)
    np.testing.assert_allclose(made.wheel_r, made.wheel_l)


def test_without_sliding_a_wheel_turns_as_the_robot_rolls():
    command = np.repeat([0.2, -0.2, 0.1], 30)
    log = make_log(STEP * np.arange(90), command, 0.5 * command)
    free, limited = ji.simulate(STRAIGHT, log), ji.simulate(sliding(STRAIGHT, 5.0, 0.05), log)
    np.testing.assert_allclose(limited.wheel_r, free.wheel_r, atol=1e-6)
    np.testing.assert_allclose(limited.wheel_l, free.wheel_l, atol=1e-6)


def test_a_tyre_that_only_yields_lets_no_wheel_turn_faster():
    """Though the command is five times the limit."""
    command = np.repeat([1.0, -1.0, 0.2], 30)
    log = make_log(STEP * np.arange(90), command, command)
    yields = dataclasses.replace(STRAIGHT, effects=(ji.Effect("traction_limit", {"limit": 0.2}),))
    made = ji.simulate(yields, log)
    rim, ground = SENSOR.radius * np.asarray(made.wheel_r), np.gradient(np.asarray(made.x), STEP)
    np.testing.assert_allclose(rim[1:-1], ground[1:-1], atol=0.01)


@pytest.mark.parametrize("spin", [0.0, 0.05])
def test_the_fast_integrator_has_the_same_rims(spin):
    model = sliding(ji.load_model("published"), 0.5, spin)
    model = dataclasses.replace(model, wheels=SENSOR)
    log = ji.excite(jax.random.key(3), "multilevel", 300, model.sample_period)
    made = ji.simulate(model, log)
    made = type(made)(*(None if column is None else np.asarray(column) for column in made))
    windows = cut(made, 300)
    found = rim_speeds(vector_of(model)[None], np.zeros((1, 5, 1)), windows)[0][0]
    mean, half = found[: len(log.t)], found[len(log.t) :]
    rims = (mean + 0.5 * half * SENSOR.track) / SENSOR.radius
    held = np.diff(log.u_r, prepend=log.u_r[0]) == 0.0  # at a switch a wheel without inertia jumps: both are right
    scale = np.abs(made.wheel_r).max()
    assert np.sqrt(np.mean((rims - made.wheel_r)[held] ** 2)) < 0.005 * scale

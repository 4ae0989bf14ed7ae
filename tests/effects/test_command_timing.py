"""Commands that a base polls or is told as a twist: what their laws say at the corners."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support.effect_robots import ROBOT, START, drive_log, poses

import jaxident as ji
from jaxident.array_types import Wheels
from jaxident.effects.commands import command_polling, twist_quantisation
from jaxident.effects.coordinates import PLACES, by_effect, neutral_vector, nominal_vector
from jaxident.effects.fast_input import pushes
from jaxident.effects.fast_motion import drive_of
from jaxident.robot.model import Effect

PERIOD = float(ROBOT.sample_period)


@pytest.mark.parametrize("offset", [0.0, 17.3])
def test_a_command_waits_for_the_next_reading(offset):
    time = jnp.asarray(np.sort(np.random.default_rng(0).uniform(0.0, 10.0, 500)))
    acts = command_polling(time, offset, 0.07, 0.3)
    readings = (np.arange(400) + 0.3) * 0.07 - offset
    wanted = readings[np.searchsorted(readings, time)]
    np.testing.assert_allclose(acts, wanted, atol=1e-9)
    assert np.all(np.diff(acts) >= 0.0)


def test_a_command_at_a_reading_does_not_wait_whatever_the_rounding():
    time = 0.1 * np.arange(1000)
    np.testing.assert_allclose(command_polling(jnp.asarray(time), 0.0, 0.1, 0.0), time, atol=1e-9)
    np.testing.assert_array_equal(command_polling(jnp.asarray(time), 3.0, 0.0, 0.4), time)


def simulated(*effects):
    return poses(ji.simulate(dataclasses.replace(ROBOT, effects=effects), drive_log(), start=START))


def test_readings_as_often_as_commands_are_a_delay():
    polled = simulated(Effect("command_polling", {"period": PERIOD, "phase": 0.4}))
    late = simulated(Effect("transport_delay", {"delay": 0.4 * PERIOD}))
    np.testing.assert_allclose(polled, late, atol=1e-6)
    assert np.abs(polled - simulated()).max() > 1e-3


def pushed(command, **values):
    """Pushes (rows, substeps, 2) of one run of commands (rows, 2), 0.03 s apart."""
    vector = neutral_vector(nominal_vector(ROBOT.physical, np.zeros(2)))
    for name, own in values.items():
        for key, value in own.items():
            vector[PLACES[name, key]] = value
    t = 0.03 * np.arange(len(command))[:, None]
    return np.asarray(_pushed(vector, t, np.array([0.5]), command[:, None])[:, 0])


@jax.jit
def _pushed(vector, t, session, command):
    return pushes(by_effect(vector), drive_of(vector), jnp.zeros(2), t, session, command).mean


def test_the_fast_program_holds_what_was_read_last():
    """Means over substeps against a fine sum over time."""
    command = np.random.default_rng(1).uniform(-1.0, 1.0, (60, 2))
    found = pushed(command, command_polling={"period": 0.05, "phase": 0.3}, transport_delay={"delay": 0.012})
    time = (np.arange(60 * 2 * 3000) + 0.5) * 0.015 / 3000
    reading = (np.floor((time + 0.5) / 0.05 - 0.3) + 0.3) * 0.05 - 0.5
    row = np.floor((reading - 0.012) / 0.03 + 1e-9).astype(int)
    held = np.where(row[:, None] >= 0, command[np.maximum(row, 0)], 0.0)
    wanted = held.reshape(60, 2, 3000, 2).mean(axis=2)
    assert np.abs(found - wanted)[:-1].max() < 2e-3
    assert np.abs(found - pushed(command)).max() > 0.5


def test_a_twist_in_whole_steps():
    rng = np.random.default_rng(3)
    u = Wheels(*jnp.asarray(rng.uniform(-1.0, 1.0, (2, 200))))
    told = twist_quantisation(u, 0.1, 0.25)
    for value, step, was in (
        (0.5 * (told.right + told.left), 0.1, 0.5 * (u.right + u.left)),
        (told.right - told.left, 0.25, u.right - u.left),
    ):
        np.testing.assert_allclose(value / step, np.round(value / step), atol=1e-12)
        assert np.abs(value - was).max() <= 0.5 * step + 1e-12
    again = twist_quantisation(told, 0.1, 0.25)
    np.testing.assert_allclose(again, told, atol=1e-12)
    straight = twist_quantisation(u, 0.0, 0.25)
    np.testing.assert_allclose(straight.right + straight.left, u.right + u.left, atol=1e-12)
    np.testing.assert_array_equal(twist_quantisation(u, jnp.array(0.0), jnp.array(0.0)), u)

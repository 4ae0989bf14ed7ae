"""The engine's robot: what must hold exactly whatever the engine does within a step."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

from withheld.engine_robot import cases as engine_cases
from withheld.engine_robot import drive as engine_robot
from withheld.engine_robot import world as engine_world
from withheld.engine_robot.drive import Driver, simulate
from withheld.engine_robot.world import Body
from withheld.protocol import robots

PERIOD, ROWS, START = 0.02, 61, (0.1, -0.2, 0.7)
COMMANDS = robots.draw_commands(np.random.default_rng(3), ROWS)
COMMANDS[:8] = 0.8, 0.5


def run(body=None, driver=None, **options):
    return simulate(body or Body(), driver or Driver(), PERIOD, COMMANDS, START, **options)


@pytest.fixture(scope="module")
def plain():
    return run()


def test_it_drives_forward_and_turns_left_at_more_on_the_right(plain):
    assert np.allclose(plain[0], START, atol=1e-6)
    ahead = (plain[8, :2] - plain[0, :2]) @ [np.cos(0.7), np.sin(0.7)]
    assert ahead > 1e-3
    assert plain[8, 2] > plain[0, 2]


def test_late_commands_move_the_whole_path(plain):
    late = run(driver=Driver(delay=2 * PERIOD))
    assert np.abs(late[2:] - plain[:-2]).max() < 1e-6


def test_a_marker_aside_sits_on_the_body(plain):
    moved = run(Body(marker=(0.03, -0.02), turned=0.1))
    cosine, sine = np.cos(plain[:, 2]), np.sin(plain[:, 2])
    expected = plain + np.stack([0.03 * cosine + 0.02 * sine, 0.03 * sine - 0.02 * cosine, np.full(ROWS, 0.1)], axis=1)
    assert np.abs(moved - expected).max() < 1e-3  # the chassis nods a little


def test_a_payload_counts_from_its_instant_on(plain):
    later = run(driver=Driver(payload=2.0, instant=10.0 + 30 * PERIOD), session_time=10.0)
    assert np.array_equal(later[:31], plain[:31])
    assert np.abs(later[-1] - plain[-1]).max() > 1e-3


def test_air_slows_the_body_and_not_the_rotors_of_loose_gears(plain):
    """A rotor whose inertia was its light body's stood for a box of metres to the air, and held the robot."""
    thick, loose = run(Body(air=600.0)), run(Body(air=600.0, play=(1e-3, 1e-3)))
    assert np.abs(thick - plain)[:, :2].max() > 2e-3
    assert np.abs(loose - thick).max() < 0.05 * np.abs(thick - plain).max()


def test_wheels_that_slide_move_the_robot_the_same_at_half_the_engine_s_step(monkeypatch, plain):
    """Without springs the wheels hop on the floor, and half the step moves the robot by 6 mm in this second."""
    slippery = Body(grip=0.05)
    whole, half = run(slippery), 0.5 * engine_world.TIMESTEP
    for module in (engine_world, engine_robot):
        monkeypatch.setattr(module, "TIMESTEP", half)
    assert np.abs(whole - plain)[:, :2].max() > 0.02
    assert np.abs(whole - run(slippery))[:, :2].max() < 5e-4


@pytest.mark.parametrize("name", list(engine_cases.LAWS))
def test_every_hidden_effect_moves_the_robot(name):
    case = engine_cases.describe(7, [name], slip=False, sim=False)
    draws = {"period": PERIOD, "u": COMMANDS, "start": START, "session_time": 0.9 * case["session"], "slip": None}
    logs = [
        engine_cases.drive_run(case, draws | {"noise": None, "effects": {}, "rng": None}, changed=changed)
        for changed in (False, True)
    ]
    assert np.nanmax(np.abs(logs[1] - logs[0])[:, 3:]) > 1e-4

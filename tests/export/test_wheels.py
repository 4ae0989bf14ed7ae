"""The robot of wheels and masses has the eight numbers of the model, no more and no less."""

import dataclasses

import numpy as np
import pytest

import jaxident as ji
from jaxident.errors import InputError
from jaxident.export.wheels import body_of, robot_of
from jaxident.robot.difference import to_difference
from jaxident.robot.drive import Physical
from jaxident.robot.model import Model

ZONES = np.array([0.1, 0.12])
DRIVES = {
    "coupled": Physical(np.array([4.0, 6.0]), np.array([[1.2, 1.1], [9.0, -8.5]]), np.array([0.02, -1.0])),
    "plain": Physical(np.array([4.0, 6.0]), np.array([[1.2, 1.1], [9.0, -8.5]])),
    "equal rates": Physical(np.array([5.0, 5.0]), np.array([[1.2, 1.1], [9.0, -8.5]])),
    "published": ji.load_model("published").physical,
}


def motion_of(robot) -> tuple[np.ndarray, np.ndarray]:
    """The matrix of speeds and the gain that Newton's laws give this robot."""
    wheels = (robot.right, robot.left)
    arms = np.array([[1.0, 1.0], [-wheel.place for wheel in wheels]])
    braking = arms @ np.diag([wheel.braking for wheel in wheels]) @ arms.T
    system = -np.linalg.solve(robot.masses, braking)
    return system, np.linalg.solve(robot.masses, arms @ np.diag([wheel.force for wheel in wheels]))


@pytest.mark.parametrize("name", DRIVES)
@pytest.mark.parametrize(("mass", "radius"), [(1.0, None), (23.0, 0.1)])
def test_newton_gives_the_model_back(name, mass, radius):
    drive = DRIVES[name]
    robot = robot_of(Model(0.03, drive, ZONES), mass, radius)
    system, gain = motion_of(robot)
    coupling = np.zeros(2) if drive.coupling is None else np.asarray(drive.coupling)
    wanted = np.array([[-drive.rate[0], coupling[0]], [coupling[1], -drive.rate[1]]])
    np.testing.assert_allclose(system, wanted, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(gain, drive.gain, rtol=1e-9)
    assert robot.masses[0, 0] == pytest.approx(mass)
    assert robot.track > 0.0
    if radius is not None:
        assert robot.radius == radius


@pytest.mark.parametrize("name", DRIVES)
def test_chassis_and_rolling_wheels_add_up(name):
    robot = robot_of(Model(0.03, DRIVES[name], ZONES))
    body = body_of(robot)
    total = body.mass * np.array([[1.0, -body.left], [-body.left, body.left**2]]) + np.diag([0.0, body.inertia])
    for wheel in (robot.right, robot.left):
        rolling = body.wheel_mass + body.wheel_spin / robot.radius**2
        total += rolling * np.array([[1.0, -wheel.place], [-wheel.place, wheel.place**2]])
        total[1, 1] += body.wheel_turn
    np.testing.assert_allclose(total, robot.masses, rtol=1e-9, atol=1e-12)
    assert min(body.mass, body.inertia, body.wheel_mass, body.wheel_spin, body.wheel_turn) > 0.0


def test_a_coupling_that_no_masses_give_is_left_out():
    odd = Model(0.03, DRIVES["equal rates"]._replace(coupling=np.array([0.5, 0.5])), ZONES)
    robot = robot_of(odd)
    assert not robot.coupled
    np.testing.assert_allclose(motion_of(robot)[0], np.diag([-5.0, -5.0]), atol=1e-9)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"gain": np.array([[1.1, 1.2], [-8.5, 9.0]])}, "right wheel should drive forward"),
        ({"gain": np.array([[-1.1, 1.2], [9.0, -8.5]])}, "right wheel should drive forward"),
        ({"gain": np.array([[1.0, 1.0], [2.0, 2.0]])}, "right wheel should drive forward"),
        ({"rate": np.array([0.0, 5.0])}, "rates above 0"),
    ],
)
def test_what_no_wheels_can_do_is_refused(change, word):
    with pytest.raises(InputError, match=word):
        robot_of(Model(0.03, DRIVES["plain"]._replace(**change), ZONES))


def test_free_numerators_are_refused():
    model = Model(0.03, DRIVES["plain"], ZONES)
    with pytest.raises(InputError, match="physical"):
        robot_of(dataclasses.replace(model, dynamics=to_difference(DRIVES["plain"], 0.03)))

"""The robot of two driven wheels that moves exactly as a model of speeds says.

A model [v, w]' = A [v, w] + gain m has eight numbers; so have two motors, two places of wheels, and the masses:

* Steady speeds G = -A^-1 gain. The left wheel stands still where the right one alone turns the robot about it: its
  place is y_l = G_vr / G_wr to the left of the tracked point, and so y_r = G_vl / G_wl. The rim of a wheel runs at
  s = v - y w; its speed per unit of command is k_r = G_vr - y_r G_wr.
* Motors: the force at the rim is D (k m - s), braking D for each wheel.
* Masses: M A = -B diag(D) B^T, B = [[1, 1], [-y_r, -y_l]], makes M. It is symmetric, and so the mass, inertia and
  centre of mass of a robot, where D_r h(y_r) + D_l h(y_l) = 0 with h(y) = c_v + y (rate_w - rate_v) - c_w y^2.

The scale of all forces and masses is free: a path does not show it.
"""

from typing import NamedTuple

import numpy as np

from jaxident.errors import InputError
from jaxident.robot.model import Model, require_physical

MASS = 1.0
"""[kg], where none is given: no path depends on it."""
RADIUS_PER_TRACK = 0.2
"""Wheel radius where none is given; no path depends on it either."""


class Wheel(NamedTuple):
    """place: metres to the left of the tracked point. speed: of the rim [m/s] per unit of command. braking: force at
    the rim per its speed [N s/m]. force: at the rim per unit of command [N]."""

    place: float
    speed: float
    braking: float
    force: float


class Robot(NamedTuple):
    """right, left: Wheel. masses (2, 2): force along [N] and moment about the tracked point [N m] per acceleration
    along and in heading, rolling wheels included. radius [m] of the wheels. coupled: whether the coupling is in it."""

    right: Wheel
    left: Wheel
    masses: np.ndarray
    radius: float
    coupled: bool

    @property
    def track(self) -> float:
        """Distance of the wheels [m]."""
        return self.left.place - self.right.place


def robot_of(model: Model, mass: float = MASS, radius: float | None = None) -> Robot:
    """The robot of a mass [kg] and a wheel radius [m]. Where no masses give the coupling, it is left out (`coupled`).

    InputError for a model of free numerators, and for one that no two wheels can drive: rates that are not positive,
    wheels that are swapped, run backwards, or do the same.
    """
    drive = require_physical(model)
    rate, gain = np.asarray(drive.rate, float), np.asarray(drive.gain, float)
    coupling = np.zeros(2) if drive.coupling is None else np.asarray(drive.coupling, float)
    if not np.all(rate > 0.0):
        raise InputError(f"physical.rate: is {rate.tolist()}; a robot on wheels needs rates above 0")
    found = _robot(rate, gain, coupling, mass, radius)
    if found is None and np.any(coupling):
        found = _robot(rate, gain, np.zeros(2), mass, radius)
    if found is None:
        raise InputError(
            "physical.gain: no robot with two driven wheels moves like this; the right wheel should drive forward and "
            "turn left, the left one drive forward and turn right (python, c-header and table take any model)"
        )
    return found


def _robot(rate, gain, coupling, mass: float, radius: float | None) -> Robot | None:
    """The robot, or None where there is none."""
    system = np.array([[-rate[0], coupling[0]], [coupling[1], -rate[1]]])
    if not np.linalg.det(system) > 0.0 or abs(np.linalg.det(gain)) == 0.0:
        return None
    steady = -np.linalg.solve(system, gain)
    if not (steady[1, 0] > 0.0 > steady[1, 1] and np.all(steady[0] > 0.0)):
        return None
    places = np.array([steady[0, 1] / steady[1, 1], steady[0, 0] / steady[1, 0]])
    speeds = steady[0] - places * steady[1]
    weight = coupling[0] + places * (rate[1] - rate[0]) - coupling[1] * places**2
    ratio = np.array([weight[1], -weight[0]]) * np.sign(weight[1] or 1.0)
    braking = np.ones(2) if not np.any(weight) else ratio
    if not np.all(braking > 0.0):
        return None
    shape = np.array([[1.0, 1.0], -places])
    masses = -(shape * braking) @ shape.T @ np.linalg.inv(system)
    masses = 0.5 * (masses + masses.T)
    scale = mass / masses[0, 0]
    if not np.all(np.linalg.eigvalsh(scale * masses) > 0.0):
        return None
    right, left = (
        Wheel(float(y), float(k), float(scale * d), float(scale * d * k))
        for y, k, d in zip(places, speeds, braking, strict=True)
    )
    own = RADIUS_PER_TRACK * float(places[1] - places[0]) if radius is None else radius
    return Robot(right, left, scale * masses, own, bool(np.any(coupling)))


class Body(NamedTuple):
    """What is left for the chassis once the wheels have their masses: mass [kg], centre to the left [m], inertia about
    it [kg m^2]; and each wheel's mass [kg], its inertia about its axle and across it [kg m^2]."""

    mass: float
    left: float
    inertia: float
    wheel_mass: float
    wheel_spin: float
    wheel_turn: float


LIGHT = 0.1
"""Largest part that the wheels take of the robot's mass and of its inertia."""


def body_of(robot: Robot) -> Body:
    """Masses of chassis and wheels that add up to the robot's."""
    places = np.array([robot.right.place, robot.left.place])
    parts = np.array([[1.0, 1.0], -places])
    own_turn = 0.25 * robot.radius**2
    unit = 1.5 * parts @ parts.T + np.diag([0.0, 2.0 * own_turn])  # 1.5: a rolling disc's mass and spin
    largest = np.linalg.eigvals(np.linalg.solve(robot.masses, unit)).real.max()
    wheel = LIGHT / float(largest)
    rest = robot.masses - wheel * unit
    left = -rest[0, 1] / rest[0, 0]
    return Body(
        mass=float(rest[0, 0]), left=float(left), inertia=float(rest[1, 1] - rest[0, 0] * left**2), wheel_mass=wheel,
        wheel_spin=0.5 * wheel * robot.radius**2, wheel_turn=own_turn * wheel,
    )  # fmt: skip

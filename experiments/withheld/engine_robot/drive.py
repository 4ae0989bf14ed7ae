"""Runs of the engine's robot: what the camera would see without error, under commands that pass a motor driver."""

from typing import NamedTuple

import mujoco
import numpy as np

from .world import TIMESTEP, Body, world


class Driver(NamedTuple):
    """Between the command and the motors: dead zones, and what can be wrong there and with the supply."""

    dead_zone: tuple[float, float] = (0.1, 0.1)
    delay: float = 0.0  # [s]
    ceiling: float = np.inf  # of |u|: the voltage at hand
    resistance: float = 0.0  # of the battery: m / (1 + s (|u_r| + |u_l|))
    discharge: float = 0.0  # [1/s] of session time
    payload: float = 1.0  # masses and inertias times this ...
    instant: float = np.inf  # ... from this session time on [s]


def simulate(body: Body, driver: Driver, period: float, u, start, session_time: float = 0.0, shove=None):
    """Poses (rows, 3) of the marker, from rest at start (x, y, theta).

    period [s] must be a multiple of the engine's step. u: commands (rows, 2), right then left. shove: random
    acceleration along and in heading (rows, 2), as a force and a torque on the chassis.
    """
    model = mujoco.MjModel.from_xml_string(world(body))
    data = mujoco.MjData(model)
    place(model, data, start)
    steps, late = round(period / TIMESTEP), round(driver.delay / TIMESTEP)
    times = TIMESTEP * np.arange(steps * (len(u) - 1)) + session_time
    pushes = drive(driver, delayed(u, steps, late), times)
    changed = times >= driver.instant
    poses = [look(model, data)]
    for row in range(len(u) - 1):
        if shove is not None:
            push(model, data, shove[row])
        for step in range(row * steps, (row + 1) * steps):
            if changed[step] and not (step and changed[step - 1]):
                load(model, data, driver.payload)
            data.ctrl[:] = pushes[step]
            mujoco.mj_step(model, data)
        poses.append(look(model, data))
    return np.array(poses)


def place(model, data, start) -> None:
    """The robot at rest at x, y, theta, settled on the floor."""
    x, y, theta = start
    data.qpos[0:2] = x, y
    data.qpos[3:7] = np.cos(0.5 * theta), 0.0, 0.0, np.sin(0.5 * theta)
    tilted = np.array(model.opt.gravity)
    model.opt.gravity[:2] = 0.0  # else it rolls away before the log begins
    for _ in range(300):
        mujoco.mj_step(model, data)
    model.opt.gravity[:] = tilted
    data.qvel[:] = 0.0
    data.time = 0.0
    mujoco.mj_forward(model, data)


def load(model, data, ratio: float) -> None:
    """Another payload: all masses and inertias times a ratio, those on the motors' shafts too."""
    model.body_mass[:] *= ratio
    model.body_inertia[:] *= ratio
    model.dof_armature[:] *= ratio
    mujoco.mj_setConst(model, mujoco.MjData(model))


def push(model, data, shove) -> None:
    """A force along the chassis and a torque on it that would move its mass and inertia so."""
    chassis = model.body("chassis").id
    ahead = data.xmat[chassis].reshape(3, 3)[:2, 0]
    data.xfrc_applied[chassis, :2] = shove[0] * model.body_subtreemass[chassis] * ahead
    data.xfrc_applied[chassis, 5] = shove[1] * model.body_inertia[chassis, 2]


def look(model, data):
    """Pose (3,) of the marker.

    The engine moves positions with the speed at the end of its step, half a step too far: the camera takes that back,
    or the plain robot would hear commands half a millisecond early.
    """
    there = data.qpos.copy()
    mujoco.mj_integratePos(model, data.qpos, data.qvel, -0.5 * TIMESTEP)
    mujoco.mj_kinematics(model, data)
    marker, turn = data.site("marker").xpos, data.site("marker").xmat.reshape(3, 3)
    seen = np.array([marker[0], marker[1], np.arctan2(turn[1, 0], turn[0, 0])])
    data.qpos[:] = there
    mujoco.mj_kinematics(model, data)
    return seen


def delayed(u: np.ndarray, steps: int, late: int) -> np.ndarray:
    """Commands (rows, 2) at every step of the engine, `late` steps later, zero before the first."""
    fine = np.repeat(u[:-1], steps, axis=0)
    return np.concatenate([np.zeros((late, 2)), fine])[: len(fine)]


def drive(driver: Driver, u: np.ndarray, session_time: np.ndarray) -> np.ndarray:
    """What the motors are given (steps, 2)."""
    u = np.clip(u, -driver.ceiling, driver.ceiling)
    m = np.sign(u) * np.maximum(np.abs(u) - driver.dead_zone, 0.0)
    m = m * np.maximum(1.0 + driver.discharge * session_time, 0.0)[:, None]
    return m / (1.0 + driver.resistance * np.abs(u).sum(axis=1, keepdims=True))

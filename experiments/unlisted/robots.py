"""A simulator of robots whose effect stands in no catalogue: small steps of the midpoint rule, NumPy alone.

Each kind adds accelerations, or changes what drives the wheels. A driver leads the robot from one random place in a
room to the next.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

STEP, ROWS, RUNS, FRESH, SUBSTEPS = 0.05, 1000, 6, 4, 8
ROOM = 0.8
"""Half the side of the room [m]."""
NOISE = (4e-4, 3e-3)
"""Camera noise [m, rad]."""
HEAT_TIME = 6.0
"""Of the motors [s]."""
SLIP = (0.003, 0.015)
"""Density of random accelerations along [m/s^1.5] and in heading [rad/s^1.5]."""


class Now(NamedTuple):
    """State and input of all runs (runs,): pose, speeds, net pushes of both wheels, travelled angle of both [rad], heat
    of both motors, time since v last changed its sign [s], session time [s]; net pushes by the commands before, and
    the time [s] since they changed; speed of both rims [m/s]."""

    x: np.ndarray
    y: np.ndarray
    theta: np.ndarray
    v: np.ndarray
    w: np.ndarray
    push: np.ndarray
    angle: np.ndarray
    heat: np.ndarray
    since: np.ndarray
    time: np.ndarray
    older: np.ndarray
    age: np.ndarray
    rim: np.ndarray


Added = tuple[np.ndarray | float, np.ndarray | float]
"""Accelerations along [m/s^2] and in heading [rad/s^2]."""


def _patch(now: Now, size: float, rng) -> Added:
    """A round carpet slows both motions."""
    inside = 1.0 / (1.0 + np.exp(np.clip((np.hypot(now.x - 0.2, now.y + 0.1) - 0.35) / 0.01, -50, 50)))
    return -3.0 * size * inside * now.v, -3.0 * size * inside * now.w


def _swirl(now: Now, size: float, rng) -> Added:
    """The nap of a carpet turns the robot: more the farther it is from the middle of the room, by its direction."""
    return 0.0, 4.0 * size * now.v * (now.x * np.cos(now.theta) + now.y * np.sin(now.theta))


def _saddle(now: Now, size: float, rng) -> Added:
    """A floor like a saddle: it pulls by place and direction at once."""
    return 0.5 * size * (now.x * np.cos(now.theta) - now.y * np.sin(now.theta)), 0.0


def _turning(now: Now, size: float, rng) -> Added:
    """Speed is lost with the square of the turn rate."""
    return -0.4 * size * now.w**2 * now.v, 0.0


def _friction(now: Now, size: float, rng) -> Added:
    """A rubbing seal: a drag that hardly grows with speed."""
    along, heading = (np.sign(speed) * np.abs(speed / slow) ** 0.4 for speed, slow in ((now.v, 0.1), (now.w, 1.0)))
    return -0.25 * size * along, -1.0 * size * heading


def _coupled(now: Now, size: float, rng) -> Added:
    """Each motion is slowed by the other one's size."""
    return -1.5 * size * np.abs(now.w) * now.v, -6.0 * size * np.abs(now.v) * now.w


def _castor(now: Now, size: float, rng) -> Added:
    """A castor that swings round after a reversal holds the robot back for a while."""
    swing = np.exp(-now.since / 0.4)
    return -5.0 * size * swing * now.v, 2.0 * size * swing * np.sign(now.v)


def _rub(now: Now, size: float, rng) -> Added:
    """From 160 s of the session on something rubs: a drag of the speed alone."""
    return np.where(now.time > 160.0, -2.0 * size * now.v, 0.0), 0.0


def _bumps(now: Now, size: float, rng) -> Added:
    """Blows at random: not to be predicted."""
    hit = rng.random(now.v.shape) < 0.4 * STEP / SUBSTEPS
    return 0.0 * now.v, np.where(hit, rng.normal(size=now.v.shape) * 1.0 * size / (STEP / SUBSTEPS), 0.0)


def _none(now: Now, size: float, rng) -> Added:
    return 0.0, 0.0


def _hot(push: np.ndarray, now: Now, size: float) -> np.ndarray:
    """Motors that get hot push less."""
    return push / (1.0 + 2.0 * size * now.heat)


def _cogs(push: np.ndarray, now: Now, size: float) -> np.ndarray:
    """Magnets of the motor pull the wheel from tooth to tooth, seven to a turn."""
    return push + 0.3 * size * np.sin(7.0 * now.angle)


def _oval(push: np.ndarray, now: Now, size: float) -> np.ndarray:
    """A wheel that is not round, as a drive sees it: its gain goes with the wheel's angle."""
    return push * np.stack([1.0 + 0.4 * size * np.sin(now.angle[0]), np.ones_like(now.v)])


def _late(push: np.ndarray, now: Now, size: float) -> np.ndarray:
    """A busy link: commands arrive the later, the faster the robot is, 0.2 s at 1 m/s."""
    return np.where(now.age < 0.2 * size * np.abs(now.v), now.older, push)


def _brakes(push: np.ndarray, now: Now, size: float) -> np.ndarray:
    """A driver that lets its motors run out: a push against the wheel's speed is half as large, beyond 0.03 m/s."""
    return push * (1.0 - 0.5 * size * np.clip(-np.sign(push) * now.rim / 0.03, 0.0, 1.0))


def _play(push: np.ndarray, now: Now, size: float) -> np.ndarray:
    """A driver that follows its command only where this is farther off than 0.15: play between command and push."""
    return np.clip(now.push, push - 0.15 * size, push + 0.15 * size)


def _same(push: np.ndarray, now: Now, size: float) -> np.ndarray:
    return push


FORCES: dict[str, Callable[[Now, float, np.random.Generator], Added]] = {
    "patch": _patch, "swirl": _swirl, "saddle": _saddle, "turning": _turning, "friction": _friction,
    "coupled": _coupled, "castor": _castor, "rub": _rub, "bumps": _bumps,
}  # fmt: skip
INPUTS: dict[str, Callable[[np.ndarray, Now, float], np.ndarray]] = {
    "hot": _hot, "cogs": _cogs, "oval": _oval, "late": _late, "brakes": _brakes, "play": _play,
}  # fmt: skip
KINDS = {**{name: law.__doc__ for name, law in (FORCES | INPUTS).items()}, "nothing": "The nominal robot."}
"""What may be hidden in a robot, in words."""


class Robot(NamedTuple):
    """Rates (2,) [1/s], gains (2, 2), dead zones (2,), wheel radius and track [m]."""

    rate: np.ndarray
    gain: np.ndarray
    zone: np.ndarray
    radius: float
    track: float


def draw_robot(rng) -> Robot:
    """A small robot as it may come, both wheels nearly alike."""
    rate = rng.uniform(2.0, 6.0, 2)
    top = rng.uniform(0.35, 0.6), rng.uniform(2.0, 4.0)
    even = 1.0 + rng.uniform(-0.05, 0.05, 2)
    gain = np.array([0.5 * top[0] * rate[0] * even, 0.5 * top[1] * rate[1] * even * (1.0, -1.0)])
    return Robot(rate, gain, rng.uniform(0.03, 0.1, 2), 0.03, 0.15)


def steer(now: Now, goal: np.ndarray, robot: Robot, rng) -> np.ndarray:
    """Commands (2, runs) that lead somewhat towards a goal (2, runs), of eight drawn at random."""
    tried = rng.uniform(-1.0, 1.0, (8, 2, len(now.x)))
    reached = np.einsum("ij,kjr->kir", robot.gain / robot.rate[:, None], tried)
    angle = now.theta + 0.5 * reached[:, 1]
    far = np.hypot(now.x + reached[:, 0] * np.cos(angle) - goal[0], now.y + reached[:, 0] * np.sin(angle) - goal[1])
    return tried[far.argmin(axis=0), :, np.arange(len(now.x))].T


def drive(robot: Robot, kind: str, size: float, runs: int, seed: int, first: float = 0.0) -> np.ndarray:
    """Logs (runs, ROWS, 6) with noise: t, both commands, pose."""
    rng = np.random.default_rng(seed)
    force, change = FORCES.get(kind, _none), INPUTS.get(kind, _same)
    pose, still = rng.uniform(-1.0, 1.0, (3, runs)) * np.array([[ROOM], [ROOM], [np.pi]]), np.zeros(runs)
    now = Now(*pose, still, still, np.zeros((2, runs)), rng.uniform(0, 6, (2, runs)), np.zeros((2, runs)), still + 9.0,
              first + STEP * ROWS * np.arange(runs), np.zeros((2, runs)), still + 9.0,
              np.zeros((2, runs)))  # fmt: skip
    goal, command, left = rng.uniform(-ROOM, ROOM, (2, runs)), np.zeros((2, runs)), np.zeros(runs)
    h, rows = STEP / SUBSTEPS, []
    for row in range(ROWS):
        near, fresh = np.hypot(now.x - goal[0], now.y - goal[1]) < 0.3, left <= 0
        goal = np.where(near, rng.uniform(-ROOM, ROOM, (2, runs)), goal)
        older, age = np.where(fresh, now.push, now.older), np.where(fresh, 0.0, now.age)
        now, command = now._replace(older=older, age=age), np.where(fresh, steer(now, goal, robot, rng), command)
        left = np.where(fresh, rng.integers(6, 25, runs), left) - 1
        rows.append([np.full(runs, row * STEP), *command, now.x, now.y, now.theta])
        jolt = rng.normal(size=(2, runs)) * np.array(SLIP)[:, None] / np.sqrt(STEP)
        for _ in range(SUBSTEPS):
            now = _step(robot, now, command, jolt, (force, change, size), h, rng)
    logs = np.array(rows).transpose(2, 0, 1)
    seen = rng.normal(size=(runs, ROWS, 3)) * np.array([NOISE[0], NOISE[0], NOISE[1]])
    logs[..., 3:] += seen
    logs[..., 5] = (logs[..., 5] + np.pi) % (2.0 * np.pi) - np.pi
    return logs


def _step(robot: Robot, now: Now, command: np.ndarray, jolt: np.ndarray, effect, h: float, rng) -> Now:
    """One midpoint step of h [s]."""
    force, change, size = effect
    push = np.sign(command) * np.maximum(np.abs(command) - robot.zone[:, None], 0.0)
    push = change(push, now, size)
    pull = robot.gain @ push

    def rates(there: Now):
        along, heading = force(there, size, rng)
        return np.array([
            there.v * np.cos(there.theta), there.v * np.sin(there.theta), there.w,
            pull[0] - robot.rate[0] * there.v + along + jolt[0], pull[1] - robot.rate[1] * there.w + heading + jolt[1],
        ])  # fmt: skip

    state = np.array(now[:5])
    middle = now._replace(**dict(zip(Now._fields[:5], state + 0.5 * h * rates(now), strict=True)))
    x, y, theta, v, w = state + h * rates(middle)
    rolled = np.stack([middle.v + 0.5 * robot.track * middle.w, middle.v - 0.5 * robot.track * middle.w]) / robot.radius
    since = np.where(v * now.v < 0.0, 0.0, now.since + h)
    heat = now.heat + h / HEAT_TIME * (push**2 - now.heat)
    return Now(x, y, theta, v, w, push, now.angle + h * rolled, heat, since, now.time + h, now.older, now.age + h,
               robot.radius * rolled)  # fmt: skip

"""Logs under stress: random robots seen by random cameras, in odd units, far away, late, turned, dim and noisy."""

from typing import NamedTuple

import jax
import numpy as np

from jaxident.log import Log, make_log
from jaxident.robot.drive import Physical
from jaxident.robot.model import Model
from jaxident.study.synthetic import excite, simulate_runs

ROWS = 160
"""One length, so that every method compiles once."""
FASTEST, SLOWEST = 1e-4, 0.5
"""Periods [s]."""


class Stress(NamedTuple):
    """What is done to a robot's log; every field at its default does nothing."""

    period: float = 1.0 / 30.0
    noise: float = 0.0
    command_scale: float = 1.0
    pose_scale: float = 1.0
    offset: float = 0.0
    epoch: float = 0.0
    turns: int = 0
    wrapped: bool = False
    missing: float = 0.0


def random_robot(random: np.random.Generator, period: float) -> Model:
    """Rates, gains and dead zones over the decades in which robots have them, wheels that are nearly alike."""
    rate = np.exp(random.uniform(np.log(0.3), np.log(30.0), 2))
    gain = rate[:, None] * np.array([[0.25, 0.25], [2.0, -2.0]]) * np.exp(random.normal(size=(2, 1)))
    gain *= np.exp(0.1 * random.normal(size=(2, 2)))
    return Model(period, Physical(rate, gain), random.uniform(0.0, 0.4, 2))


def random_stress(random: np.random.Generator) -> Stress:
    """Each kind of stress at a size of its own; about half of them at rest at a time."""

    def some(value):
        return value if random.random() < 0.5 else None

    chosen = {
        "period": some(float(np.exp(random.uniform(np.log(FASTEST), np.log(SLOWEST))))),
        "noise": some(10.0 ** random.uniform(-9.0, 4.0)),
        "command_scale": some(10.0 ** random.uniform(-6.0, 6.0)),
        "pose_scale": some(10.0 ** random.integers(-3, 7)),
        "offset": some(10.0 ** random.uniform(0.0, 9.0)),
        "epoch": some(1.7e9),
        "turns": some(int(random.integers(-2000, 2000))),
        "wrapped": some(True),
        "missing": some(random.uniform(0.0, 0.95)),
    }
    return Stress(**{key: value for key, value in chosen.items() if value is not None})


def stressed(robot: Model, stress: Stress, seed: int, rows: int = ROWS) -> Log:
    """The robot's log under the stress; `noise` [m] and ten times as much [rad] come from a camera of that quality."""
    random = np.random.default_rng(seed)
    plain = excite(jax.random.key(seed), "multilevel", rows, stress.period, hold=5)
    log = simulate_runs(robot, plain, key=jax.random.key(seed))
    x, y, theta = (np.array(column) for column in log.pose)
    x, y = (column + stress.noise * random.normal(size=rows) for column in (x, y))
    theta = theta + 10.0 * stress.noise * random.normal(size=rows) + 2.0 * np.pi * stress.turns
    if stress.wrapped:
        theta = (theta + np.pi) % (2.0 * np.pi) - np.pi
    unseen = random.random(rows) < stress.missing
    x, y = (np.where(unseen, np.nan, stress.pose_scale * column + stress.offset) for column in (x, y))
    commands = (stress.command_scale * np.asarray(column) for column in log.command)
    return make_log(np.asarray(log.t) + stress.epoch, *commands, x, y, np.where(unseen, np.nan, theta))

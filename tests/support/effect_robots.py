"""The robot and the commands of the tests of effects: the published one, driven forth and back and round."""

import functools

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import State
from jaxident.effects import CATALOGUE, run_full
from jaxident.effects.apply import with_effects
from jaxident.files.models import load_model
from jaxident.study.synthetic import excite

ROBOT = load_model("published")
DRIVE, WIDTH = ROBOT.physical, jnp.asarray(ROBOT.dead_zone)
START = State(0.3, -0.2, 0.5, 0.1, -0.5)
KEY = jax.random.key(0)
ROWS = 121


@functools.cache
def drive_log(rows=ROWS, even=True):
    """Commands at several levels, held eight rows, on even or uneven steps."""
    log = excite(jax.random.key(1), "multilevel", rows, ROBOT.sample_period, hold=8)
    if even:
        return log
    steps = np.random.default_rng(0).uniform(0.01, 0.06, rows)
    return log._replace(t=3.0 + np.cumsum(steps))


def full(vector, log, key=KEY, start=START, drive=DRIVE, substeps=4):
    """Poses (samples, 3) by the full program. A value that `jit` is not given is a constant to it, of a program of its
    own: it is given all."""
    return full_program(vector, log, key, start, drive, substeps)


@functools.partial(jax.jit, static_argnames="substeps")
def full_program(vector, log, key, start, drive, substeps):
    """The compiled part of `full`."""
    pose = run_full(drive, WIDTH, vector, jnp.asarray(log.t), log.command, start, key=key, substeps=substeps)
    return jnp.stack(pose, axis=1)


def typical(*names):
    """The robot with these effects at their typical sizes."""
    return with_effects(ROBOT, [(name, CATALOGUE[name].typical()) for name in names])


def poses(log):
    """Poses (samples, 3)."""
    return np.stack([np.asarray(column) for column in log.pose], axis=1)

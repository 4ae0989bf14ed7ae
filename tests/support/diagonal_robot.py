"""The diagonal robot: no coupling, about the size of the one in the paper; and logs of it."""

import jax
import numpy as np

from jaxident.log import Log, make_log
from jaxident.robot.drive import Physical
from jaxident.robot.excitation import EXCITATIONS
from jaxident.robot.model import Model
from jaxident.robot.noise import Noise
from jaxident.robot.simulate import simulate

PERIOD = 1.0 / 30.0
DRIVE = Physical(np.array([0.541386, 7.817043]), np.array([[0.128988, 0.127287], [66.824208, -65.25288]]))
DEAD_ZONE = np.array([0.25, 0.2])


def logged(seed, noise=None, rows=300, jitter=0.0):
    """A log of the diagonal robot; jitter is the relative spread of the steps."""
    command = EXCITATIONS["multilevel"](jax.random.key(seed), rows, hold=10)
    step = PERIOD * (1.0 + jitter * np.random.default_rng(seed).uniform(-1.0, 1.0, rows))
    log = make_log(np.cumsum(step), *(np.asarray(u) for u in command))
    made = simulate(Model(PERIOD, DRIVE, DEAD_ZONE, noise or Noise()), log, key=jax.random.key(100 + seed))
    return Log(*(np.asarray(column) for column in made))

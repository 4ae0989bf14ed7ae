"""The simplified robot, its logs, and a recursion that is under way."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.estimation.increments import recursive
from jaxident.estimation.increments.observations import observe_log, tail
from jaxident.log import Log
from jaxident.robot.difference import Difference
from jaxident.robot.excitation import multilevel
from jaxident.robot.model import Model
from jaxident.robot.noise import Noise, draw_noise, observe
from jaxident.robot.simulate import simulate

PERIOD = 1 / 30
ROBOT = Difference(
    jnp.array([0.9821, 0.7706]),
    jnp.array([[7.1181e-5, 7.0344e-5], [0.0341, -0.0333]]),
    jnp.array([[-7.0697e-5, -6.9978e-5], [-0.0313, 0.0305]]),
)
DEAD_ZONE = jnp.array([0.25, 0.20])
LONGEST = 2000


def record(samples=800, seed=0, noise=None, missing=0.0):
    """A log of the simplified robot as arrays: the first rows of one that is as long for all."""
    log = Log(*(column[:samples] for column in _recorded(LONGEST, seed, 0.0 if noise is None else noise)))
    hidden = np.random.default_rng(seed).random(samples) < missing
    return log._replace(x=jnp.asarray(np.where(hidden, np.nan, log.x)))


@partial(jax.jit, static_argnums=0)
def _recorded(samples, seed, noise):
    """The log before poses are hidden; as one program, for operations one by one take seconds to compile."""
    command = multilevel(jax.random.key(seed), samples, 1.0, 10)
    log = simulate(
        Model(PERIOD, ROBOT, DEAD_ZONE), Log(PERIOD * jnp.arange(samples), *command, *jnp.zeros((4, samples)))
    )
    pose = observe(log.pose, Noise(noise, 10 * noise), draw_noise(jax.random.key(seed + 1), samples), PERIOD)
    return log._replace(x=pose.x, y=pose.y, theta=pose.theta)


@partial(jax.jit, static_argnums=1)
def started(log, rows, difference=ROBOT, forgetting=1.0):
    """Estimate after the first rows, and the samples that follow."""
    observations = observe_log(log)
    early = jax.tree.map(lambda c: c[: rows - 1], observations)
    estimate = recursive.start(difference, DEAD_ZONE, early, 0.9, forgetting)
    return estimate, tail(observations, rows - 1)

"""Synthetic logs: an excitation as a log without poses, and a model run over every run of a log."""

import dataclasses

import jax
import numpy as np

from jaxident.array_types import Array
from jaxident.log import Log, join, make_log
from jaxident.robot.excitation import EXCITATIONS
from jaxident.robot.model import Model
from jaxident.robot.noise import Noise
from jaxident.robot.simulate import simulate


def excite(key: Array, name: str, samples: int, period: float, *, amplitude: float = 1.0, hold: int = 20) -> Log:
    """A log (samples,) of commands alone, even at `period` [s]; name is one of `EXCITATIONS`."""
    command = jax.jit(EXCITATIONS[name], static_argnums=(1, 3))(key, samples, amplitude, hold)
    return make_log(period * np.arange(samples), np.asarray(command.right), np.asarray(command.left))


def simulate_runs(model: Model, log: Log, *, noise: tuple[float, float] | None = None, key: Array) -> Log:
    """The log with every run's poses replaced by the model's, from rest at the origin.

    noise (position [m], heading [rad]) adds camera noise of that size, with the correlation time and the random slip
    of the model's own noise law; without it the poses are exact.
    """
    if noise is not None:
        law = model.noise or Noise()
        model = dataclasses.replace(model, noise=law._replace(position=noise[0], heading=noise[1]))
    keys = jax.random.split(key, len(log.runs()))
    runs = [simulate(model, run, key=k if noise else None) for run, k in zip(log.runs(), keys, strict=True)]
    return join([Log(*(np.asarray(column) for column in run)) for run in runs])._replace(run=log.run)

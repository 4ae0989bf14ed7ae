"""Synthetic logs: an excitation as a log without poses, and a model run over every run of a log."""

import dataclasses

import jax
import numpy as np

from jaxident.array_types import Array
from jaxident.effects.simulate import is_random, simulate
from jaxident.log import Log, join, make_log
from jaxident.robot.excitation import EXCITATIONS
from jaxident.robot.model import Model
from jaxident.robot.noise import Noise


def excite(key: Array, name: str, samples: int, period: float, *, amplitude: float = 1.0, hold: int = 20) -> Log:
    """Make the commands of an excitation, as a log without poses.

    Args:
        key: of the random draws.
        name: one of `EXCITATIONS`.
        samples: rows.
        period: time between two rows [s].
        amplitude: largest command [unit of the command].
        hold: rows that a level lasts.

    Returns:
        Log: times and commands (samples,); no pose is measured.

    Examples:
        >>> import jax, jaxident as ji
        >>> ji.excite(jax.random.key(0), "prbs", 100, 0.05, amplitude=0.8)
        Log of 100 rows in 1 run(s), 4.95 s, 0 % with a pose
    """
    command = jax.jit(EXCITATIONS[name], static_argnums=(1, 3))(key, samples, amplitude, hold)
    return make_log(period * np.arange(samples), np.asarray(command.right), np.asarray(command.left))


def simulate_runs(
    model: Model, log: Log, *, noise: tuple[float, float] | None = None, wheel_noise: float = 0.0, key: Array
) -> Log:
    """The log with every run's poses replaced by the model's, from rest at the origin; its wheel speeds too, if the
    model measures them, with white `wheel_noise` [rad/s].

    noise (position [m], heading [rad]) adds camera noise of that size, with the correlation time and the random slip
    of the model's own noise law; without it the poses are exact but for the model's random effects. Effects that
    drift go on from run to run.
    """
    if noise is not None:
        law = model.noise or Noise()
        model = dataclasses.replace(model, noise=law._replace(position=noise[0], heading=noise[1]))
    else:
        model = dataclasses.replace(model, noise=None)
    if model.wheels is not None:
        model = dataclasses.replace(model, wheels=model.wheels._replace(noise=wheel_noise))
    parts, draws = log.runs(), noise is not None or wheel_noise > 0.0 or is_random(model)
    ends = np.cumsum([run.t[-1] - run.t[0] for run in parts])
    runs = [
        simulate(model, run, key=k if draws else None, session_time=begin)
        for run, k, begin in zip(parts, jax.random.split(key, len(parts)), [0.0, *ends[:-1]], strict=True)
    ]
    return join([Log(*(np.asarray(column) for column in run)) for run in runs])._replace(run=log.run)

"""Example logs: a robot drawn near the published one, recorded by an overhead camera."""

import dataclasses

import jax
import jax.numpy as jnp

from jaxident.array_types import Array
from jaxident.log import Log
from jaxident.robot.drive import Physical
from jaxident.robot.model import Model, Provenance, require_physical
from jaxident.robot.noise import Noise
from jaxident.study.synthetic import excite, simulate_runs

RUNS = 6
SAMPLES = 1000
CAMERA = (5e-4, 5e-3)
"""Camera noise: 0.5 mm and 5 mrad."""

VARIATION = 0.2
"""Every parameter lies within this part of the published one."""


def example_robot(key: Array, published: Model) -> Model:
    """A robot whose rates, gains and dead zones differ from the published ones; without coupling."""
    keys = jax.random.split(key, 3)
    drive = require_physical(published)
    parts = (drive.rate, drive.gain, published.dead_zone)
    rate, gain, dead_zone = (
        jnp.asarray(part) * jax.random.uniform(k, jnp.shape(part), minval=1.0 - VARIATION, maxval=1.0 + VARIATION)
        for k, part in zip(keys, parts, strict=True)
    )
    return dataclasses.replace(
        published,
        dynamics=Physical(rate, gain),
        dead_zone=dead_zone,
        noise=Noise(*CAMERA),
        provenance=Provenance(method="drawn near the published robot for `jaxident example`"),
    )


def example_runs(key: Array, robot: Model) -> list[Log]:
    """Runs with camera noise: multi-level commands for one half, the staircase for the other."""
    runs = []
    for number, k in enumerate(jax.random.split(key, RUNS)):
        key_input, key_noise = jax.random.split(k)
        kind = ("multilevel", "staircase")[number % 2]
        commands = excite(key_input, kind, SAMPLES, robot.sample_period)
        runs.append(simulate_runs(robot, commands, noise=CAMERA, key=key_noise))
    return runs

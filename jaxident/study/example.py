"""Example logs: a robot drawn near the published one, recorded by an overhead camera."""

import dataclasses

import jax
import jax.numpy as jnp

from jaxident.array_types import Array
from jaxident.effects.apply import sized, with_effects
from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.checks import check_effects
from jaxident.log import Log, join
from jaxident.robot.drive import Physical
from jaxident.robot.model import Effect, Model, Provenance, require_physical
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


def draw_effect(key: Array, robot: Model, name: str | None) -> Model:
    """The robot with an effect of the catalogue between half and one and a half times its typical size; `none` leaves
    it as it is, None draws the effect too. InputError for an unknown name."""
    key_name, key_size = jax.random.split(key)
    if name is None:
        canonical = [entry.name for entry in CATALOGUE.values() if not entry.extension]
        name = canonical[int(jax.random.randint(key_name, (), 0, len(canonical)))]
    if name == "none":
        return robot
    check_effects((Effect(name, {}),))
    entry = CATALOGUE[name]
    factor = float(jax.random.uniform(key_size, minval=0.5, maxval=1.5))
    return with_effects(robot, [(name, sized(entry, factor))])


def example_runs(key: Array, robot: Model) -> list[Log]:
    """Runs with camera noise: multi-level commands for one half, the staircase for the other."""
    key_noise, *keys = jax.random.split(key, RUNS + 1)
    kinds = [("multilevel", "staircase")[number % 2] for number in range(RUNS)]
    parts = [excite(k, kind, SAMPLES, robot.sample_period) for k, kind in zip(keys, kinds, strict=True)]
    return simulate_runs(robot, join(parts), noise=CAMERA, key=key_noise).runs()

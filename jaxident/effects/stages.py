"""The stages of the chain, in order, and which effects act at each.

Both integrators walk through these stages and loop over the effects of each; what differs is how they integrate.
"""

from collections.abc import Collection, Mapping
from typing import Any

import jax.numpy as jnp

from jaxident.array_types import Array, Pose, Wheels
from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.effect import EffectRecord
from jaxident.effects.signals import Zone

INPUT = ("command", "arrival", "slew", "zone", "motor", "gear")
"""Stages before the wheels: what they pass on depends on the commands, and hardly on the motion."""
MOTION = ("load", "grip", "body", "friction", "side")
"""Stages at which the motion itself is changed."""
REPORT = ("optics", "frames")
"""Stages between the robot's pose and the reported one."""
STAGES = (*INPUT, *MOTION, *REPORT)

Settings = Mapping[str, Mapping[str, Any]]
"""{effect: {parameter or coordinate: value}} of the effects that a program holds."""

CHAIN: dict[str, tuple[EffectRecord, ...]] = {
    stage: tuple(sorted((each for each in CATALOGUE.values() if each.stage == stage), key=lambda each: each.rank))
    for stage in STAGES
}
"""The effects of each stage, in the order in which they act."""

CORNERED = frozenset(each.name for each in CATALOGUE.values() if each.sharp)
"""Effects with corners within a sample."""
MOVING = frozenset(each.name for each in CATALOGUE.values() if each.varies or each.stage in ("slew", "gear", *MOTION))
"""Without these the push is held from command to command, and the drive is linear."""


def acting(stage: str, settings: Settings) -> list[tuple[EffectRecord, Mapping[str, Any]]]:
    """The effects of a stage that a program holds, in order, each with its values."""
    return [(effect, settings[effect.name]) for effect in CHAIN[stage] if effect.name in settings]


def holds(settings: Settings | Collection[str], *stages: str) -> bool:
    """Whether a program holds an effect of one of these stages."""
    return any(effect.name in settings for stage in stages for effect in CHAIN[stage])


def static_push(settings: Settings, dead_zone: Array, u: Wheels, time: Array) -> Wheels:
    """The push that held commands make at a session time [s]: through the dead zones, (2,), and the motors."""
    widths = Wheels(dead_zone[0], dead_zone[1])
    zone = Zone(widths, widths)
    for effect, values in acting("zone", settings):
        zone = effect.act(zone, time, **values)
    m = Wheels(*(_past(*wheel) for wheel in zip(u, *zone, strict=True)))
    for effect, values in acting("motor", settings):
        m = effect.act(m, u, time, **values)
    return m


def _past(u: Array, forward: Array, backward: Array) -> Array:
    """What of a command passes a dead zone of two widths, neither below 0; PAPER (10) where they are the same."""
    forward, backward = jnp.maximum(forward, 0.0), jnp.maximum(backward, 0.0)
    return jnp.where(u > forward, u - forward, jnp.where(u < -backward, u + backward, 0.0))


def seen(settings: Settings, pose: Pose, *, fast: bool = False) -> Pose:
    """What the optics make of true poses; fast: by coordinates of the search."""
    for effect, values in acting("optics", settings):
        pose = (effect.law if fast else effect.act)(pose, **values)
    return pose


def remembered_at_rest(effect: EffectRecord, like: Array) -> Any:
    """What a law that remembers the input has of a robot at rest."""
    still = Wheels(jnp.zeros_like(like), jnp.zeros_like(like))
    return still if effect.memory == 1 else (still,) * effect.memory


def friction_level(settings: Settings, n: Wheels) -> Wheels:
    """The level of dry friction of both wheels, sliding at speeds n: the sum over all laws, >= 0."""
    right, left = jnp.zeros_like(n.right), jnp.zeros_like(n.left)
    for effect, values in acting("friction", settings):
        more = effect.act(n, **values)
        right, left = right + more.right, left + more.left
    return Wheels(right, left)

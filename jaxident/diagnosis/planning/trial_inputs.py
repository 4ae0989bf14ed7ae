"""Inputs worth trying when the next run is planned: the named excitations and manoeuvres, at many holds and
amplitudes, and what becomes of good ones when a stretch is replaced. Commands (samples, 2), right and left, over the
limit; all draws come from one NumPy generator."""

from functools import partial

import jax
import numpy as np

from jaxident.array_types import Array
from jaxident.robot.excitation import EXCITATIONS

HOLDS = (0.1, 0.2, 0.4, 0.8, 1.6)
"""Times [s] for which a level lasts."""
AMPLITUDES = (1.0, 1.0, 0.6, 0.3)
ORDINARY = ("multilevel", 20)
"""The excitation, and its hold in samples, that a user takes who does not plan."""

_drawn = partial(jax.jit, static_argnums=(1, 3))


def _forward(rng: np.random.Generator, steps: int) -> np.ndarray:
    return rng.uniform(0.0, 1.0, (steps, 2))


def _spins(rng: np.random.Generator, steps: int) -> np.ndarray:
    return rng.uniform(-1.0, 1.0, (steps, 1)) * [1.0, -1.0]


def _straight(rng: np.random.Generator, steps: int) -> np.ndarray:
    return rng.uniform(-1.0, 1.0, (steps, 1)) * [1.0, 1.0]


def _reversals(rng: np.random.Generator, steps: int) -> np.ndarray:
    sign = np.where(np.arange(steps) % 2, 1.0, -1.0)[:, None] * rng.choice([-1.0, 1.0], (steps, 2)).cumprod(axis=0)
    return sign * rng.uniform(0.5, 1.0, (steps, 2))


def _rests(rng: np.random.Generator, steps: int) -> np.ndarray:
    return rng.uniform(-1.0, 1.0, (steps, 2)) * (np.arange(steps) % 2)[:, None]


def _extremes(rng: np.random.Generator, steps: int) -> np.ndarray:
    return rng.choice([-1.0, 0.0, 1.0], (steps, 2))


MANOEUVRES = {
    "forward": _forward, "spins": _spins, "straight": _straight, "reversals": _reversals, "rests": _rests,
    "extremes": _extremes,
}  # fmt: skip
KINDS = (*EXCITATIONS, *MANOEUVRES)


def draw(rng: np.random.Generator, samples: int, period: float) -> np.ndarray:
    """A command (samples, 2) of a kind, hold and amplitude drawn at random; period [s]."""
    kind = KINDS[rng.integers(len(KINDS))]
    hold = max(round(rng.choice(HOLDS) / period), 1)
    return rng.choice(AMPLITUDES) * make(rng, kind, samples, hold)


def make(rng: np.random.Generator, kind: str, samples: int, hold: int) -> np.ndarray:
    """A command (samples, 2) of full amplitude of one of KINDS, its levels held `hold` samples."""
    if kind in MANOEUVRES:
        return np.repeat(MANOEUVRES[kind](rng, -(-samples // hold)), hold, axis=0)[:samples]
    key = jax.random.key(int(rng.integers(2**31)))
    return np.stack([np.asarray(u) for u in _drawn(EXCITATIONS[kind])(key, samples, 1.0, hold)], axis=1)


def vary(rng: np.random.Generator, command: Array, other: Array, period: float) -> np.ndarray:
    """A command (samples, 2) with one stretch replaced: by a stretch of another, or by fresh levels."""
    samples = len(command)
    length = int(rng.integers(2, max(samples // 4, 3)))
    begin, there = rng.integers(0, samples - length, 2)
    hold = max(round(rng.choice(HOLDS) / period), 1)
    fresh = MANOEUVRES[str(rng.choice(list(MANOEUVRES)))](rng, -(-length // hold))
    changed = np.array(command)
    changed[begin : begin + length] = (
        other[there : there + length] if rng.random() < 0.5 else np.repeat(fresh, hold, axis=0)[:length]
    )
    return changed

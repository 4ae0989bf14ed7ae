"""Input signals for both wheels: pure functions of a key, a length, an amplitude and a hold in samples."""

from collections.abc import Callable

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Samples, Wheels

DWELL_LEVELS = (0.0, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 0.7, 0.5, 0.3, 0.2, 0.1)
"""One half-wave of the staircase, in amplitudes: as many levels in and around a usual dead zone as above it."""


def staircase(key: Array, samples: int, amplitude: Array = 1.0, hold: int = 20) -> Wheels:
    """Levels in and around the dead zone, up and down in both directions, as in the paper's figure 7.

    The left wheel takes its levels in a drawn order, so that the two wheels do not move in step; each pass through
    the levels is drawn anew.
    """
    wave = jnp.asarray(DWELL_LEVELS + tuple(-level for level in DWELL_LEVELS))
    steps = -(-samples // hold)
    passes = -(-steps // len(wave))
    right = jnp.tile(wave, passes)
    left = jax.vmap(lambda k: jax.random.permutation(k, wave))(jax.random.split(key, passes)).ravel()
    return Wheels(*(amplitude * _hold(levels, samples, hold) for levels in (right, left)))


def multilevel(key: Array, samples: int, amplitude: Array = 1.0, hold: int = 20) -> Wheels:
    """Levels uniform in [-amplitude, amplitude], each held `hold` samples."""

    def wave(k: Array) -> Array:
        return _hold(jax.random.uniform(k, (-(-samples // hold),), minval=-1.0), samples, hold)

    return _both(key, wave, amplitude)


def prbs(key: Array, samples: int, amplitude: Array = 1.0, hold: int = 20) -> Wheels:
    """Pseudo-random binary: plus or minus the amplitude. Two levels cannot show a static curve or a dead zone."""

    def wave(k: Array) -> Array:
        return _hold(jax.random.rademacher(k, (-(-samples // hold),), float), samples, hold)

    return _both(key, wave, amplitude)


def multisine(key: Array, samples: int, amplitude: Array = 1.0, hold: int = 20) -> Wheels:
    """Odd harmonics of the run length with random phases, flat up to the band of the hold, peak at the amplitude."""

    def wave(k: Array) -> Array:
        count = max(samples // (4 * hold), 1)
        harmonics = 2.0 * jnp.arange(count) + 1.0
        phases = jax.random.uniform(k, (count,), maxval=2.0 * jnp.pi)
        time = jnp.arange(samples) / samples
        signal = jnp.sum(jnp.sin(2.0 * jnp.pi * harmonics[:, None] * time + phases[:, None]), axis=0)
        return signal / jnp.max(jnp.abs(signal))

    return _both(key, wave, amplitude)


def chirp(key: Array, samples: int, amplitude: Array = 1.0, hold: int = 20) -> Wheels:
    """Sines whose frequency rises linearly from one period in the run to one period in 2 `hold` samples.

    The wheels are a quarter period apart: drawn apart, their phases could agree and the two move in step.
    """
    time = jnp.arange(samples) / samples
    last = max(samples / (2.0 * hold), 1.0)
    phase = jax.random.uniform(key, maxval=2.0 * jnp.pi) + 2.0 * jnp.pi * (time + 0.5 * (last - 1.0) * time**2)
    return Wheels(amplitude * jnp.sin(phase), amplitude * jnp.cos(phase))


EXCITATIONS: dict[str, Callable[..., Wheels]] = {
    "staircase": staircase,
    "multilevel": multilevel,
    "prbs": prbs,
    "multisine": multisine,
    "chirp": chirp,
}


def _both(key: Array, wave: Callable[[Array], Array], amplitude: Array) -> Wheels:
    right, left = jax.random.split(key)
    return Wheels(amplitude * wave(right), amplitude * wave(left))


def _hold(levels: Array, samples: int, hold: int) -> Samples:
    return levels[jnp.arange(samples) // hold]

"""Moving blocks of innovations: how long they should be, how to draw them, and how much in them is slow.

All functions see the poses of a log one after the other, rows without a pose squeezed out; no block reaches from one
run into the next. Innovations are (runs, 3, rows), seen (runs, rows), a block some rows.
"""

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array, PoseVector, RunFlags, RunPoses

SHORTEST = 5
LONGEST_SHARE = 0.1
"""A run holds at least ten blocks: fewer hardly differ from the run itself."""


def block_length(normalised: np.ndarray, seen: np.ndarray) -> int:
    """Rows in a block: (sqrt(6) r / (1 - r^2))^(2/3) n^(1/3), the least mean squared error of a variance where memory
    fades like r^k (Politis and White 2004, their eq. 9 for an autoregression); r the largest correlation of
    neighbouring innovations (runs, 3, rows) among the channels, n poses seen (runs, rows) per run."""
    both = (seen[:, 1:] & seen[:, :-1])[:, None]
    products = np.sum(normalised[..., 1:] * normalised[..., :-1] * both, axis=(0, 2)) / max(np.sum(both), 1)
    power = np.maximum(np.sum(normalised**2, axis=(0, 2)) / max(np.sum(seen), 1), 1e-300)
    r = float(np.clip(np.max(np.abs(products / power)), 0.0, 0.99))
    rows = float(np.max(np.sum(seen, axis=1)))
    best = (np.sqrt(6.0) * r / (1.0 - r * r)) ** (2.0 / 3.0) * rows ** (1.0 / 3.0)
    return max(1, round(min(max(best, SHORTEST), LONGEST_SHARE * rows)))


def draw_blocks(key: Array, normalised: RunPoses, seen: RunFlags, block: Array) -> RunPoses:
    """Innovations (runs, 3, rows) of blocks drawn from all runs (Kuensch 1989), one after the other on the rows that
    have a pose, the three channels together; 0 elsewhere. Centred."""
    pool, fits = _pool(normalised, seen, block)
    begin = jax.random.choice(key, fits.shape[0], seen.shape, p=fits)
    turn = jnp.maximum(jnp.cumsum(seen, axis=1) - 1, 0)
    own = jnp.take_along_axis(begin, turn // block, axis=1) + turn % block
    return jnp.moveaxis(jnp.where(seen, pool[:, own], 0.0), 0, 1)


def long_run_variance(normalised: RunPoses, seen: RunFlags, block: Array) -> PoseVector:
    """Mean square of a block's sum over its rows, (3,): the variance that counts where errors are averaged."""
    pool, fits = _pool(normalised, seen, block)
    sums = jnp.concatenate([jnp.zeros((3, 1)), jnp.cumsum(pool, axis=1)], axis=1)
    place = jnp.arange(len(fits))
    moved = sums[:, jnp.minimum(place + block, len(fits))] - sums[:, place]
    return jnp.sum(fits * moved**2, axis=1) / block


def _pool(normalised: RunPoses, seen: RunFlags, block: Array) -> tuple[Array, Array]:
    """Centred innovations (3, runs * rows) of all runs, those of poses first and 0 behind; and how probable each place
    is as a block's beginning, (runs * rows,)."""
    flat, mask = jnp.moveaxis(normalised, 1, 0).reshape(3, -1), seen.ravel()
    mean = jnp.sum(jnp.where(mask, flat, 0.0), axis=1, keepdims=True) / jnp.maximum(jnp.sum(mask), 1)
    pool = jnp.where(mask, flat - mean, 0.0)[:, jnp.argsort(~mask, stable=True)]
    ends = jnp.cumsum(jnp.sum(seen, axis=1))
    place = jnp.arange(mask.size)
    room = ends[jnp.minimum(jnp.searchsorted(ends, place, side="right"), len(ends) - 1)] - place
    fits = jnp.where(room >= block, 1.0, 0.0)
    return pool, fits / jnp.maximum(jnp.sum(fits), 1.0)

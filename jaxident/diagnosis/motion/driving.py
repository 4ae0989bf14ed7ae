"""Programs that follow windows, run for many vectors: some in each call, side by side on all cores.

What drives the wheels is computed once for all vectors that drive them alike.
"""

import functools
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array, Wheels
from jaxident.diagnosis.motion.paths import push_of
from jaxident.diagnosis.motion.windows import Windows, filled_up, with_room
from jaxident.effects.coordinates import BY_DRIVE, NOMINAL, PLACES, neutral_vector
from jaxident.effects.fast_input import OPTIONAL, PUSHING, Push
from jaxident.parallel import in_parallel
from jaxident.programs import kept_program

AT_ONCE, FEW_WINDOWS = 4, 160
"""Vectors of one call where there are so many windows at most. On one core 24, 40, 80 and 160 windows then take 0.46,
0.57, 0.54 and 0.88 of the time a vector; with eight vectors 0.39, 0.53, 0.47 and 1.02. More windows were not tried."""
FEW_PIECES = 16
"""Pieces that windows are cut from, at most, where pushes of several vectors take one call. A loop over the rows of 3,
4 and 16 pieces then takes 1.1, 1.0 and 2.7 times as long as for one vector, over 268 four times (one core; none
between was tried)."""
_BY_DRIVE = [PLACES[pair] for pair in sorted(BY_DRIVE)]
_PUSHING = [6, 7, *(place for (name, _), place in PLACES.items() if name in PUSHING)]
_OPTIONAL = {name: [place for (own, _), place in PLACES.items() if own == name] for name in OPTIONAL}
_NEUTRAL = neutral_vector(np.zeros(len(NOMINAL)))


def each_of(program: Callable[..., Any]) -> Callable[..., Any]:
    """A program of one vector (SIZE,), starts (5, windows), push and windows as one of several of the first three:
    arrays (batch, ...) and a list of pushes. It keeps the name, by which `kept_program` tells programs apart."""

    @functools.wraps(program)
    def of_several(vectors: Array, starts: Array, push: list[Push], windows: Windows) -> Any:
        stacked = jax.tree.map(lambda *parts: jnp.stack(parts), *push)
        return jax.vmap(program, in_axes=(0, 0, 0, None))(vectors, starts, stacked, windows)

    return of_several


def run_each(several: Callable[..., Any], vectors: Array, starts: Array, windows: Windows) -> Any:
    """Results (batch, rows, windows, ...) of a program that `each_of` made, at vectors (batch, SIZE) and starts (batch,
    5, windows).

    The last vector fills up the last call, and windows have room for more, so that one program serves many numbers of
    both.
    """
    count, own = len(vectors), len(windows.run)
    windows = jax.tree.map(jnp.asarray, with_room(windows))
    starts = filled_up(starts)
    push = pushes_of(vectors, windows)
    size = AT_ONCE if len(windows.run) <= FEW_WINDOWS else 1
    blocks = [np.minimum(np.arange(k, k + size), count - 1) for k in range(0, count, size)]
    lanes = [(vectors[block], starts[block], [push[k] for k in block], windows) for block in blocks]
    found = in_parallel(several, lanes, ahead=False)
    return jax.tree.map(lambda *parts: np.concatenate(parts)[:count, :, :own], *found)


def pushes_of(vectors: Array, windows: Windows) -> list[Push]:
    """What `push_of` says under each of some vectors (batch, SIZE); windows as JAX arrays.

    Vectors that drive the wheels alike, as most columns of a linearisation do, share what costs most. Wheels that coast
    in their play are driven alike by equal drives only.
    """
    coasts = np.any(vectors[:, _BY_DRIVE] > 0.0, axis=1, keepdims=True)
    driven = np.concatenate([vectors[:, _PUSHING], np.where(coasts, vectors[:, : len(NOMINAL)], 0.0)], axis=1)
    _, first, own = np.unique(driven, axis=0, return_index=True, return_inverse=True)
    size = AT_ONCE if windows.t.shape[1] <= FEW_PIECES else 1
    blocks = [np.resize(first[k : k + size], size) for k in range(0, len(first), size)]
    windows = windows._replace(laws=None)  # they push nothing before the wheels
    found = in_parallel(_pushed, [(vectors[block], windows) for block in blocks], ahead=False)
    return [found[k // size][k % size] for k in own.ravel()]


@kept_program(Windows, Wheels, Push)
def _pushed(vectors: Array, windows: Windows) -> list[Push]:
    """`push_of` under each vector (batch, SIZE)."""
    acts = {name: jnp.any(vectors[:, own] != _NEUTRAL[own]) for name, own in _OPTIONAL.items()}
    found = jax.vmap(push_of, in_axes=(0, None, None))(vectors, windows, acts)
    return [jax.tree.map(lambda part, k=k: part[k], found) for k in range(len(vectors))]

"""What drives the wheels under many vectors: each different push is computed once, side by side on all cores."""

import jax
import numpy as np

from jaxident.array_types import Array, Wheels
from jaxident.diagnosis.motion.paths import push_of
from jaxident.diagnosis.motion.windows import Windows
from jaxident.effects.coordinates import BY_DRIVE, NOMINAL, PLACES
from jaxident.effects.fast_input import PUSHING, Push
from jaxident.parallel import in_parallel
from jaxident.programs import kept_program

AT_ONCE, FEW_PIECES = 4, 16
"""Vectors of one call, where windows are cut from so many pieces at most. A loop over the rows of 3, 4 and 16 pieces
then takes 1.1, 1.0 and 2.7 times as long as for one vector, over 268 four times (one core; none between was tried)."""
_BY_DRIVE = [PLACES[pair] for pair in sorted(BY_DRIVE)]
_PUSHING = [6, 7, *(place for (name, _), place in PLACES.items() if name in PUSHING)]


def pushes_of(vectors: Array, windows: Windows) -> list[Push]:
    """What `push_of` says under each of some vectors (batch, SIZE); windows as JAX arrays.

    Vectors that drive the wheels alike, as most columns of a linearisation do, share what costs most. Wheels that coast
    in their play are driven alike by equal drives only.
    """
    driven = vectors[:, _PUSHING]
    if np.any(vectors[:, _BY_DRIVE] > 0.0):
        driven = np.concatenate([driven, vectors[:, : len(NOMINAL)]], axis=1)
    _, first, own = np.unique(driven, axis=0, return_index=True, return_inverse=True)
    size = AT_ONCE if windows.t.shape[1] <= FEW_PIECES else 1
    blocks = [np.resize(first[k : k + size], size) for k in range(0, len(first), size)]
    found = in_parallel(_pushed, [(vectors[block], windows) for block in blocks], ahead=False)
    return [found[k // size][k % size] for k in own.ravel()]


@kept_program(Windows, Wheels, Push)
def _pushed(vectors: Array, windows: Windows) -> list[Push]:
    """`push_of` under each vector (batch, SIZE)."""
    found = jax.vmap(push_of, in_axes=(0, None))(vectors, windows)
    return [jax.tree.map(lambda part, k=k: part[k], found) for k in range(len(vectors))]

"""What drives the wheels under many vectors: each different push is computed once, side by side on all cores."""

import numpy as np

from jaxident.array_types import Array, Wheels
from jaxident.diagnosis.motion.paths import push_of
from jaxident.diagnosis.motion.windows import Windows
from jaxident.effects.coordinates import BY_DRIVE, NOMINAL, PLACES
from jaxident.effects.fast_input import PUSHING, Push
from jaxident.parallel import in_parallel
from jaxident.programs import kept_program

_pushed = kept_program(Windows, Wheels, Push)(push_of)
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
    found = in_parallel(_pushed, [(vectors[k], windows) for k in first], ahead=False)
    return [found[k] for k in own.ravel()]

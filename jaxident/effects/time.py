"""What changes with session time [s]: the sum of the durations of the runs before, plus the time in this one."""

import jax.numpy as jnp

from jaxident.array_types import Array
from jaxident.effects.entry import BOTH, UNIT, Entry, Parameter


def gain_drift(m: Array, time: Array, rate: Array) -> Array:
    """(1 + k t) m, not below 0: a battery that empties, a motor that warms up."""
    return m * jnp.maximum(1.0 + rate * time, 0.0)


def dead_zone_drift(width: Array, time: Array, rate: Array) -> Array:
    """D + k t, not below 0: wear, or grease that warms up."""
    return jnp.maximum(width + rate * time, 0.0)


def payload_change(changed: Array, ratio: Array) -> Array:
    """What accelerations are multiplied with: 1 / ratio once the payload has changed, 1 before."""
    return jnp.where(changed, 1.0 / ratio, 1.0)


ENTRIES = (
    Entry("gain_drift", "time", "m -> (1 + k t) m, t the session time",
          (Parameter("rate", "1/s", 0.0, (-0.03, 0.03), -0.02),), BOTH, ("dead_zone_drift",),
          "discharge of batteries; Plett 2015, Battery Management Systems, ch. 2"),
    Entry("dead_zone_drift", "time", "D -> D + k t, t the session time",
          (Parameter("rate", f"{UNIT}/s", 0.0, (-0.02, 0.02), 0.01),), BOTH, ("gain_drift",),
          "run-in and wear of gears; Olsson et al. 1998, Eur. J. Control 4"),
    Entry("payload_change", "time", "[v, w]' -> [v, w]' / r from the session time t_c on",
          (Parameter("ratio", "", 1.0, (0.5, 3.0), 1.5, least=0.0, above=True),
           Parameter("instant", "s", 0.0, (0.0, 1000.0), 1.0, shape=True)), BOTH, (),
          "Newton's second law; Basseville, Nikiforov 1993, Detection of Abrupt Changes"),
)  # fmt: skip
"""Rows of the catalogue for this site."""

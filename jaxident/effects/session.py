"""What changes with session time [s]: the sum of the durations of the runs before, plus the time in this one."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array, Wheels
from jaxident.effects import statements
from jaxident.effects.effect import BOTH, EDGE, UNIT, Coordinate, EffectRecord, Parameter, Search, Transform, signed
from jaxident.effects.signals import Load, Zone


def gain_drift(m: Wheels, _: Wheels, time: Array, rate: Array) -> Wheels:
    """(1 + k t) m, not below 0: a battery that empties, a motor that warms up."""
    left = jnp.maximum(1.0 + rate * time, 0.0)
    return Wheels(m.right * left, m.left * left)


def dead_zone_drift(zone: Zone, time: Array, rate: Array) -> Zone:
    """D + k t, not below 0: wear, or grease that warms up."""
    return Zone(*(Wheels(*(jnp.maximum(width + rate * time, 0.0) for width in widths)) for widths in zone))


def payload_instant(ratio: Array, instant: Array) -> Array:
    """When the payload changes, in session time [s]."""
    return instant


def payload_change(changed: Array, ratio: Array, instant: Array) -> Array:
    """What accelerations are multiplied with: 1 / ratio once the payload has changed, 1 before."""
    return jnp.where(changed, 1.0 / ratio, 1.0)


def payload_lightness(time: Array, step: Array, loss: Array, instant: Array) -> Array:
    """`payload_change` over a substep about a session time, smooth in the instant: what accelerations keep."""
    return 1.0 - loss * jax.nn.sigmoid((time - instant) / step)


RECORDS = (
    EffectRecord(
        name="gain_drift", site="time", stage="motor", step=statements.GAIN_DRIFT,
        words="the drive grows weaker or stronger with time, as when a battery runs down",
        equation="m -> (1 + k t) m, t the session time",
        source="discharge of batteries; Plett 2015, Battery Management Systems, ch. 2",
        parameters=(Parameter("rate", "1/s", 0.0, (-0.03, 0.03), -0.02),),
        channels=BOTH,
        act=gain_drift, confused_with=("dead_zone_drift",), varies=True, timed=True,
        search=Search((signed("rate", 0.05),)),
    ),
    EffectRecord(
        name="dead_zone_drift", site="time", stage="zone", step=statements.ZONE_DRIFT,
        words="the dead zones change with time, as by wear",
        equation="D -> D + k t, t the session time",
        source="run-in and wear of gears; Olsson et al. 1998, Eur. J. Control 4",
        parameters=(Parameter("rate", f"{UNIT}/s", 0.0, (-0.02, 0.02), 0.01),),
        channels=BOTH,
        act=dead_zone_drift, rank=-1, confused_with=("gain_drift",), varies=True, timed=True,
        search=Search((signed("rate", 0.05),)),
    ),
    EffectRecord(
        name="payload_change", site="time", stage="load", step=statements.PAYLOAD,
        words="the load changed at some instant",
        equation="[v, w]' -> [v, w]' / r from the session time t_c on",
        source="Newton's second law; Basseville, Nikiforov 1993, Detection of Abrupt Changes",
        parameters=(Parameter("ratio", "", 1.0, (0.5, 3.0), 1.5, least=0.0, above=True),
                    Parameter("instant", "s", 0.0, (0.0, 1000.0), 1.0, shape=True, instant=True)),
        channels=BOTH,
        act=Load(payload_instant, payload_change), fast=payload_lightness, timed=True,
        search=Search((Coordinate("loss", 0.0, -3.0, 0.8, 0.24, below=1.0),  # from a quarter of the load to five times
                       Coordinate("instant", 0.0, 0.0, 1e4, 10.0, shape=True, reach=(10.0, 1.2, 0.15))),
                      Transform(lambda c: {"ratio": 1.0 / (1.0 - c["loss"]), "instant": float(c["instant"])},
                                lambda p: {"loss": 1.0 - 1.0 / p["ratio"], "instant": p["instant"]}),
                      lambda duration: [{"loss": 0.1, "instant": duration * part}
                                        for part in np.linspace(EDGE, 1.0 - EDGE, 12)]),
    ),
)  # fmt: skip
"""The effects of this site."""

"""What changes with session time [s]: the sum of the durations of the runs before, plus the time in this one."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array, Wheels
from jaxident.effects import statements
from jaxident.effects.effect import BOTH, EDGE, UNIT, Coordinate, EffectRecord, Parameter, Search, Transform, signed
from jaxident.effects.signals import Load, Zone

MOST_GROWN = 3.0
"""A drift whose speed grows ends where it is exp(3) times as fast as it began: a model of a session of minutes must not
throw a robot out of the room an hour later. A drift with the square of time comes to g t = 1.9 at the end of a session
(least squares in rate, growth and gain). No other value was tried."""
NEARLY_LINEAR = 1e-4
"""Size of g t below which three terms of the series are exact to a part in 1e13, and their derivative is finite."""


def gain_drift(m: Wheels, _: Wheels, time: Array, rate: Array, growth: Array) -> Wheels:
    """(1 + k T) m, not below 0: a battery that empties, a motor that warms up."""
    left = jnp.maximum(1.0 + rate * grown(time, growth), 0.0)
    return Wheels(m.right * left, m.left * left)


def dead_zone_drift(zone: Zone, time: Array, rate: Array, growth: Array) -> Zone:
    """D + k T, not below 0: wear, or grease that warms up."""
    drifted = rate * grown(time, growth)
    return Zone(*(Wheels(*(jnp.maximum(width + drifted, 0.0) for width in widths)) for widths in zone))


def grown(time: Array, growth: Array) -> Array:
    """T = (exp(g t) - 1) / g, or t where g is 0: how far a drift has come whose speed changes as exp(g t).

    What warms up comes to rest, and g is below 0; a battery near its end falls ever faster, and g is above 0. The drift
    ends where g t is MOST_GROWN.
    """
    z = jnp.minimum(growth * time, MOST_GROWN)
    small = jnp.abs(z) < NEARLY_LINEAR
    return jnp.where(small, time * (1.0 + 0.5 * z + z * z / 6.0), jnp.expm1(z) / jnp.where(small, 1.0, growth))


def payload_instant(ratio: Array, instant: Array) -> Array:
    """When the payload changes, in session time [s]."""
    return instant


def payload_change(changed: Array, ratio: Array, instant: Array) -> Array:
    """What accelerations are multiplied with: 1 / ratio once the payload has changed, 1 before."""
    return jnp.where(changed, 1.0 / ratio, 1.0)


def payload_lightness(time: Array, step: Array, loss: Array, instant: Array) -> Array:
    """`payload_change` over a substep about a session time, smooth in the instant: what accelerations keep."""
    return 1.0 - loss * jax.nn.sigmoid((time - instant) / step)


GROWTH = Parameter("growth", "1/s", 0.0, (-0.05, 0.05), 0.0, shape=True)
"""How fast the speed of a drift grows. Its range is that of time constants of 20 s and more; none was measured."""
RECORDS = (
    EffectRecord(
        name="gain_drift", site="time", stage="motor", step=statements.GAIN_DRIFT,
        words="the drive grows weaker or stronger with time, as when a battery runs down",
        equation="m -> (1 + k T) m, T = (exp(g t) - 1) / g, t the session time",
        source="discharge of batteries; Plett 2015, Battery Management Systems, ch. 2",
        parameters=(Parameter("rate", "1/s", 0.0, (-0.03, 0.03), -0.02), GROWTH),
        channels=BOTH,
        act=gain_drift, confused_with=("dead_zone_drift",), varies=True, timed=True,
        search=Search((signed("rate", 0.05), signed("growth", 0.1, shape=True))),
    ),
    EffectRecord(
        name="dead_zone_drift", site="time", stage="zone", step=statements.ZONE_DRIFT,
        words="the dead zones change with time, as by wear",
        equation="D -> D + k T, T = (exp(g t) - 1) / g, t the session time",
        source="run-in and wear of gears; Olsson et al. 1998, Eur. J. Control 4",
        parameters=(Parameter("rate", f"{UNIT}/s", 0.0, (-0.02, 0.02), 0.01), GROWTH),
        channels=BOTH,
        act=dead_zone_drift, rank=-1, confused_with=("gain_drift",), varies=True, timed=True,
        search=Search((signed("rate", 0.05), signed("growth", 0.1, shape=True))),
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

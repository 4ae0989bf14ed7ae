"""Accelerations along [m/s^2] and in heading [rad/s^2] on the speed side, and levels of dry friction at the wheels.

A wheel's speed n is expressed as the command that would hold it (see `friction`).
"""

import jax.numpy as jnp

from jaxident.array_types import Array, Wheels
from jaxident.effects import statements
from jaxident.effects.effect import ALONG, BOTH, UNIT, Coordinate, EffectRecord, Parameter, Search, positive, signed
from jaxident.effects.signals import Motion
from jaxident.robot.drive import Force


def coulomb_friction(n: Wheels, right: Array, left: Array) -> Wheels:
    """The same level F at any speed."""
    return Wheels(right + jnp.zeros_like(n.right), left + jnp.zeros_like(n.left))


def stiction(n: Wheels, right: Array, left: Array, fade: Array) -> Wheels:
    """F exp(-(n / n_s)^2): with `coulomb_friction` Stribeck's curve."""
    return Wheels(right * jnp.exp(-((n.right / fade) ** 2)), left * jnp.exp(-((n.left / fade) ** 2)))


def quadratic_drag(motion: Motion, along: Array, heading: Array) -> Force:
    """v' -= c v |v|, w' -= d w |w|."""
    v, w, _ = motion
    return Force(-along * v * jnp.abs(v), -heading * w * jnp.abs(w))


def mass_offset(motion: Motion, along: Array, heading: Array) -> Force:
    """v' += c w^2, w' -= d v w: the centre of mass lies c ahead of the axle; d = m c / (inertia + m c^2)."""
    v, w, _ = motion
    return Force(along * w * w, -heading * v * w)


def turn_loss(motion: Motion, loss: Array) -> Force:
    """v' -= c |w| v: castors and tyres scrub in curves."""
    v, w, _ = motion
    return Force(-loss * jnp.abs(w) * v, jnp.zeros_like(v))


def _levels(typical: float) -> tuple[Parameter, Parameter]:
    return (
        Parameter("right", UNIT, 0.0, (0.0, 0.2), typical, least=0.0),
        Parameter("left", UNIT, 0.0, (0.0, 0.2), 0.8 * typical, least=0.0),
    )


RECORDS = (
    EffectRecord(
        name="coulomb_friction", site="drive", stage="friction", step=statements.COULOMB, quantity="dry friction",
        words="dry friction, the same at any speed",
        equation="m -> m - F sign n, n the wheel's speed; at rest |F| up to its level",
        kinds=(("push of each wheel", "1", "own speed"),),
        source="Olsson et al. 1998, Friction models and friction compensation, Eur. J. Control 4",
        parameters=_levels(0.08), channels=BOTH,
        act=coulomb_friction, confused_with=("asymmetric_dead_zone", "quadratic_drag"), sharp=True,
        search=Search((positive("right", 0.5), positive("left", 0.5)), on_speeds=True),
    ),
    EffectRecord(
        name="stiction", site="drive", stage="friction", step=statements.STRIBECK,
        words="it takes more to leave rest than to keep moving",
        equation="m -> m - F exp(-(n / n_s)^2) sign n; at rest |F| up to its level",
        kinds=(("push of each wheel", "1", "own speed"),),
        source="Armstrong-Helouvry, Dupont, Canudas de Wit 1994, Automatica 30 (Stribeck's curve)",
        parameters=(*_levels(0.1), Parameter("fade", UNIT, 0.05, (0.01, 0.2), 0.05, least=0.0, above=True, shape=True)),
        channels=BOTH,
        act=stiction, confused_with=("coulomb_friction",), smooth=False, grid=(0.01, 0.02, 0.05, 0.1, 0.15, 0.2),
        sharp=True,
        search=Search((positive("right", 0.6), positive("left", 0.6),
                       Coordinate("fade", 0.05, 0.005, 0.4, 0.05, shape=True)), on_speeds=True,
                      seeds=lambda _: [{"right": s, "left": s, "fade": fade}
                                       for s, fade in ((0.05, 0.05), (0.15, 0.05), (0.1, 0.15))]),
    ),
    EffectRecord(
        name="quadratic_drag", site="drive", stage="body", step=statements.DRAG,
        words="drag that grows with the square of the speed",
        equation="v' -= c v |v|, w' -= d w |w|",
        kinds=(("acceleration along", "1", "v"), ("acceleration in heading", "1", "w")),
        source="Fossen 2011, Handbook of Marine Craft, ch. 6; fans and brushes on land",
        parameters=(Parameter("along", "1/m", 0.0, (0.0, 2.0), 0.5, least=0.0),
                    Parameter("heading", "1/rad", 0.0, (0.0, 2.0), 0.3, least=0.0)),
        channels=BOTH,
        act=quadratic_drag, confused_with=("coulomb_friction", "turn_loss"),
        search=Search((Coordinate("along", 0.0, 0.0, 100.0, 3.0, accelerates=0),
                       positive("heading", 5.0, accelerates=1)), on_speeds=True),
    ),
    EffectRecord(
        name="mass_offset", site="drive", stage="body", step=statements.MASS_OFFSET,
        words="the centre of mass lies off the axle",
        equation="v' += c w^2, w' -= d v w",
        kinds=(("acceleration along", "1", "w"), ("acceleration in heading", "v", "w"),
               ("acceleration in heading", "w", "v"), ("acceleration in heading", "1", "v", "w")),
        source="Fierro, Lewis 1998, Control of a nonholonomic mobile robot, IEEE TNN 9",
        parameters=(Parameter("along", "m", 0.0, (-0.1, 0.1), 0.01),
                    Parameter("heading", "1/m", 0.0, (-20.0, 20.0), 3.0)),
        channels=BOTH,
        act=mass_offset, confused_with=("turn_loss",),
        search=Search((signed("along", 0.4, accelerates=0), signed("heading", 40.0, accelerates=1)), on_speeds=True),
    ),
    EffectRecord(
        name="turn_loss", site="drive", stage="body", step=statements.TURN_LOSS,
        words="speed is lost while turning",
        equation="v' -= c |w| v",
        kinds=(("acceleration along", "v", "w"), ("acceleration along", "1", "v", "w")),
        source="castor scrub; Wong 2008, Theory of Ground Vehicles, ch. 6",
        parameters=(Parameter("loss", "1/rad", 0.0, (0.0, 20.0), 0.1, least=0.0),), channels=(ALONG,),
        act=turn_loss, confused_with=("quadratic_drag", "mass_offset"), sharp=True,
        search=Search((Coordinate("loss", 0.0, 0.0, 50.0, 0.6, accelerates=0),), on_speeds=True),
    ),
)  # fmt: skip
"""The effects of this site."""

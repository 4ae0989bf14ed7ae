"""The model of one robot: what a model file holds."""

import dataclasses
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import DifferenceVector, PerWheel
from jaxident.errors import InputError
from jaxident.origin import Origin
from jaxident.robot.difference import Difference, to_difference
from jaxident.robot.drive import Physical
from jaxident.robot.noise import Noise
from jaxident.robot.wheel_sensor import WheelSensor

DIFFERENCE_ORDER = (
    "alpha_1", "alpha_2",
    "delta_11", "delta_12", "delta_21", "delta_22",
    "epsilon_11", "epsilon_12", "epsilon_21", "epsilon_22",
    "dead_zone_r", "dead_zone_l",
)  # fmt: skip
"""Names of the twelve numbers of (13)-(14) with their dead zones, in the order of `difference_vector`."""


class Provenance(NamedTuple):
    """Where a model comes from. duration [s]: of all its logs, after which the session time goes on; runs: the mark by
    which each run is known again (`estimation.session`), and the session time [s] of its first row. from_prior: names
    of parameters that come mostly from what is known of robots in general, not from these logs. at_bound: names of
    those that stand at a bound of their search. origin: the command that wrote the model, None for a model from
    elsewhere."""

    version: str = ""
    method: str = ""
    logs: tuple[str, ...] = ()
    seed: int | None = None
    duration: float = 0.0
    runs: tuple[tuple[str, float], ...] = ()
    from_prior: tuple[str, ...] = ()
    at_bound: tuple[str, ...] = ()
    origin: Origin | None = None


class Spread(NamedTuple):
    """Standard deviation of each parameter, in the shape of the parameter; None where it was not estimated."""

    alpha: Any = None
    delta: Any = None
    epsilon: Any = None
    dead_zone: Any = None
    physical: Physical | None = None
    noise: Noise | None = None
    wheels: WheelSensor | None = None


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True)
class Effect:
    """An unmodelled effect in force: its catalogue name, its parameters and their standard deviations or None."""

    name: str = dataclasses.field(metadata={"static": True})
    parameters: dict[str, Any]
    standard_deviation: dict[str, Any] | None = None


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True)
class Discovered:
    """A law in no catalogue that logs showed: `acts_on` gets `times` times a curve of a signal, or times a surface of
    two. What these three may be, and their units: ACTS, TIMES and SIGNALS of `effects.law_kinds`.

    at, value (knots,): the curve, straight between the knots and constant beyond; standard_deviation (knots,) of its
    values, or None. A surface has a second_signal, second_at (second knots,), and values and deviations (knots, second
    knots). A law that goes by the angle of a wheel has the period [m], the wheel's way from turn to turn, and
    half_track [m], the wheel's place to the right of the middle: angle = 2 pi (way + half_track heading) / period,
    beside an angle at the beginning that is another one in each run.
    """

    acts_on: str = dataclasses.field(metadata={"static": True})
    times: str = dataclasses.field(metadata={"static": True})
    signal: str = dataclasses.field(metadata={"static": True})
    at: Any
    value: Any
    standard_deviation: Any = None
    second_signal: str = dataclasses.field(default="", metadata={"static": True})
    second_at: Any = None
    period: Any = None
    half_track: Any = None


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True)
class Model:
    """A robot: dead zones, then a linear drive. A pytree: numbers are leaves, names are structure.

    Attributes:
        sample_period: time between two rows [s].
        dynamics: `Physical`, true at any sample period, or `Difference`, the paper's free numerators, true at
            `sample_period` only. `alpha` (2,), `delta` and `epsilon` (2, 2) are read from either.
        dead_zone: of the right and the left wheel (2,) [unit of the command].
        noise: of the camera and of slip, None where it is not known.
        effects: unmodelled effects in force.
        standard_deviation: of the parameters, None where they were not estimated.
        covariance: of the parameters in `parameter_order`.
        parameter_order: names.
        provenance: where the model comes from.
        discovered: laws in no catalogue.
        wheels: sensor of the wheel speeds, for a robot that measures them.
    """

    sample_period: Any
    dynamics: Physical | Difference
    dead_zone: Any
    noise: Noise | None = None
    effects: tuple[Effect, ...] = ()
    standard_deviation: Spread | None = None
    covariance: Any = None
    parameter_order: tuple[str, ...] = dataclasses.field(default=(), metadata={"static": True})
    provenance: Provenance = dataclasses.field(default=Provenance(), metadata={"static": True})
    discovered: tuple[Discovered, ...] = ()
    wheels: WheelSensor | None = None

    @property
    def physical(self) -> Physical | None:
        """The continuous-time parameters, or None for a model of free numerators."""
        return self.dynamics if isinstance(self.dynamics, Physical) else None

    @property
    def difference(self) -> Difference:
        """Parameters of (13)-(14) at the sample period: as identified, or the hold image of the physical ones."""
        if isinstance(self.dynamics, Difference):
            return self.dynamics
        return to_difference(self.dynamics, self.sample_period)

    @property
    def alpha(self):
        """Poles [a1, a2] at the sample period."""
        return self.difference.alpha

    @property
    def delta(self):
        """First numerator coefficients (2, 2) at the sample period [m, rad per unit of command]."""
        return self.difference.delta

    @property
    def epsilon(self):
        """Second numerator coefficients (2, 2), with the sign of (13)-(14) [m, rad per unit of command]."""
        return self.difference.epsilon


def require_physical(model: Model) -> Physical:
    """The model's drive in physical parameters; InputError for a model of free numerators."""
    if isinstance(model.dynamics, Physical):
        return model.dynamics
    raise InputError("physical: null; this needs a model with physical parameters, not one of free numerators")


def difference_vector(difference: Difference, dead_zone: PerWheel) -> DifferenceVector:
    """The twelve numbers of (13)-(14) and the dead zones as one array (12,), in DIFFERENCE_ORDER."""
    return jnp.concatenate([jnp.ravel(jnp.asarray(part)) for part in (*difference, dead_zone)])

"""The motors alone, by measured wheel speeds: what the wheels make of the commands, whatever the robot does.

The mean m of both wheel speeds and half their difference h answer the commands as the nominal drive does:

    m' = -rate_1 m + gain of the commands past their dead zones, a delay before        (h likewise with rate_2)

With wheels in the air this is all that a log can show. On the ground it is the part before the wheels. NumPy alone;
needs double precision.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.effects.catalogue import CATALOGUE
from jaxident.errors import InputError
from jaxident.estimation.motor_fit import MotorFit, WheelRun, covariance_of, search, wheel_runs
from jaxident.estimation.suspicions.heading import SURE as CLEAR
from jaxident.estimation.suspicions.wheel_answer import answer_of_wheels
from jaxident.estimation.suspicions.wheel_suspicions import WRONG_WHEELS
from jaxident.log import Log, join
from jaxident.robot.drive import Physical
from jaxident.robot.model import Effect, Model, Provenance, Spread, require_physical
from jaxident.robot.wheel_sensor import WheelSensor

ZONES = (0.02, 0.1, 0.3)
"""Dead zones, in largest commands, from which the search begins; the best end is taken. No others were tried."""
SURE = 2.0
"""Standard deviations from zero from which a delay is believed. No other number was tried."""
NEITHER = "the wheels do not turn as they are told: commands or wheel speeds are in a wrong order or have a wrong sign"
ORDER = ("rate_1", "rate_2", "gain_11", "gain_12", "gain_21", "gain_22", "dead_zone_r", "dead_zone_l")
(DELAY,) = (name for name, record in CATALOGUE.items() if record.quantity == "delay")
"""The effect of the catalogue that makes commands late, whose first parameter is by how much."""


class Motors(NamedTuple):
    """What wheel speeds say of the motors.

    Attributes:
        model: the robot that moves as its wheels turn: no slip, no camera.
        delay: from a command to the first answer [s]; 0 where it is less than SURE of its deviations.
        delay_deviation: its standard deviation [s].
        explained: share of the squares of the mean and of half the difference of the wheel speeds that the model
            explains (2,).
        every: how many rows say as much as one independent one; the intervals are the wider for it.
        measured: mean and half the difference of the wheel speeds [rad/s], (2, rows), NaN where one is missing.
        modelled: the same of the model.
    """

    model: Model
    delay: float
    delay_deviation: float
    explained: Any
    every: float
    measured: Any
    modelled: Any

    @property
    def drive(self) -> Physical:
        """Rates (2,) [1/s] and gains (2, 2) of the model."""
        return require_physical(self.model)

    @property
    def sensor(self) -> WheelSensor:
        """Radius [m], track [m] and noise [rad/s] of the wheel speeds."""
        assert self.model.wheels is not None  # `identify_motors` gives every model one
        return self.model.wheels


def against(found: Motors) -> tuple[str, ...]:
    """A line where the wheels turn against the commands, or one of them does, with the option that mends it."""
    gain, order = np.asarray(found.drive.gain), list(found.model.parameter_order)
    deviation = np.sqrt(np.diagonal(np.asarray(found.model.covariance)))[[order.index(name) for name in ORDER[2:6]]]
    signs = np.sign(gain).astype(int).ravel().tolist()
    if not np.all(np.abs(gain).ravel() > CLEAR * deviation) or signs == [1, 1, 1, -1]:
        return ()
    return (WRONG_WHEELS.get((signs[0], signs[1], signs[2], signs[3]), NEITHER),)


def identify_motors(logs: Log | Sequence[Log], radius: float, track: float) -> Motors:
    """Identify the motors of a robot from its wheel speeds alone, on blocks or on the ground.

    Args:
        logs: commands and wheel speeds; poses are not read.
        radius: of the wheels [m].
        track: distance between the wheels [m].

    Returns:
        Motors: a model with rates, gains, dead zones and delay of the motors, with standard deviations; how much of the
            wheels' motion it explains.

    Raises:
        InputError: no wheel speeds, too few of them, or wheels that do not follow the commands.

    Examples:
        >>> import dataclasses, jax, jaxident as ji
        >>> ji.start_jax()
        >>> robot = dataclasses.replace(ji.load_model("published"), wheels=ji.WheelSensor(0.03, 0.1, 0.05))
        >>> log = ji.simulate(robot, ji.excite(jax.random.key(0), "multilevel", 900, robot.sample_period),
        ...                   key=jax.random.key(1))
        >>> print(ji.identify_motors(log, 0.03, 0.1))
        The wheels answer ...
    """
    if not (0.0 < radius < np.inf and 0.0 < track < np.inf):
        raise InputError(f"wheels: radius {radius:g} m and track {track:g} m should be above 0")
    log = join(logs)
    if log.wheel_r is None:
        raise InputError("the log has no wheel speeds (columns wheel_r, wheel_l)")
    runs = wheel_runs(log)
    answer = answer_of_wheels(log)
    if answer is None:
        raise InputError("the wheels do not follow the commands, or two delays do as well as each other")
    largest = float(max(np.max(np.abs(run.command)) for run in runs))
    rates = 1.0 / np.maximum(answer.lag, 1e-3)
    begins = [np.array([*np.log(rates), max(answer.delay, 0.0), zone * largest, zone * largest]) for zone in ZONES]
    fit = min((search(runs, begin, largest) for begin in begins), key=lambda each: each.squares)
    covariance, every = covariance_of(runs, fit)
    if not fit.point[2] > SURE * np.sqrt(covariance[2, 2]):
        fit = search(runs, fit.point * [1.0, 1.0, 0.0, 1.0, 1.0], largest, late=False)
        covariance, every = covariance_of(runs, fit)
    return _told(log, runs, fit, covariance, every, WheelSensor(radius, track))


def _told(
    log: Log, runs: list[WheelRun], fit: MotorFit, covariance: Array, every: float, sensor: WheelSensor
) -> Motors:
    """The fit as a model in the robot's units: v = radius m, w = 2 radius h / track; v' = -rate v + gain u."""
    rates, steady = np.exp(fit.point[:2]), np.stack([each[:2] for each in fit.coefficients])
    units = np.array([sensor.radius, 2.0 * sensor.radius / sensor.track])
    gain = (rates * units)[:, None] * steady
    slopes = np.zeros((9, 9))  # by log rates, delay, zones, steady gains; rows as ORDER, then the delay
    slopes[[0, 1], [0, 1]] = rates
    for c in (0, 1):
        for side in (0, 1):
            slopes[2 + 2 * c + side, c], slopes[2 + 2 * c + side, 5 + 2 * c + side] = gain[c, side], rates[c] * units[c]
    slopes[[6, 7, 8], [3, 4, 2]] = 1.0
    whole = slopes @ covariance @ slopes.T
    deviation, delay = np.sqrt(np.maximum(np.diagonal(whole), 0.0)), float(fit.point[2])
    late = delay > 0.0
    key = CATALOGUE[DELAY].parameters[0].name
    names = (*ORDER, f"{DELAY}.{key}") if late else ORDER
    noise = float(np.sqrt(fit.squares / max(len(fit.residual) - 9, 1)))
    model = Model(
        float(np.median(np.concatenate([np.diff(run.t) for run in runs]))), Physical(rates, gain), fit.point[3:],
        effects=(Effect(DELAY, {key: delay}, {key: float(deviation[8])}),) if late else (),
        standard_deviation=Spread(dead_zone=deviation[6:8],
                                  physical=Physical(deviation[:2], deviation[2:6].reshape(2, 2), np.zeros(2))),
        covariance=whole[: len(names), : len(names)], parameter_order=names,
        provenance=Provenance(method="wheel speeds alone"), wheels=sensor._replace(noise=noise),
    )  # fmt: skip
    measured, modelled = np.full((2, 2, len(log.t)), np.nan)
    for own, values in ((measured, np.concatenate([run.speed for run in runs], axis=1)), (modelled, fit.modelled)):
        own[:, np.concatenate([run.rows for run in runs])] = values
    left = np.nansum((measured - modelled) ** 2, axis=1) / np.maximum(np.nansum(measured**2, axis=1), 1e-300)
    return Motors(model, delay, float(deviation[8]), 1.0 - left, every, measured, modelled)

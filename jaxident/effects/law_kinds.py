"""What a discovered law may act on and depend on, what it is called, and which laws no program can run."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from jaxident.effects.effect import UNIT
from jaxident.effects.past import CHANGE_TIMES, HEAT_TIMES, REVERSAL_TIMES, Past
from jaxident.errors import InputError
from jaxident.robot.model import Discovered

SQUARE = f"{UNIT}^2"
HEATS = {f"own heat {tau:g} s": tau for tau in HEAT_TIMES}
CHANGES = {f"own change {tau:g} s": tau for tau in CHANGE_TIMES}
MEMORIES = HEATS | CHANGES
"""Signals that remember the wheel's own command, and the time constant [s] of each."""
SENSE = "own sense"
REVERSALS = {"since reversal" + (f" {tau:g} s" if tau else ""): tau for tau in REVERSAL_TIMES}
DIRECTIONS = {"direction" + (f" {tau:g} s" if tau else ""): tau for tau in REVERSAL_TIMES}
"""The time since a mean of the commands last changed its sign, and this sign; time constant [s] of each mean."""
DISCOVERED = "discovered"
"""The key of laws among the settings of a program."""
MOST_LAWS, MOST_KNOTS, MOST_SURFACE_KNOTS = 3, 16, 9
"""Laws of one model, knots of a curve, and knots of a surface along each of its signals. Every set of curves runs
through one compiled program, every set with a surface through another."""
ACTS = {
    "acceleration along": "m/s^2", "acceleration in heading": "rad/s^2", "speed sideways": "m/s",
    "push of each wheel": UNIT, "pose ahead": "m", "pose to the left": "m", "reported heading": "rad",
    "push of the right wheel": UNIT, "push of the left wheel": UNIT, "rolling of the right wheel": UNIT,
    "rolling of the left wheel": UNIT,
}  # fmt: skip
"""What a law may add to, and the unit. rolling: the wheel's speed over the ground, as the command that holds it."""
ALONG, HEADING, SIDEWAYS, WHEELS, AHEAD, LEFT, TURN, *OF_ONE_WHEEL = ACTS
BY_CAMERA, PUSHES, ROLLINGS = (AHEAD, LEFT, TURN), tuple(OF_ONE_WHEEL[:2]), tuple(OF_ONE_WHEEL[2:])
ANGLE = "own angle"
"""The signal of a law for one wheel: this wheel's angle. Nobody knows what it is when a run begins; poses tell it."""
TURNING = ("period", "half_track")
"""What such a law has beside its curve (`Discovered`)."""
SIGNALS = {
    "v": "m/s", "w": "rad/s", "heading": "rad", "x": "m", "y": "m", "time": "s", "push right": UNIT,
    "push left": UNIT, **dict.fromkeys(REVERSALS, "s"), "own speed": UNIT, "own push": UNIT,
    **dict.fromkeys(HEATS, SQUARE), **dict.fromkeys(CHANGES, UNIT), ANGLE: "rad",
}  # fmt: skip
"""What a curve may depend on, and the unit. time: session time. since reversal: since the commands' sum, or its mean
over some seconds, last changed its sign (`past`). own: of the wheel that is pushed; its speed is in the commands that
hold it, its heat a mean of its squared command over some seconds, its change the command less the mean over them."""
SIGNAL_WORDS = {
    "v": "speed v", "w": "turn rate w", "heading": "heading", "x": "position x", "y": "position y",
    "time": "session time", "push right": "push of the right wheel", "push left": "push of the left wheel",
    "own speed": "speed of that wheel", "own push": "push of that wheel",
    **{name: "time since " + (f"the commands' mean over {tau:g} s turned round" if tau else "a reversal")
       for name, tau in REVERSALS.items()},
    **{name: f"mean square of that wheel's command over {tau:g} s" for name, tau in HEATS.items()},
    **{name: f"change of that wheel's command over {tau:g} s" for name, tau in CHANGES.items()},
    ANGLE: "angle of that wheel",
}  # fmt: skip
"""Each signal in words."""
OF_CAMERA = ("heading", "x", "y")
"""Signals that a camera's error may depend on."""
TIMES = {"1": "", "v": "m/s", "w": "rad/s", "cos heading": "", "sin heading": "", "own push": UNIT,
         "own speed": UNIT, "v cos heading": "m/s", "v sin heading": "m/s",
         **dict.fromkeys(CHANGES, UNIT), **dict.fromkeys(DIRECTIONS, ""), SENSE: ""}  # fmt: skip
"""What a curve may be multiplied with, and the unit. direction: 1 forward, -1 backward, as the commands' sum or its
mean over some seconds says. own sense: 1 where the wheel's command was last raised, -1 where it was lowered."""


def value_name(law: int, knot: int) -> str:
    """What a model's covariance calls the value of a law at one of its knots, both counted from 0; knots of a surface
    row by row."""
    return f"{DISCOVERED}.{law + 1}.{knot + 1}"


def remembered(past: Past, axis: int = 0) -> dict[str, Any]:
    """What the commands of each wheel left behind, by signal. axis: that of the time constants, 0 or 1."""
    each = (row for part in (past.heat, past.change, past.sense) for row in part.swapaxes(axis, 0))
    return dict(zip([*MEMORIES, SENSE], each, strict=True))


def directions(past: Past, axis: int = 0) -> dict[str, Any]:
    """Directions and times since they changed, by name. axis: that of the time constants, 0 or 1, before that of these
    two."""
    direction, since = past.reversal.swapaxes(axis + 1, 0)
    return dict(zip(DIRECTIONS, direction, strict=True)) | dict(zip(REVERSALS, since, strict=True))


def knots_by_signal(law: Discovered) -> dict[str, np.ndarray]:
    """Knots of a law's curve by its signal, or of its surface by both."""
    second = {law.second_signal: np.asarray(law.second_at, float)} if law.second_signal else {}
    return {law.signal: np.asarray(law.at, float)} | second


def check_discovered(laws: Sequence[Discovered]) -> None:
    """InputError for laws that no program can run: too many, of an unknown kind, or with knots out of order."""
    if len(laws) > MOST_LAWS:
        raise InputError(f"{len(laws)} discovered laws; at most {MOST_LAWS} are possible")
    for law in laws:
        _check_kind(law)
        knots, most = knots_by_signal(law).values(), MOST_SURFACE_KNOTS if law.second_signal else MOST_KNOTS
        for at in knots:
            if not 2 <= len(at) <= most:
                raise InputError(f"discovered: {len(at)} knots; 2 to {most} are possible")
            if not (np.all(np.isfinite(at)) and np.all(np.diff(at) > 0.0)):
                raise InputError("discovered: knots are out of order, or one is not finite")
        shape = tuple(map(len, knots))
        if np.shape(law.value) != shape:
            given, asked = (" x ".join(map(str, each)) for each in (np.shape(law.value), shape))
            raise InputError(f"discovered: {asked} knots and {given} values; as many are needed")
        if not np.all(np.isfinite(law.value)):
            raise InputError("discovered: a value is not finite")


def _check_kind(law: Discovered) -> None:
    choices = (("acts_on", law.acts_on, ACTS), ("times", law.times, TIMES), ("signal", law.signal, SIGNALS),
               ("second_signal", law.second_signal, ("", *SIGNALS)))  # fmt: skip
    for key, value, known in choices:
        if value not in known:
            raise InputError(f"discovered: {key} is {value!r}; known are {', '.join(known)}")
    signals = {law.signal, law.second_signal} - {""}
    by_camera, own = law.acts_on in BY_CAMERA, any(name.startswith("own ") for name in (*signals, law.times))
    if by_camera and (not signals <= set(OF_CAMERA) or law.times != "1"):
        raise InputError(f"discovered: an error of the camera is 1 times a curve of {' or '.join(OF_CAMERA)}")
    if own != (law.acts_on == WHEELS or law.acts_on in OF_ONE_WHEEL):
        raise InputError("discovered: a push of each wheel is, or is times, a curve of what is the wheel's own")
    if law.signal == law.second_signal:
        raise InputError(f"discovered: a surface of {law.signal} and {law.signal}; two signals are needed")
    _check_angle(law)


def _check_angle(law: Discovered) -> None:
    by_angle = ANGLE in (law.signal, law.second_signal)
    if by_angle != (law.acts_on in OF_ONE_WHEEL) or (by_angle and law.second_signal):
        raise InputError(f"discovered: a law for one wheel is a curve of its {ANGLE}, and no other law is")
    numbers = [number for key in TURNING if (number := getattr(law, key)) is not None]
    if len(numbers) != 2 * by_angle or not np.all(np.isfinite(numbers)) or (by_angle and law.period <= 0.0):
        raise InputError(f"discovered: a curve of the {ANGLE}, and no other, has a period above 0 and a half_track")


def scaled(law: Discovered, factor: float) -> Discovered:
    """The law for commands that are `factor` times as large."""
    up = value_scale(law.acts_on, law.times, factor)
    spread = None if law.standard_deviation is None else up * np.asarray(law.standard_deviation)
    at, *second = (_scale(SIGNALS[signal], factor) * knots for signal, knots in knots_by_signal(law).items())
    return dataclasses.replace(
        law, at=at, value=up * np.asarray(law.value, float), standard_deviation=spread,
        second_at=second[0] if second else None,
    )  # fmt: skip


def value_scale(acts_on: str, times: str, factor: float) -> float:
    """How many times as large a law's values are for commands that are `factor` times as large."""
    return _scale(ACTS[acts_on], factor) / _scale(TIMES[times], factor)


def _scale(unit: str, factor: float) -> float:
    return {UNIT: factor, SQUARE: factor**2}.get(unit, 1.0)


def value_unit(law: Discovered) -> str:
    """The unit of a law's values."""
    return f"{ACTS[law.acts_on]} per {TIMES[law.times]}" if TIMES[law.times] else ACTS[law.acts_on]

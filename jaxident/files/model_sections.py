"""The sections of a model file, each read and written here.

Readers take what stands in the file and the words that name it in error lines; writers give it back.
"""

from collections.abc import Callable, Collection
from typing import Any, TypeVar

import numpy as np

from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.checks import check_parameters
from jaxident.effects.law_kinds import TURNING, check_discovered
from jaxident.errors import InputError
from jaxident.files.schema import Shape, take_array, take_keys, take_list, take_number, take_object, take_text
from jaxident.robot.drive import Physical
from jaxident.robot.model import Discovered, Effect, Spread
from jaxident.robot.noise import Noise
from jaxident.robot.wheel_sensor import WheelSensor

SHAPES: dict[str, Shape] = {"alpha": (2,), "delta": (2, 2), "epsilon": (2, 2), "dead_zone": (2,)}
PHYSICAL_SHAPES: dict[str, Shape] = {"rate": (2,), "gain": (2, 2), "coupling": (2,)}
_NOISE_NEEDED = ("position", "heading")
_NOISE_NONE = ("correlation_time", "slip_time", "white_position", "white_heading")
_NOISE_FREE = tuple(name for name in Noise._fields if name not in _NOISE_NEEDED)

Written = TypeVar("Written")


def or_none(convert: Callable[..., Written], value: Any, *rest: Any) -> Written | None:
    """The conversion, which leaves a section that is not there (None, null) as it is."""
    return None if value is None else convert(value, *rest)


def to_lists(value: Any) -> Any:
    """Numbers of any shape as nested lists of Python floats."""
    return np.asarray(value, float).tolist()


def read_physical(value: Any, where: str) -> Physical:
    """Rate, gain and coupling as arrays; a coupling of zeros is none."""
    found = take_keys(value, where, ("rate", "gain"), ("coupling",))
    given = found if found["coupling"] is not None else {**found, "coupling": [0.0, 0.0]}
    arrays = {key: take_array(given[key], f"{where}.{key}", shape) for key, shape in PHYSICAL_SHAPES.items()}
    return Physical(arrays["rate"], arrays["gain"], arrays["coupling"] if arrays["coupling"].any() else None)


def write_physical(physical: Physical) -> dict[str, Any]:
    """Rate, gain and coupling as lists; no coupling is one of zeros."""
    coupling = [0.0, 0.0] if physical.coupling is None else physical.coupling
    return {"rate": to_lists(physical.rate), "gain": to_lists(physical.gain), "coupling": to_lists(coupling)}


def read_noise(value: Any, where: str) -> Noise:
    """The noise law; a correlation time of zero is none, a slip or a white part that is not given is zero."""
    found = take_keys(value, where, _NOISE_NEEDED, _NOISE_FREE)
    given = {key: 0.0 if key in _NOISE_FREE and entry is None else entry for key, entry in found.items()}
    noise = Noise(**{key: take_number(entry, f"{where}.{key}", least=0.0) for key, entry in given.items()})
    return noise._replace(**{key: getattr(noise, key) or None for key in _NOISE_NONE})


def write_noise(noise: Noise) -> dict[str, Any]:
    """The noise law; white noise has the correlation time null. Keys that came later stand there where they matter."""
    kept = {key: value for key, value in noise._asdict().items() if value is not None or key == "correlation_time"}
    return {key: or_none(to_lists, value) for key, value in kept.items()}


def read_wheels(value: Any, where: str) -> WheelSensor:
    """The sensor of wheel speeds; a radius and a track above zero."""
    found = take_keys(value, where, WheelSensor._fields[:2], WheelSensor._fields[2:])
    given = {key: 0.0 if entry is None else entry for key, entry in found.items()}
    sensor = WheelSensor(**{key: take_number(entry, f"{where}.{key}", least=0.0) for key, entry in given.items()})
    for key in ("radius", "track"):
        if getattr(sensor, key) == 0.0:
            raise InputError(f"{where}.{key}: is 0; it should be a positive length in metres")
    return sensor


def write_wheels(sensor: WheelSensor) -> dict[str, Any]:
    """Radius, track and noise."""
    return {key: to_lists(value) for key, value in sensor._asdict().items()}


def read_effects(value: Any, where: str, known: Collection[str]) -> tuple[Effect, ...]:
    """The effects in force, each of them known and named once."""
    effects = tuple(_read_effect(entry, f"{where}[{k}]") for k, entry in enumerate(take_list(value, where)))
    names = [effect.name for effect in effects]
    for k, name in enumerate(names):
        if name not in known:
            catalogue = ", ".join(known) or "none here"
            raise InputError(f"{where}[{k}].name: unknown effect {name!r}; known are: {catalogue}")
        if name in names[:k]:
            raise InputError(f"{where}[{k}].name: effect {name!r} stands twice; keep one")
        if name in CATALOGUE:
            _check_values(effects[k], f"{where}[{k}].parameters")
    return effects


def _check_values(effect: Effect, where: str) -> None:
    """What the catalogue says of the effect's parameters."""
    try:
        check_parameters(CATALOGUE[effect.name], effect.parameters)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def _read_effect(value: Any, where: str) -> Effect:
    found = take_keys(value, where, ("name", "parameters"), ("standard_deviation",))
    parameters = {
        name: take_number(entry, f"{where}.parameters.{name}")
        for name, entry in take_object(found["parameters"], f"{where}.parameters").items()
    }
    return Effect(
        name=take_text(found["name"], f"{where}.name"),
        parameters=parameters,
        standard_deviation=or_none(
            _read_deviations, found["standard_deviation"], f"{where}.standard_deviation", parameters
        ),
    )


def _read_deviations(value: Any, where: str, names: Collection[str]) -> dict[str, float | None]:
    """Standard deviations by name, None where none was estimated."""
    found = take_keys(value, where, (), tuple(names))
    return {name: or_none(_take_deviation, found[name], f"{where}.{name}") for name in value}


def _take_deviation(value: Any, where: str) -> float:
    return take_number(value, where, least=0.0)


def write_effect(effect: Effect) -> dict[str, Any]:
    """Name, parameters and their standard deviations."""
    return {
        "name": effect.name,
        "parameters": {name: to_lists(value) for name, value in effect.parameters.items()},
        "standard_deviation": write_deviations(effect.standard_deviation),
    }


SECOND = ("second_signal", "second_at")
"""Keys of a law that is a surface."""


def read_discovered(value: Any, where: str) -> tuple[Discovered, ...]:
    """The discovered laws, each of a kind that this program knows."""
    laws = tuple(_read_law(entry, f"{where}[{k}]") for k, entry in enumerate(take_list(value, where)))
    try:
        check_discovered(laws)
    except InputError as error:
        raise InputError(f"{where}: {str(error).removeprefix('discovered: ')}") from None
    return laws


def _read_law(value: Any, where: str) -> Discovered:
    more = ("times", "standard_deviation", *SECOND, *TURNING)
    found = take_keys(value, where, ("acts_on", "signal", "at", "value"), more)
    words = {key: take_text(found[key] or "1", f"{where}.{key}") for key in ("acts_on", "times", "signal")}
    keys, second = ["at"], ""
    if any(found[key] is not None for key in SECOND):
        keys, second = ["at", "second_at"], take_text(found["second_signal"], f"{where}.second_signal")
    shape = tuple(len(take_list(found[key], f"{where}.{key}")) for key in keys)
    knots = [take_array(found[key], f"{where}.{key}", (count,)) for key, count in zip(keys, shape, strict=True)]
    values, spread = take_array(found["value"], f"{where}.value", shape), found["standard_deviation"]
    if spread is not None:
        spread = take_array(spread, f"{where}.standard_deviation", shape, least=0.0, gaps=True)
    period, half_track = (or_none(take_number, found[key], f"{where}.{key}") for key in TURNING)
    return Discovered(**words, at=knots[0], value=values, standard_deviation=spread, second_signal=second,
                      second_at=knots[1] if second else None, period=period, half_track=half_track)  # fmt: skip


def write_discovered(law: Discovered) -> dict[str, Any]:
    """What a law acts on, its signals and its curve or surface."""
    words = {"acts_on": law.acts_on, "times": law.times, "signal": law.signal}
    curve = {"at": to_lists(law.at), "value": to_lists(law.value)}
    second = {"second_signal": law.second_signal, "second_at": to_lists(law.second_at)} if law.second_signal else {}
    turning = {key: float(getattr(law, key)) for key in TURNING if getattr(law, key) is not None}
    return {**words, **curve, **second, **turning, "standard_deviation": write_deviations(law.standard_deviation)}


def read_spread(value: Any, where: str) -> Spread:
    """Standard deviations in the shape of the parameters: None where a whole entry is null, NaN where a number is."""
    found = take_keys(value, where, (), (*SHAPES, "physical", "noise", "wheels"))
    arrays = _read_gapped({key: found[key] for key in SHAPES}, where, SHAPES)
    return Spread(
        **arrays,
        physical=or_none(_read_physical_spread, found["physical"], f"{where}.physical"),
        noise=or_none(_read_noise_spread, found["noise"], f"{where}.noise"),
        wheels=or_none(_read_wheels_spread, found["wheels"], f"{where}.wheels"),
    )


def _read_physical_spread(value: Any, where: str) -> Physical:
    found = take_keys(value, where, ("rate", "gain"), ("coupling",))
    return Physical(**_read_gapped(found, where, PHYSICAL_SHAPES))


def _read_noise_spread(value: Any, where: str) -> Noise:
    found = take_keys(value, where, (), Noise._fields)
    return Noise(**{key: or_none(_take_deviation, entry, f"{where}.{key}") for key, entry in found.items()})


def _read_wheels_spread(value: Any, where: str) -> WheelSensor:
    found = take_keys(value, where, (), WheelSensor._fields)
    return WheelSensor(**{key: or_none(_take_deviation, entry, f"{where}.{key}") for key, entry in found.items()})


def _read_gapped(values: dict[str, Any], where: str, shapes: dict[str, Shape]) -> dict[str, np.ndarray | None]:
    return {
        key: None if value is None else take_array(value, f"{where}.{key}", shapes[key], least=0.0, gaps=True)
        for key, value in values.items()
    }


def write_deviations(value: Any) -> Any:
    """Standard deviations by name and as lists, null for every number that is none or not finite."""
    if value is None:
        return None
    if isinstance(value, Spread):
        kept = {key: entry for key, entry in value._asdict().items() if key != "wheels" or entry is not None}
        return write_deviations(kept)
    if isinstance(value, Physical | Noise | WheelSensor):
        return write_deviations(value._asdict())
    if isinstance(value, dict):
        return {name: write_deviations(entry) for name, entry in value.items()}
    if np.ndim(value):
        return [write_deviations(entry) for entry in value]
    return float(value) if np.isfinite(value) else None


def read_covariance(value: Any, where: str) -> tuple[tuple[str, ...], np.ndarray]:
    """The order of the parameters and their covariance (parameters, parameters)."""
    found = take_keys(value, where, ("parameter_order", "matrix"))
    names = take_list(found["parameter_order"], f"{where}.parameter_order")
    order = tuple(take_text(name, f"{where}.parameter_order[{k}]") for k, name in enumerate(names))
    return order, take_array(found["matrix"], f"{where}.matrix", (len(order), len(order)))


def write_covariance(matrix: Any, order: tuple[str, ...]) -> dict[str, Any]:
    """The covariance and the order of its rows and columns."""
    return {"parameter_order": list(order), "matrix": to_lists(matrix)}

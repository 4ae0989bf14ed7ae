"""All numbers of a model as one table: `--to table`, CSV where the name ends so, else Markdown."""

import csv
import io
import itertools
from typing import Any

import numpy as np

from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.effect import UNIT
from jaxident.effects.law_kinds import SIGNALS, TURNING, knots_by_signal, value_unit
from jaxident.export.split import ANY, CAMERA, COUPLING, DEAD_ZONE, EVERY, GAIN, RATE, SLIP, Target
from jaxident.export.text import number, origin
from jaxident.robot.model import Discovered, Model

TARGET = Target(
    "table", "the table", dict.fromkeys((GAIN, RATE, COUPLING, DEAD_ZONE, CAMERA, SLIP, ANY), "a row for each number"),
    stages=EVERY, inside=True,
)  # fmt: skip
HEADER = ("part", "number", "value", "unit", "standard deviation", "determined")
UNITS = {
    "sample_period": ("s",), "rate": ("1/s", "1/s"),
    "gain": (f"m/s^2 per {UNIT}", f"m/s^2 per {UNIT}", f"rad/s^2 per {UNIT}", f"rad/s^2 per {UNIT}"),
    "coupling": ("m/s^2 per rad/s", "rad/s^2 per m/s"), "dead_zone": (UNIT, UNIT), "alpha": ("", ""),
    "delta": (f"m per {UNIT}", f"m per {UNIT}", f"rad per {UNIT}", f"rad per {UNIT}"),
    "epsilon": (f"m per {UNIT}", f"m per {UNIT}", f"rad per {UNIT}", f"rad per {UNIT}"),
    "position": ("m",), "heading": ("rad",), "correlation_time": ("s",), "slip_along": ("m/s^1.5",),
    "slip_heading": ("rad/s^1.5",), "slip_time": ("s",), "white_position": ("m",), "white_heading": ("rad",),
}  # fmt: skip
ENDS = {1: ("",), 2: ("_1", "_2"), 4: ("_11", "_12", "_21", "_22")}

Row = tuple[str, str, str, str, str, str]


def write(model: Model, comma_separated: bool) -> str:
    """The text of the table."""
    rows = [HEADER, *rows_of(model)]
    if comma_separated:
        stream = io.StringIO()
        csv.writer(stream, lineterminator="\n").writerows(rows)
        return stream.getvalue()
    lines = [f"| {' | '.join(row)} |" for row in rows]
    lines.insert(1, "|" + "---|" * len(HEADER))
    return "\n".join([*origin(model), "", *lines]) + "\n"


def rows_of(model: Model) -> list[Row]:
    """One row for each number."""
    spread = model.standard_deviation
    parts: list[tuple[str, Any, Any]] = [("model", {"sample_period": model.sample_period}, None)]
    drive = "physical" if model.physical is not None else "difference equations"
    own = model.dynamics._asdict() | {"dead_zone": model.dead_zone}
    within = getattr(spread, "physical", None) if model.physical is not None else spread
    parts.append((drive, own, _deviations(within, spread)))
    if model.noise is not None:
        parts.append(("noise", model.noise._asdict(), _deviations(getattr(spread, "noise", None), None)))
    found = [row for name, values, deviations in parts for row in _rows(name, values, deviations, model)]
    found += [row for effect in model.effects for row in _effect_rows(effect, model)]
    return found + [row for law in model.discovered for row in _law_rows(law, model)]


def _deviations(within: Any, spread: Any) -> dict[str, Any] | None:
    """Standard deviations by name; None where the model tells none."""
    if within is None and spread is None:
        return None
    found = {} if within is None else within._asdict()
    return found | ({} if spread is None else {"dead_zone": spread.dead_zone})


def _rows(part: str, values: dict[str, Any], deviations: dict[str, Any] | None, model: Model) -> list[Row]:
    rows = []
    for name, value in values.items():
        if value is None:
            continue
        flat = np.ravel(np.asarray(value, float))
        own = None if deviations is None else deviations.get(name)
        spread = np.full(flat.size, np.nan) if own is None else np.ravel(np.asarray(own, float))
        ends = ("_r", "_l") if name == "dead_zone" else ENDS[flat.size]
        for k, end in enumerate(ends):
            told = deviations is not None and name != "sample_period"
            rows.append(_row(part, name + end, flat[k], UNITS[name][k], float(spread[k]), told, model))
    return rows


def _effect_rows(effect: Any, model: Model) -> list[Row]:
    units = {parameter.name: parameter.unit for parameter in CATALOGUE[effect.name].parameters}
    deviations = effect.standard_deviation
    return [
        _row(
            effect.name,
            name,
            value,
            units[name],
            _or_nan((deviations or {}).get(name)),
            deviations is not None,
            model,
            f"{effect.name}.{name}",
        )
        for name, value in effect.parameters.items()
    ]


def _law_rows(law: Discovered, model: Model) -> list[Row]:
    """One row for each knot of a discovered law, and two for what the angle of a wheel goes by."""
    factor = "" if law.times == "1" else f"{law.times} times a law of "
    spread = np.full(np.shape(law.value), np.nan) if law.standard_deviation is None else law.standard_deviation
    places = [
        [f"{signal} at {float(at):.4g} {SIGNALS[signal]}" for at in knots]
        for signal, knots in knots_by_signal(law).items()
    ]
    wheel = [
        _row(f"discovered: {law.acts_on}", name, value, "m", float("nan"), False, model)
        for name in TURNING
        if (value := getattr(law, name)) is not None
    ]
    return wheel + [
        _row(f"discovered: {law.acts_on}", f"{factor}{', '.join(at)}", value, value_unit(law), _or_nan(own),
             law.standard_deviation is not None, model)
        for at, value, own in zip(itertools.product(*places), np.ravel(law.value), np.ravel(spread), strict=True)
    ]  # fmt: skip


def _or_nan(value: Any) -> float:
    return float("nan") if value is None else float(value)


def _row(part: str, name: str, value: Any, unit: str, spread: float, told: bool, model: Model, known: str = "") -> Row:
    """known: the parameter's name where the model says which come from the prior, if another one."""
    if not told:
        determined = "not told"
    elif (known or name) in model.provenance.from_prior:
        determined = "from the prior"
    else:
        determined = "yes" if np.isfinite(spread) else "no"
    return (part, name, number(value), unit, number(spread) if np.isfinite(spread) else "", determined)

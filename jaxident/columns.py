"""Columns of other people's tables: their names, their units, their times and quaternions, in the words of a log.

A column is named as `NAME=SOURCE[:UNIT]`, as in `t=time_ms:ms` or `theta=yaw:deg`. UNIT is a unit, a number to multiply
by, or either with a number to add in that unit: `x=X:mm`, `y=y:-1`, `theta=yaw:deg+90`.
"""

import re
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from jaxident.errors import InputError

_TIME = {"s": (1.0, 1.0), "ms": (1.0, 1e3), "us": (1.0, 1e6), "ns": (1.0, 1e9), "min": (60.0, 1.0)}
_LENGTH = {"m": (1.0, 1.0), "cm": (1.0, 1e2), "mm": (1.0, 1e3), "um": (1.0, 1e6), "in": (0.0254, 1.0)}
_ANGLE = {"rad": (1.0, 1.0), "mrad": (1.0, 1e3), "deg": (np.pi, 180.0), "turn": (2.0 * np.pi, 1.0)}
_SPEED = {f"{name}/s": factor for name, factor in _LENGTH.items()} | {"km/h": (1.0, 3.6)}
_TURNING = {f"{name}/s": factor for name, factor in _ANGLE.items()} | {"rpm": (np.pi, 30.0)}
UNITS: dict[str, dict[str, tuple[float, float]]] = {
    "t": _TIME, "x": _LENGTH, "y": _LENGTH, "theta": _ANGLE, "v": _SPEED, "w": _TURNING,
    "wheel_r": _TURNING, "wheel_l": _TURNING,
}  # fmt: skip
"""Per column the units it may have: value * first / second is in SI. Commands have the unit of the user's choice."""
QUATERNION = ("qx", "qy", "qz", "qw")
WHEELS = ("wheel_r", "wheel_l")
NAMES = ("t", "u_r", "u_l", "v", "w", "x", "y", "theta", *QUATERNION, "run", *WHEELS)
_NUMBER = r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_UNIT = re.compile(rf"(?P<factor>[+-]?{_NUMBER})?(?P<name>[A-Za-z][A-Za-z/]*)?(?P<offset>[+-]{_NUMBER})?")
_ISO = re.compile(r"(\d{4}-\d\d-\d\d[T ]\d\d:\d\d(?::\d\d(?:\.\d{1,9})?)?)(?:(Z)|([+-])(\d\d):?(\d\d))?")


class Column(NamedTuple):
    """Where a column of a log comes from: value = (source + shift) * multiply / divide, in SI."""

    source: str
    multiply: float = 1.0
    divide: float = 1.0
    shift: float = 0.0

    def convert(self, values: np.ndarray) -> np.ndarray:
        """The values in SI. Division keeps decimals: 33 ms are 0.033 s to the last digit."""
        return (values + self.shift) * self.multiply / self.divide if self[1:] != (1.0, 1.0, 0.0) else values


Columns = Mapping[str, Column]


def parse_columns(text: str) -> dict[str, Column]:
    """Columns from `NAME=SOURCE[:UNIT],...`; InputError names the part that is wrong and what would be right."""
    found: dict[str, Column] = {}
    for part in filter(None, (part.strip() for part in text.split(","))):
        name, equals, source = part.partition("=")
        if not (equals and name.strip() and source.strip()):
            raise InputError(f"columns: {part!r} is not NAME=COLUMN or NAME=COLUMN:UNIT, as in t=time_ms:ms")
        if name.strip() in found:
            raise InputError(f"columns: {name.strip()} is given twice; keep one")
        source, _, unit = source.rpartition(":") if ":" in source else (source, "", "")
        found[name.strip()] = make_column(name.strip(), source.strip(), unit.strip())
    return found


def make_columns(
    columns: Mapping[str, str] | str | None = None, units: Mapping[str, str | float] | None = None
) -> dict[str, Column]:
    """Columns from the names {"t": "time_ms"} and units {"t": "ms"} of a table; a text is read by `parse_columns`.

    A column with a unit and no name of its own is called as in a log.
    """
    if isinstance(columns, str):
        found = parse_columns(columns)
        return (
            found | make_columns({name: found[name].source for name in units if name in found}, units)
            if units
            else found
        )
    names, given = dict(columns or {}), dict(units or {})
    return {name: make_column(name, str(names.get(name, name)), given.get(name, "")) for name in [*names, *given]}


def make_column(name: str, source: str, unit: str | float) -> Column:
    """One column of a log from a source with a unit ("" for that of a log); InputError for what is not known."""
    if name not in NAMES:
        raise InputError(f"columns: there is no column {name!r} in a log; those are {', '.join(NAMES)}")
    if isinstance(unit, int | float):
        unit = repr(unit)
    known = UNITS.get(name, {})
    parts = _UNIT.fullmatch(unit)
    if not parts or (parts["name"] and (parts["factor"] or parts["name"] not in known)):
        allowed = ", ".join([*known, "a number to multiply by"])
        raise InputError(f"columns: {name}={source}: unknown unit {unit!r}; it should be {allowed}")
    multiply, divide = known.get(parts["name"] or "", (float(parts["factor"] or 1.0), 1.0))
    shift = float(parts["offset"] or 0.0)
    if multiply == 0.0 or not np.isfinite([multiply, shift]).all():
        raise InputError(f"columns: {name}={source}: {unit!r} makes every value the same or infinite")
    return Column(source, multiply, divide, shift if parts["name"] else shift / multiply)


def after(own: Columns, change: Columns) -> dict[str, Column]:
    """The columns that read a file as `own` does and then make a `change`: what `change` calls a source has its name
    in a log."""
    changed = {}
    for name, then in change.items():
        first = own.get(then.source, Column(then.source))
        shift = first.shift + then.shift * first.divide / first.multiply
        changed[name] = Column(first.source, first.multiply * then.multiply, first.divide * then.divide, shift)
    return {**own, **changed}


def columns_text(columns: Columns) -> str:
    """The columns as the text that `parse_columns` reads, numbers to twelve digits."""
    return ",".join(f"{name}={column.source}{_unit_text(name, column)}" for name, column in columns.items())


def _unit_text(name: str, column: Column) -> str:
    """ ":UNIT" of a column, in the words of a unit where one has its factor."""
    factor = column.multiply / column.divide
    if (factor, column.shift) == (1.0, 0.0):
        return ""
    units = (unit for unit, (up, down) in UNITS.get(name, {}).items() if abs(up / down / factor - 1.0) < 1e-12)
    unit = next(units, None)
    shift = column.shift if unit else column.shift * factor
    return f":{unit or format(factor, '.12g')}{format(shift, '+.12g') if shift else ''}"


def rename(header: Iterable[str], columns: Columns, place: str) -> list[str]:
    """The header in the words of a log: sources get their new names, columns of a log whose name another takes lose it.

    InputError names a source that the header lacks, and those that it has.
    """
    header = list(header)
    for name, column in columns.items():
        if column.source not in header:
            raise InputError(f"{place}: no column {column.source!r} for {name}; there are {', '.join(header)}")
    new = {column.source: name for name, column in columns.items()}
    if len(new) < len(columns):
        raise InputError(
            f"{place}: one column stands for two: {', '.join(f'{n}={c.source}' for n, c in columns.items())}"
        )
    return [new.get(name, f"{name} (replaced)" if name in columns else name) for name in header]


def split_heading(header: Iterable[str], columns: Columns) -> tuple[Columns, Column | None]:
    """The columns without a change of `theta` where the table has none of that name, and that change: it is for the
    heading that a quaternion gives."""
    change = columns.get("theta")
    if change is None or change.source != "theta" or "theta" in header:
        return columns, None
    return {name: column for name, column in columns.items() if name != "theta"}, change


def heading_of(qx: Any, qy: Any, qz: Any, qw: Any) -> np.ndarray:
    """Heading [rad] of a quaternion of any length: rotation about z, yaw of yaw-pitch-roll; NaN for (0, 0, 0, 0)."""
    x, y, z, w = (np.asarray(part, float) for part in (qx, qy, qz, qw))
    theta = np.arctan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
    return np.where(x * x + y * y + z * z + w * w > 0.0, theta, np.nan)


def columns_of_frame(frame: Any, columns: Any = None, units: Any = None) -> dict[str, np.ndarray]:
    """The columns of a log that a data frame, or a dict of arrays, has; as `Log.from_dataframe` says."""
    named = {str(column): column for column in frame.keys()}  # noqa: SIM118 - a frame's, too
    chosen, change = split_heading(named, make_columns(columns, units))
    header = rename(named, chosen, "frame")
    found = {name: frame[named[source]] for name, source in zip(header, named, strict=True)}
    values = {name: numbers(name, found[name]) for name in NAMES if name in found and name not in ("v", "w")}
    values |= {name: column.convert(values[name]) for name, column in chosen.items() if name in values}
    if "theta" not in values and all(name in values for name in QUATERNION):
        values["theta"] = heading_of(*(values[name] for name in QUATERNION))
        values["theta"] = change.convert(values["theta"]) if change else values["theta"]
    missing = [name for name in ("t", "u_r", "u_l") if name not in values]
    if missing:
        raise InputError(
            f"frame: no column {missing[0]}; there are {', '.join(named)}; name it: columns={{{missing[0]!r}: ...}}"
        )
    check_both_wheels("frame", values)
    return {name: column for name, column in values.items() if name not in QUATERNION}


def check_both_wheels(name: str, columns: Iterable[str]) -> None:
    """InputError for columns, of the table or log `name`, that have the speed of one wheel alone."""
    found = [column for column in WHEELS if column in columns]
    if len(found) == 1:
        other = WHEELS[1 - WHEELS.index(found[0])]
        raise InputError(
            f"{name}: has the column {found[0]} and no column {other}; a log has the speeds of both wheels, or of none"
        )


def seconds(nanoseconds: Any) -> np.ndarray:
    """Times [s] from whole nanoseconds (int64): seconds and rest apart, so that nothing is rounded twice."""
    whole = np.asarray(nanoseconds, np.int64)
    return whole // 10**9 + (whole % 10**9) / 1e9


def iso_seconds(text: str) -> float | None:
    """Unix time [s] of an ISO 8601 date and time, UTC where it names no zone; None for any other text."""
    found = _ISO.fullmatch(text.strip())
    if not found:
        return None
    try:
        stamp = int(np.datetime64(found[1].replace(" ", "T"), "ns").astype(np.int64))
    except ValueError:
        return None
    ahead = 0 if not found[3] else (60 * int(found[4]) + int(found[5])) * (1 if found[3] == "+" else -1)
    return float(seconds(stamp - ahead * 60 * 10**9))


def numbers(name: str, values: Any) -> np.ndarray:
    """A column as float64 (rows,): numbers, dates (Unix time [s]) or ISO texts; InputError for anything else."""
    array = np.asarray(values)
    if array.dtype.kind == "O" and len(array) and hasattr(array[0], "isoformat"):
        array = np.array([str(value.isoformat()) for value in array])
    if array.dtype.kind == "M":
        return seconds(array.astype("datetime64[ns]").astype(np.int64))
    if array.dtype.kind in "OUT":
        return np.array([_number(name, row, value) for row, value in enumerate(array)])
    if array.dtype.kind not in "iufb" or array.ndim != 1:
        raise InputError(f"column {name}: should be one row of numbers, is {array.dtype} of shape {array.shape}")
    return array.astype(float)


def _number(name: str, row: int, value: Any) -> float:
    if value is None:
        return np.nan
    try:
        return float(value)
    except (TypeError, ValueError):
        stamp = iso_seconds(str(value))
    if stamp is None:
        raise InputError(f"row {row}, column {name}: {str(value)[:40]!r} is not a number")
    return stamp

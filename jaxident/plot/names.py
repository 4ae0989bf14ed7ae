"""How a parameter is written on an axis: its symbol, its unit and the scale that keeps the numbers short."""

from typing import NamedTuple

_SYMBOLS = {"alpha": r"\alpha", "delta": r"\delta", "epsilon": r"\epsilon", "dead_zone": "D"}
DIMENSIONLESS = "–"
"""What stands in place of a unit where a number has none."""
_UNITS = {
    "alpha": (DIMENSIONLESS, 1.0),
    "dead_zone": ("unit", 1.0),
    "delta_1": ("mm/unit", 1e3),
    "delta_2": ("mrad/unit", 1e3),
    "epsilon_1": ("mm/unit", 1e3),
    "epsilon_2": ("mrad/unit", 1e3),
}
"""Unit and scale by the name and, for a numerator, its channel; "unit" is that of the command."""

LENGTH = ("mm", 1e3)
TURN = ("mrad", 1e3)


class Written(NamedTuple):
    """A parameter on an axis: symbol in mathtext, unit, and what to multiply a value in SI units with."""

    symbol: str
    unit: str
    scale: float

    @property
    def label(self) -> str:
        """Symbol and unit, for an axis."""
        return f"{self.symbol} [{self.unit}]" if self.unit else self.symbol


def plain(text: str) -> str:
    """A user's name as matplotlib shows it letter by letter: no dollar makes it a formula, no underscore hides it."""
    text = text.replace("$", r"\$")
    return f" {text}" if text.startswith("_") else text


def written(name: str) -> Written:
    """How the parameter called `name` in a model (alpha_1, delta_11, dead_zone_r) is written; a name that is none of
    these stands as it is, in the unit of its values."""
    kind, _, index = name.rpartition("_")
    if kind not in _SYMBOLS or not index:
        return Written(name.replace("_", " "), "", 1.0)
    unit, scale = _UNITS[kind] if kind in _UNITS else _UNITS[f"{kind}_{index[0]}"]
    return Written(f"${_SYMBOLS[kind]}_{{{index}}}$", unit, scale)

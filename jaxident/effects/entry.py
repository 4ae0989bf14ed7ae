"""One row of the catalogue: what an effect is, in words and numbers."""

import math
from typing import Any, NamedTuple

UNIT = "unit"
"""The unit of the motor command, which is the user's."""


class Parameter(NamedTuple):
    """One number of an effect.

    neutral: the value at which the effect does nothing, or for a number that only shapes it (`shape`) its default.
    range: what real robots show, the bounds of a search. typical: a clear but not extreme case, for examples and
    pictures. least, most: what is refused outside; `above` refuses `least` itself.
    """

    name: str
    unit: str
    neutral: float
    range: tuple[float, float]
    typical: float
    least: float = -math.inf
    most: float = math.inf
    above: bool = False
    shape: bool = False

    @property
    def allowed(self) -> str:
        """What values it takes, in words."""
        unit = f" {self.unit}" if self.unit else ""
        low = f"{'above' if self.above else 'at least'} {self.least:g}{unit}" if math.isfinite(self.least) else ""
        high = f"at most {self.most:g}{unit}" if math.isfinite(self.most) else ""
        typical = f"{self.range[0]:g} to {self.range[1]:g}{unit} on real robots"
        return "; ".join(part for part in (" and ".join(filter(None, (low, high))), typical) if part)


class Entry(NamedTuple):
    """One effect of the catalogue.

    equation: with the symbols of README, primes for time derivatives. channels: those of along, lateral, heading
    in which it changes the movement from row to row, as the reported heading sees it. confused_with: effects that
    inputs separate badly. smooth: whether the simulation has a derivative at neutral; where not, `grid` holds values
    of the first parameter to try instead. random: needs a key.
    """

    name: str
    site: str
    equation: str
    parameters: tuple[Parameter, ...]
    channels: tuple[str, ...]
    confused_with: tuple[str, ...]
    source: str
    smooth: bool = True
    grid: tuple[float, ...] | None = None
    random: bool = False
    extension: bool = False

    def typical(self) -> dict[str, Any]:
        """Parameters of a clear but not extreme case, by name."""
        return {parameter.name: parameter.typical for parameter in self.parameters}


ALONG, LATERAL, HEADING = "along", "lateral", "heading"
BOTH = (ALONG, HEADING)
EVERYWHERE = (ALONG, LATERAL, HEADING)

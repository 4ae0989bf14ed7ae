"""How well an input determined each parameter."""

from typing import NamedTuple

import numpy as np

from jaxident.robot.model import Model, difference_vector

DETERMINED = 0.1
WEAK = 0.5


class Verdict(NamedTuple):
    """One parameter: estimate, 95 % interval, and "determined", "weak" or "not determined".

    The half-width of the interval is compared with the size of the parameter, for a dead zone with the largest
    command: below a tenth determined, below a half weak.
    """

    parameter: str
    estimate: float
    low: float
    high: float
    verdict: str

    def cells(self) -> tuple[str, str, str, str]:
        """The verdict as a row of a table."""
        return self.parameter, f"{self.estimate:.6g}", f"[{self.low:.6g}, {self.high:.6g}]", self.verdict


def verdicts(model: Model, largest_command: float) -> list[Verdict]:
    """One verdict per entry of `model.parameter_order`."""
    values = map(float, difference_vector(model.difference, model.dead_zone))
    half_widths = 1.96 * np.sqrt(np.diagonal(np.asarray(model.covariance)))
    return [
        _verdict(name, value, float(half), largest_command if name.startswith("dead_zone") else abs(value))
        for name, value, half in zip(model.parameter_order, values, half_widths, strict=True)
    ]


def _verdict(name: str, value: float, half: float, size: float) -> Verdict:
    word = "determined" if half < DETERMINED * size else "weak" if half < WEAK * size else "not determined"
    return Verdict(name, value, value - half, value + half, word)

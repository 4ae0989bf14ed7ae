"""How well an input determined each parameter."""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import numpy as np

from jaxident.robot.model import Model, difference_vector

DETERMINED = 0.1
WEAK = 0.5
TOGETHER = 0.95
"""Correlation from which a loose parameter is said to move with another."""
BORROWED, WHY = "from the prior", "this log hardly tells it; number and interval are those of robots in general"
NOISE_NAMES = ("position", "heading", "correlation_time", "slip_along", "slip_heading")


class Verdict(NamedTuple):
    """One parameter: estimate, 95 % interval, "determined", "weak", "not determined" or "from the prior", and why not
    determined ("" otherwise). An interval from the prior is what is known of robots in general, not this log's.

    The half-width of the interval is compared with the size of the parameter, for a dead zone with the largest
    command: below a tenth determined, below a half weak.
    """

    parameter: str
    estimate: float
    low: float
    high: float
    verdict: str
    reason: str = ""

    def cells(self) -> tuple[str, str, str, str]:
        """The verdict as a row of a table."""
        word = f"{self.verdict}: {self.reason}" if self.reason else self.verdict
        return self.parameter, f"{self.estimate:.6g}", f"[{self.low:.6g}, {self.high:.6g}]", word


def verdicts(model: Model, largest_command: float) -> list[Verdict]:
    """One verdict per entry of `model.parameter_order` that is a parameter of the robot, then the noise law's."""
    values = _values(model)
    order = model.parameter_order
    covariance = np.asarray(model.covariance)
    found = verdicts_of(order, np.array([values[name] for name in order]), covariance, largest_command)
    borrowed = model.provenance.from_prior
    return [row._replace(verdict=BORROWED, reason=WHY) if row.parameter in borrowed else row for row in found]


def verdicts_of(
    order: Sequence[str], values: np.ndarray, covariance: np.ndarray, largest_command: float
) -> list[Verdict]:
    """One verdict per parameter (n,) from the covariance (n, n); largest_command sizes dead zones."""
    deviation = np.sqrt(np.diagonal(covariance))
    correlation = np.abs(covariance) / np.maximum(np.outer(deviation, deviation), 1e-300)
    return [
        _verdict(name, float(values[k]), 1.96 * float(deviation[k]), largest_command, _reason(k, order, correlation))
        for k, name in enumerate(order)
    ]


def _values(model: Model) -> dict[str, float]:
    """Every named number of a model."""
    if model.physical is None:
        order, vector = model.parameter_order, difference_vector(model.difference, model.dead_zone)
        return dict(zip(order, map(float, vector), strict=True))
    rate, gain = np.asarray(model.physical.rate), np.asarray(model.physical.gain)
    coupling = np.zeros(2) if model.physical.coupling is None else np.asarray(model.physical.coupling)
    named = {
        **{f"rate_{k + 1}": rate[k] for k in range(2)},
        **{f"gain_{k + 1}{j + 1}": gain[k, j] for k in range(2) for j in range(2)},
        **{f"coupling_{k + 1}": coupling[k] for k in range(2)},
        "dead_zone_r": np.asarray(model.dead_zone)[0],
        "dead_zone_l": np.asarray(model.dead_zone)[1],
    }
    noise = {} if model.noise is None else {k: v for k, v in model.noise._asdict().items() if v is not None}
    return jax.tree.map(float, {**named, **noise})


def _reason(k: int, order: Sequence[str], correlation: np.ndarray) -> str:
    """What a loose parameter is loose with."""
    others = np.where(np.arange(len(order)) == k, 0.0, correlation[k])
    other = int(np.argmax(others))
    if others[other] > TOGETHER:
        return f"this input shows it only together with {order[other]}"
    return "this input moves too little by it"


def _verdict(name: str, value: float, half: float, largest_command: float, reason: str) -> Verdict:
    size = largest_command if name.startswith("dead_zone") else abs(value)
    word = "determined" if half < DETERMINED * size else "weak" if half < WEAK * size else "not determined"
    return Verdict(name, value, value - half, value + half, word, "" if word == "determined" else reason)

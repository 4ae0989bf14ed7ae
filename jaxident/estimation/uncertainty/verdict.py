"""How well an input determined each parameter."""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import numpy as np

from jaxident.estimation.poses.parameters import HIGHEST, LOWEST
from jaxident.robot.model import Model, Provenance, difference_vector

DETERMINED = 0.1
WEAK = 0.5
TOGETHER = 0.95
"""Correlation from which a loose parameter is said to move with another."""
NEAR_BOUND = 1e-9
"""Share of a bound within which a value stands at it; searches are cut off there, to within rounding."""
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


def verdicts(model: Model, largest_command: float) -> list[Verdict]:
    """One verdict per entry of `model.parameter_order` that is a parameter of the robot, then the noise law's."""
    values = _values(model)
    order = model.parameter_order
    covariance = np.asarray(model.covariance)
    found = verdicts_of(order, np.array([values[name] for name in order]), covariance, largest_command)
    return [_with_origin(row, model.provenance) for row in found]


def _with_origin(row: Verdict, origin: Provenance) -> Verdict:
    """A verdict in the light of how its number came about: from the prior, or at a bound of its search."""
    if row.parameter in origin.from_prior:
        return row._replace(verdict=BORROWED, reason=WHY)
    if row.parameter in origin.at_bound:
        if row.parameter.startswith("dead_zone") and row.estimate <= 0.0:
            return row._replace(verdict="weak", reason="it stands at 0, the least a dead zone can be")
        return row._replace(verdict="not determined", reason="it stands at a bound of its search")
    return row


def at_bound(model: Model, d_max: float) -> dict[str, float]:
    """The numbers of an estimate that stand at a bound of their search, and that bound; d_max is that of dead zones."""
    values, found = _values(model), {}
    for name in model.parameter_order:
        kind = name.removesuffix("_1").removesuffix("_2")
        low, high = LOWEST.get(kind, -np.inf), HIGHEST.get(kind, np.inf)
        if name.startswith("dead_zone"):
            low, high = 0.0, d_max
        if values[name] <= low + NEAR_BOUND * (d_max if low == 0.0 else abs(low)):
            found[name] = low
        elif values[name] >= high * (1.0 - NEAR_BOUND):
            found[name] = high
    return found


def bound_doubts(bounds: dict[str, float]) -> tuple[str, ...]:
    """A line for each number at a bound (`at_bound`) that another bound would change. A dead zone of 0 and no noise
    stand at bounds of nature."""
    none = {name: LOWEST[name] for name in ("position", "heading", "slip_along", "slip_heading", "wheel_noise")}
    none |= dict.fromkeys(("dead_zone_r", "dead_zone_l"), 0.0)
    return tuple(
        f"{name} stands at {bound:g}, the bound of its search: with another bound it would be another number, and its "
        "interval says nothing"
        for name, bound in bounds.items()
        if none.get(name) != bound
    )


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
    wheels = {} if model.wheels is None else {f"wheel_{k}": v for k, v in model.wheels._asdict().items()}
    return jax.tree.map(float, {**named, **noise, **wheels})


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

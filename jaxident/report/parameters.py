"""Estimated parameters as people read them: millimetres, milliradians, as many digits as the interval allows."""

from math import floor, isfinite, log10
from typing import NamedTuple

from jaxident.estimation.uncertainty.verdict import Verdict
from jaxident.report.words import about

SHORT = {"m": ("mm", 1e3), "rad": ("mrad", 1e3)}
"""Units in which a number is told, and what to multiply one in the model's unit with."""
DIGITS = 2
"""Of an interval's half-width, told of the interval's ends and of the estimate."""
DECIMALS, LARGEST = 6, 1e6
"""Of more decimals, and from this size on, numbers are written with a power of ten."""


class Told(NamedTuple):
    """A parameter in words, all of them texts; meaning and unit are empty where nothing is known of a name."""

    name: str
    meaning: str
    estimate: str
    interval: str
    unit: str
    verdict: str


def told(row: Verdict) -> Told:
    """A parameter's estimate, interval and verdict as texts."""
    meaning, unit = about(row.parameter)
    estimate, low, high = _rounded(row.parameter, row.estimate, row.low, row.high)
    word = f"{row.verdict}: {row.reason}" if row.reason else row.verdict
    return Told(row.parameter, meaning, estimate, f"[{low}, {high}]", SHORT.get(unit, (unit,))[0], word)


def interval(name: str, low: float, high: float) -> str:
    """Another interval of a parameter [the model's unit], in the unit in which `told` tells it."""
    return f"[{', '.join(_rounded(name, low, high))}]"


def _rounded(name: str, *values: float) -> list[str]:
    """Numbers of a parameter, the last two the ends of its interval, in its short unit."""
    scale = SHORT.get(about(name)[1], ("", 1.0))[1]
    scaled = [scale * value for value in values]
    half = 0.5 * (scaled[-1] - scaled[-2])
    if not isfinite(half) or half <= 0.0:
        return [f"{value:.4g}" for value in scaled]
    decimals, top = DIGITS - 1 - floor(log10(half)), max(abs(value) for value in scaled if isfinite(value))
    if decimals > DECIMALS or top >= LARGEST:
        return [f"{value:.{max(decimals + floor(log10(top)) + 1, DIGITS)}g}" for value in scaled]
    return [f"{round(value, decimals) + 0.0:.{max(decimals, 0)}f}" for value in scaled]  # no minus before a zero

"""What an estimator of a study is given, what it gives back, and how it is chosen."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array, Wheels
from jaxident.estimation.increments.initialise import Setup
from jaxident.estimation.increments.observations import Observations
from jaxident.log import Log

REASONS = (
    "found",
    "the robot does not move",
    "no start values",
    "the estimate is not finite",
    "the search did not arrive",
    "the log was refused",
)
"""How an estimate ended; its index is stored with every trial, 0 is success."""

FOUND, AT_REST, NO_START, NOT_FINITE, NOT_ARRIVED, REFUSED = range(6)


class Sight(NamedTuple):
    """What an estimator sees of a trial: even runs without gaps, one after the other, arrays (rows,), and what can be
    had from them.

    observations leave out the first sample, whose command before is unknown. setup(rows, reading, d_max) gives the
    start values from the first rows; estimators that ask for the same share the work. wheels: measured wheel speeds,
    None of robots without. runs: how many, all of one length.
    """

    log: Log
    observations: Observations
    setup: Callable[[int, str, Array], Setup]
    largest: Array
    wheels: Wheels | None = None
    runs: int = 1


def places_of_rows(runs: int, rows: int) -> tuple[np.ndarray, np.ndarray]:
    """Of each row (rows,) of some runs of one length, one after the other, the run and the place in it."""
    length = rows // runs
    return np.repeat(np.arange(runs), length), np.tile(np.arange(length), runs)


class Finding(NamedTuple):
    """Estimate and standard deviations (12,) in DIFFERENCE_ORDER (NaN: none is known), and an index of REASONS."""

    estimate: Any
    deviation: Any
    reason: Any


class Setting(NamedTuple):
    """A setting of a method: its value where none is given, which values are right, and how to say so."""

    default: Any
    valid: Callable[[Any], bool]
    right: str


class Method(NamedTuple):
    """run(sight, settings) -> Finding, and the settings it takes.

    A method without `run` is no part of the compiled program of a trial (`study.diagnosed`).
    one_run: whether it takes a single run only.
    alone: no two of its programs may run at once in a process. Its eigenvalues come from LAPACK, whose batched call
    hands its work to XLA's threads and waits for them, on one of these itself; with as many programs as threads, all
    wait for ever.
    """

    run: Callable[[Sight, dict[str, Any]], Finding] | None
    settings: dict[str, Setting]
    alone: bool = False
    one_run: bool = False


class Choice(NamedTuple):
    """An estimator of a study: its name there, its method, and (key, value) pairs of settings that are not default."""

    name: str
    method: str
    settings: tuple[tuple[str, Any], ...] = ()

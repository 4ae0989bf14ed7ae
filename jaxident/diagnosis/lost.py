"""Commands that never arrived: which changes of the command came late by whole rows, each by chance.

A lost command leaves the one before in force. Every change is judged apart: by how much the poses around it are better
explained if it came one, two or three rows late. The share of lost ones is the likeliest under the mixture of both.
"""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.linear import without_starts
from jaxident.diagnosis.responses import respond
from jaxident.diagnosis.search import Data, Solution

LATEST = 3
"""Rows by which a change may be late: four in a row are lost too rarely to matter."""
SHARES = np.geomspace(0.002, 0.6, 40)
"""Shares of lost commands that are tried."""


class Lost(NamedTuple):
    """The likeliest share of lost commands, the fall of -log p that it brings, and commands (rows of a run, runs, 2) as
    they arrived."""

    share: float
    gain: float
    arrived: Any


def find_lost(data: Data, solution: Solution) -> Lost:
    """What a solution leaves for lost commands to explain."""
    windows = data.windows
    window, row, late = _changes(data)
    first = windows.first[window] + row
    before = windows.command[first - 1, windows.run[window]]
    gains = _gains(data, solution, window, row, before)
    gains[~late] = -np.inf
    used = data.use[window]
    rate = np.log(SHARES)[:, None] * np.arange(1, LATEST + 1)
    mixed = np.array([_mixture(gains[used], p, powers) for p, powers in zip(SHARES, rate, strict=True)])
    best = int(np.argmax(mixed))
    weighed = gains + rate[best]
    rows = np.where(weighed.max(axis=1, initial=-np.inf) > 0.0, 1 + np.argmax(weighed, axis=1), 0)
    arrived = np.array(windows.command, float)
    for place, run, old, count in zip(first, windows.run[window], before, rows, strict=True):
        arrived[place : place + count, run] = old
    return Lost(float(SHARES[best]), float(mixed[best]), arrived)


def _mixture(gains: Array, share: float, powers: Array) -> float:
    """Log-likelihood of all changes, each late with a share's powers, against none late."""
    late = np.logaddexp.reduce(np.minimum(gains, 500.0) + powers, axis=1)
    return float(np.sum(np.log1p(-share) + np.logaddexp(0.0, late)))


def _changes(data: Data) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Windows and rows in which the command changes, and by how many rows (changes, LATEST) it may come late before it
    changes again."""
    windows = data.windows
    changed = np.any(np.diff(windows.command, axis=0, prepend=windows.command[:1]) != 0.0, axis=2)
    rows = np.asarray(windows.step).shape[0]
    places = windows.first[:, None] + np.arange(rows)
    inside = places < len(changed)
    here = changed[np.minimum(places, len(changed) - 1), windows.run[:, None]] & inside
    window, row = np.nonzero(here)
    return window, row, _alone(changed, places[window, row], windows.run[window])


def _alone(changed: Array, place: Array, run: Array) -> np.ndarray:
    """Whether no other change follows within 1, 2, ... rows, (changes, LATEST)."""
    padded = np.concatenate([changed, np.ones((LATEST, changed.shape[1]), bool)])
    quiet = np.stack([~padded[place + k, run] for k in range(1, LATEST)], axis=1)
    return np.concatenate([np.ones((len(place), 1), bool), np.logical_and.accumulate(quiet, axis=1)], axis=1)


def _gains(data: Data, solution: Solution, window: Array, row: Array, before: Array) -> np.ndarray:
    """Fall of -log p (changes, LATEST) if each change came late by 1, 2, ... rows."""
    windows, linear = data.windows, solution.linear
    responses = respond(np.exp(solution.vector[:2]), linear.residual, windows)
    columns = np.concatenate([responses.along, responses.heading, linear.residual[..., None]], axis=2)
    white, _ = without_starts(data.whitener, columns, linear.starts)
    rows, dead_zone = responses.along.shape[2], solution.vector[6:8]

    def past_zone(u: Array) -> np.ndarray:
        return np.sign(u) * np.maximum(np.abs(u) - dead_zone, 0.0)

    now = windows.command[windows.first[window] + row, windows.run[window]]
    force = (past_zone(before) - past_zone(now)) @ solution.vector[2:6].reshape(2, 2).T
    gains, total = np.empty((len(window), LATEST)), 0.0
    for k in range(LATEST):
        place = np.minimum(row + k, rows - 1)
        within = (row + k < rows)[:, None]
        parts = [white[window, :, place + rows * channel] * force[:, [channel]] for channel in (0, 1)]
        total = total + within * (parts[0] + parts[1])
        gains[:, k] = np.sum(total * (white[window, :, -1] - 0.5 * total), axis=1)
    return gains

"""Commands that never arrived: which changes of the command came late by whole rows, each by chance.

A lost command leaves the one before in force. Every change may have come one, two or three rows late; each row costs
the logarithm of the share of lost commands, which is the likeliest one.
"""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.fit.refit import Data, Solution
from jaxident.diagnosis.motion.linear import without_starts
from jaxident.diagnosis.motion.responses import modelled_path, modelled_speeds, respond
from jaxident.diagnosis.preparation.steps import past_zone
from jaxident.effects.coordinates import natural

LATEST = 3
"""Rows by which a change may be late: four in a row are lost too rarely to matter."""
FEWEST = 5
"""Changes that came late below which nothing is said: one or two are as well explained by a pose or two gone wrong."""
SHARES = np.geomspace(0.005, 0.6, 12)
"""Shares of lost commands that are tried."""
BY_RULE = 40.0
"""Dependence (chi-square, four degrees of freedom) from which commands are late by a rule, not by chance. The first
losses of 24 simulated robots that lost commands, half of them with another effect beside, had at most 22. Where delays
grew with the speed, or turning slowed driving, those of nine robots had 54 to 171; those of seven of them 11 to 213
once the corrector had terms for such delays (`discrepancy_basis.LATER`)."""
MOST_ODDS = 50.0
"""Logarithm of the odds beyond which a change is late for certain: no sum overflows."""


class Lost(NamedTuple):
    """The likeliest share of lost commands, the fall of -log p that it brings, commands (rows of a run, runs, 2) as
    they arrived, and how far the losses that were found first depend on the motion (`_dependence`)."""

    share: float
    gain: float
    arrived: Any
    dependence: float = 0.0

    @property
    def by_chance(self) -> bool:
        """Whether the losses strike any command alike, as far as is seen."""
        return self.dependence < BY_RULE


class _Changes(NamedTuple):
    """Changes of the command: window and row (changes,), whether they may be late (changes, LATEST), the command before
    (changes, 2); sizes of the speeds there and of the change of the force, of driving and of turning (changes, 4); what
    the whitened poses of their window gain where they are (changes, LATEST, numbers); those of each window; whitened
    residuals (windows, numbers)."""

    window: Any
    row: Any
    late: Any
    before: Any
    sizes: Any
    columns: Any
    own: list
    residual: Any


def find_lost(data: Data, solution: Solution) -> Lost:
    """What a solution leaves for lost commands to explain."""
    windows, changes = data.windows, _changes(data, solution)
    best, delays = Lost(0.0, 0.0, windows.command), np.zeros(len(changes.window), int)
    for share in SHARES:
        gain, found = _taken_at(share, changes)
        late = sum(int(np.sum(rows > 0)) for rows in found)
        if gain > best.gain and late >= FEWEST:
            best, delays = best._replace(share=float(share), gain=gain), np.concatenate(found)
    first = windows.first[changes.window] + changes.row
    arrived = np.array(windows.command, float)
    for place, run, old, rows in zip(first, windows.run[changes.window], changes.before, delays, strict=True):
        arrived[place : place + rows, run] = old
    return best._replace(arrived=arrived, dependence=_dependence(best.share, changes, delays))


def gain_beyond(data: Data, solution: Solution, share: float) -> float:
    """What the likeliest share of lost commands gains beyond what another share does."""
    changes = _changes(data, solution)
    likeliest = max(_taken_at(other, changes)[0] for other in SHARES)
    return likeliest - _taken_at(share, changes)[0]


def _changes(data: Data, solution: Solution) -> _Changes:
    windows = data.windows
    window, row, late = _changed(data)
    before = windows.command[windows.first[window] + row - 1, windows.run[window]]
    now = windows.command[windows.first[window] + row, windows.run[window]]
    zone, gain = solution.vector[6:8], natural(solution.vector)[2:6].reshape(2, 2)
    force = (past_zone(now, zone) - past_zone(before, zone)) @ gain.T
    v, w = modelled_speeds(modelled_path(solution.linear.residual, windows), windows)
    sizes = np.abs(np.column_stack([v[window, row], w[window, row], force]))
    columns, residual = _whitened(data, solution, window, row, -force)
    own = [np.flatnonzero(window == k) for k in range(len(windows.run))]
    return _Changes(window, row, late, before, sizes, columns, own, residual)


def _price(share: float, changes: _Changes) -> np.ndarray:
    """What it costs (changes, LATEST) that a change came late by 1, 2, ... rows."""
    return np.where(changes.late, -np.log(share) * np.arange(1, LATEST + 1), np.inf)


def _taken_at(share: float, changes: _Changes) -> tuple[float, list[np.ndarray]]:
    """What all windows gain at a share of lost commands, and by how many rows each window's changes are late."""
    price = _price(share, changes)
    found = [_delayed(changes.columns[c], changes.residual[k], price[c]) for k, c in enumerate(changes.own)]
    gain = sum(own + len(c) * np.log1p(-share) for (own, _), c in zip(found, changes.own, strict=True))
    return float(gain), [rows for _, rows in found]


def _delayed(columns: Array, residual: Array, price: Array) -> tuple[float, np.ndarray]:
    """The changes of one window that came late, taken one after the other for what they gain beyond their price, for
    each bends what the others seem to be: total gain, and rows (changes,). columns (changes, LATEST, numbers)."""
    rows, total, left = np.zeros(len(columns), int), 0.0, np.array(residual)
    power = 0.5 * np.sum(columns**2, axis=2)
    while len(columns):
        gains = np.where(rows[:, None] == 0, columns @ left - power - price, -np.inf)
        change, delay = np.unravel_index(int(np.argmax(gains)), gains.shape)
        if gains[change, delay] <= 0.0:
            break
        total += float(gains[change, delay])
        left -= columns[change, delay]
        rows[change] = delay + 1
    return total, rows


def _dependence(share: float, changes: _Changes, rows: Array) -> float:
    """How far losses, by `rows` (changes,), depend on speeds and changes: a chi-square of four degrees of freedom,
    about four where they strike by chance.

    It is the score test of a logistic model (Cox and Hinkley, Theoretical Statistics, 1974, ch. 9): how likely each
    change came late, less what the share says beforehand, against how fast the robot was and how large the change is. A
    change that the poses do not show stays as likely as before and counts for nothing.
    """
    if not np.any(rows):
        return 0.0
    price = _price(share, changes)
    own = np.where(rows[:, None] > 0, changes.columns[np.arange(len(rows)), rows - 1], 0.0)
    left = changes.residual[changes.window] + own
    for window in changes.own:
        left[window] -= np.sum(own[window], axis=0)
    fit = np.einsum("ckn,cn->ck", changes.columns, left) - 0.5 * np.sum(changes.columns**2, axis=2) - price
    beyond = _late(np.minimum(fit, MOST_ODDS), share) - _late(-price, share)
    weight = beyond**2
    sizes = changes.sizes - np.average(changes.sizes, axis=0, weights=weight)
    score, variance = beyond @ sizes, (sizes.T * weight) @ sizes
    return float(score @ np.linalg.lstsq(variance, score, rcond=None)[0])


def _late(log_odds: Array, share: float) -> np.ndarray:
    """Probability (changes,) of having come late, by any number of rows."""
    odds = np.sum(np.exp(log_odds), axis=1)
    return odds / (1.0 - share + odds)


def _changed(data: Data) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
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


def _whitened(data: Data, solution: Solution, window: Array, row: Array, missing: Array):
    """What the poses of its window gain (changes, LATEST, numbers) if each change came late by 1, 2, ... rows, in which
    a force (changes, 2) is missing, and residuals (windows, numbers), both whitened and free of start states."""
    windows, linear = data.windows, solution.linear
    responses = respond(np.exp(solution.vector[:2]), linear.residual, windows)
    columns = np.concatenate([responses.along, responses.heading, linear.residual[..., None]], axis=2)
    white, _ = without_starts(data.whitener, columns, linear.starts)
    rows = responses.along.shape[2]
    parts = []
    for k in range(LATEST):
        place, within = np.minimum(row + k, rows - 1), (row + k < rows)[:, None]
        parts.append(within * sum(white[window, :, place + rows * c] * missing[:, [c]] for c in (0, 1)))
    return np.cumsum(np.stack(parts, axis=1), axis=1), white[:, :, -1]

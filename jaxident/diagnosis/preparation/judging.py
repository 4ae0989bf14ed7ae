"""How a model predicts the rows kept for judging: by `run_ahead`, as `predict` does, on poses as they were measured."""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.preparation.prepare import BURN, Prepared
from jaxident.estimation.ahead.run_ahead import run_ahead
from jaxident.estimation.ahead.stretches import Starts
from jaxident.log import run_begins
from jaxident.robot.model import Model

MOST_STARTS = 200
"""Starts among the rows that fit from which models are looked at: six runs of 1000 rows have fewer, a whole log of a
Create three times as many."""
CHANNELS = ("along", "lateral", "heading")


class Judged(NamedTuple):
    """One model at the horizon of every judging start, along, lateral [m] and in heading [rad] as the measured heading
    there sees it.

    error (starts, 3): measured less predicted, NaN where the prediction is not finite; start, slip (starts, 3, 3):
    covariance by what is not known of the start state, and by slip since, that of a start where the filter did not
    converge as at the others; slopes (directions, starts, 3): a deviation's worth of each independent direction of the
    model's parameters; path (starts, rows, 3): predicted poses; run_up (starts,): starts where the filter did not
    converge.
    """

    error: Any
    start: Any
    slip: Any
    slopes: Any
    path: Any
    run_up: Any

    @property
    def squares(self) -> tuple[np.ndarray, np.ndarray]:
        """Expected squares (starts, 3) by the start state, and by slip."""
        return np.diagonal(self.start, axis1=1, axis2=2), np.diagonal(self.slip, axis1=1, axis2=2)


def on_fitted(prepared: Prepared) -> Prepared:
    """The logs with the rows that fit in place of those that judge, and at most MOST_STARTS of the starts there."""
    return prepared._replace(log=prepared.fitted, judging=some_of(prepared.naming, MOST_STARTS))


def some_of(starts: Starts, most: int) -> Starts:
    """At most so many of some starts, spread evenly."""
    if len(starts.row) <= most:
        return starts
    chosen = np.unique(np.linspace(0, len(starts.row) - 1, most).round().astype(int))
    return Starts(starts.run[chosen], starts.row[chosen])


def judge_model(model: Model, prepared: Prepared) -> Judged:
    """The model's predictions against the poses measured at the horizon."""
    log, starts, rows = prepared.log, prepared.judging, prepared.rows
    ahead = run_ahead(model, log, starts, rows, burn_in=BURN, session_time=0.0)
    measured = np.stack(log.pose, axis=1)[run_begins(log)[starts.run] + starts.row + rows]
    error = measured - ahead.pose[:, -1]
    error[:, 2] = (error[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    turn = into_channels(measured[:, 2])
    start, slip = (
        _as_others(turn @ part[:, -1] @ turn.transpose(0, 2, 1), ahead.run_up) for part in (ahead.start, ahead.slip)
    )
    slopes = np.einsum("sij,dsj->dsi", turn, ahead.parameters[:, :, -1])
    return Judged((turn @ error[..., None])[..., 0], start, slip, slopes, ahead.pose, ahead.run_up)


def _as_others(covariance: Array, run_up: Array) -> np.ndarray:
    """Covariances (starts, 3, 3), those of run-ups as the others have them on the mean, if there are others. A run-up
    knows of its speeds what is known of any robot's. On a Husky one of 104 starts was one: it alone foretold 374 mm for
    the root mean square of all, which came out as 158 mm."""
    found, known = np.array(covariance), ~np.asarray(run_up)
    if known.any():
        found[~known] = np.mean(found[known], axis=0)
    return found


def into_channels(heading: Array) -> np.ndarray:
    """Matrices (n, 3, 3) that take x, y, heading into along, lateral, heading."""
    turn = np.zeros((len(heading), 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(heading)
    turn[:, 0, 1], turn[:, 1, 0] = np.sin(heading), -np.sin(heading)
    turn[:, 2, 2] = 1.0
    return turn

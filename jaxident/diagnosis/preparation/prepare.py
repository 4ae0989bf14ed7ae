"""From logs to what a diagnosis works on: scaled commands, windows, and what each run is for."""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.fit.nominal import lower_valley, rough_fit, starting_point
from jaxident.diagnosis.fit.refit import Solution
from jaxident.diagnosis.motion.windows import Piece, Windows, cut, take
from jaxident.diagnosis.noise.law import Law
from jaxident.diagnosis.preparation.dropped_commands import Lost
from jaxident.diagnosis.preparation.given_laws import obeying_as, obeying_given
from jaxident.diagnosis.preparation.pose_screening import (
    Frames,
    find_more_outliers,
    find_outliers,
    find_repeats,
    frames_of,
    has_outliers,
)
from jaxident.diagnosis.preparation.roles import rows_served, split
from jaxident.effects.coordinates import NOMINAL, neutral_vector
from jaxident.errors import InputError
from jaxident.estimation.ahead.stretches import Starts
from jaxident.estimation.increments.observations import blind, poses_only
from jaxident.estimation.suspicions.checks import check_informative
from jaxident.estimation.suspicions.wheel_suspicions import check_wheels
from jaxident.log import Log, join, run_begins
from jaxident.robot.model import Discovered

BURN = 20
"""Rows from which a window's start state is estimated before the horizon begins."""
FEWEST = 3
"""Poses among the first rows of a window that tell its start state, five numbers."""
LONGEST, SHORTEST = 60, 20
"""Rows of a horizon where none is asked for: cost grows with their cube, sensitivity with their number."""
HORIZON = 1.0
"""Horizon [s] where none is asked for."""
TOO_SHORT = "{} rows make {} windows of {} rows and none to judge by: record longer runs, or three of them"


class Prepared(NamedTuple):
    """What fits, and what judges alone.

    log: in the user's units, poses as they were measured. largest: the command that the search has as its unit.
    windows: those that fit and name, commands over `largest`; frames: of the rows that they were cut from. judging:
    rows from which predictions are judged, `rows` rows or horizon [s] ahead, none of which the windows saw beyond;
    naming: the same of the rows that fit, in the log `fitted` of these alone.
    nominal: the nominal fit. lost: the share of commands that never arrived, and the gain of
    saying so; the windows' commands are then those that did, those `sent` (rows of a piece, pieces, 2) are kept.
    told (10,): the coordinates of a nominal model that was given, None without; laws: those in no catalogue that it
    has, in the user's unit, which every fit obeys. served: rows that fit, and rows that judge; of a long log they are
    not all (`roles`).
    """

    log: Log
    largest: float
    windows: Windows
    judging: Starts
    naming: Starts
    fitted: Log
    rows: int
    horizon: float
    frames: Frames
    nominal: Solution
    lost: tuple[float, float] = (0.0, 0.0)
    sent: Any = None
    told: Any = None
    laws: tuple[Discovered, ...] = ()
    served: tuple[int, int] = (0, 0)

    @property
    def whole(self) -> bool:
        """Whether every row of the log fits or judges."""
        return sum(self.served) >= len(self.log.t)


def prepare(
    logs,
    horizon: float | None,
    nominal: Array | None = None,
    like: "Prepared | None" = None,
    law: Law | None = None,
    laws: tuple[Discovered, ...] = (),
) -> Prepared:
    """Windows, roles and the nominal fit; `nominal` (SIZE,) is where its search begins, from the data alone without;
    laws: discovered ones that the nominal model has.

    With `like` the commands are scaled as there; with `law` the noise is taken for that and no run is kept apart: so
    are logs of a simulator without noise judged by what the robot's camera could see. InputError where the log says
    nothing.
    """
    given = join(logs)
    check_informative(given)
    largest = float(np.nanmax(np.abs(np.stack(given.command)))) if like is None else like.largest
    log = used(given) if like is None else poses_only(given)
    log = log._replace(u_r=np.asarray(given.u_r) / largest, u_l=np.asarray(given.u_l) / largest)
    period = float(np.median(np.concatenate([np.diff(run.t) for run in log.runs()])))
    rows, horizon = horizon_rows(horizon, period)
    roles = split(log, BURN + rows)
    pieces = roles.fit if law is None else sorted([*roles.fit, *roles.judge], key=lambda p: (p.run, p.first))
    fitted = only(log, pieces)
    judging, naming = judging_starts(log, roles.judge, rows), judging_starts(fitted, roles.fit, rows)
    frozen = find_repeats(fitted) if law is None else np.zeros(len(log.t), bool)
    fitted = blind(fitted, frozen)
    windows = stretches(fitted, BURN + rows, pieces)
    if like is None and not len(judging.row):
        raise InputError(TOO_SHORT.format(len(log.t), len(windows.run), BURN + rows))
    vector = neutral_vector(starting_point(fitted, pieces)) if nominal is None else np.asarray(nominal)
    told = None if nominal is None else vector[: len(NOMINAL)]
    windows, first = obeying_given(windows, laws, largest, vector, law)
    found = Prepared(given, largest, windows, judging, naming, only(given, pieces), rows, horizon,
                     Frames(frozen, frozen), first, told=told, laws=laws, served=rows_served(roles))  # fmt: skip
    if law is not None:
        return found
    outlying, windows, first = without_outliers(fitted, windows, first, pieces)
    return found._replace(
        windows=windows, frames=frames_of(fitted, frozen, outlying), nominal=lower_valley(first, windows)
    )


def used(log: Log) -> Log:
    """A log without wheel speeds that contradict its poses."""
    return log if log.wheel_r is None or check_wheels(log).usable else poses_only(log)


def suspected_wheels(log: Log) -> tuple[str, ...]:
    """What wheel speeds say against themselves or the poses, a line each; none of a log without."""
    return () if log.wheel_r is None else check_wheels(log).lines


def repaired(prepared: Prepared, lost: Lost) -> Prepared:
    """With the commands that arrived in place of those that were sent."""
    windows = prepared.windows._replace(command=lost.arrived)
    sent = prepared.windows.command if prepared.sent is None else prepared.sent
    return prepared._replace(windows=windows, lost=(lost.share, lost.gain), sent=sent)


def horizon_rows(horizon: float | None, period: float) -> tuple[int, float]:
    """Rows of a horizon [s], and the horizon that they make."""
    if horizon is None:
        rows = int(np.clip(round(HORIZON / period), SHORTEST, LONGEST))
    else:
        rows = round(horizon / period)
        if not 1 <= rows <= 4 * LONGEST:
            raise InputError(
                f"horizon: {horizon:g} s is {rows} samples of this log; "
                f"{period:g} to {4 * LONGEST * period:g} s are allowed"
            )
    return rows, rows * period


def only(log: Log, pieces: list[Piece]) -> Log:
    """The log without the poses of rows that no piece holds."""
    begins = run_begins(log)
    kept = np.zeros(len(log.t), bool)
    for piece in pieces:
        kept[begins[piece.run] + piece.first : begins[piece.run] + piece.last] = True
    return blind(log, ~kept)


def judging_starts(log: Log, pieces: list[Piece], rows: int) -> Starts:
    """Rows from which some rows ahead are judged: every `rows` rows of a piece from BURN on, or the last that its end
    allows, where FEWEST poses show the start and there is one to compare with."""
    found = []
    for piece in pieces:
        run = log.runs()[piece.run]
        seen = np.isfinite(np.stack(run.pose)).all(axis=0)
        last = piece.last - 1 - rows
        rows_of = np.arange(max(piece.first, BURN), last + 1, rows) if last >= BURN else np.array([last])
        found += [
            (piece.run, row)
            for row in rows_of[rows_of >= FEWEST]
            if seen[max(row + 1 - BURN, 0) : row + 1].sum() >= FEWEST and seen[row + rows]
        ]
    starts = np.array(found, int).reshape(-1, 2)
    return Starts(starts[:, 0], starts[:, 1])


def stretches(log: Log, rows: int, pieces: list[Piece]) -> Windows:
    """Windows of some rows that show their start. Where a second without poses comes first, the speed before is a
    guess: one far off bends a whole fit, or leaves what no number can hold. InputError where there are none."""
    windows = cut(log, rows, pieces=pieces)
    shown = np.flatnonzero(shows_start(windows))
    if not len(shown):
        raise InputError(f"no stretch of {rows} rows has {FEWEST} poses among its first {BURN}")
    return take(windows, shown)


def shows_start(windows: Windows) -> np.ndarray:
    """Windows, boolean, that have poses enough among their first rows."""
    return np.sum(windows.seen[:BURN], axis=0) >= FEWEST


def without_outliers(
    log: Log, windows: Windows, fit: Solution, pieces: list[Piece]
) -> tuple[np.ndarray, Windows, Solution]:
    """Rows that are outliers, and windows and nominal fit without them."""
    outlying = find_outliers(log, windows, fit)
    if outlying.any():
        windows, fit = without_rows(log, outlying, windows, fit, pieces)
    if has_outliers(outlying, int(np.isfinite(log.x).sum())):
        outlying |= find_more_outliers(blind(log, outlying), windows, fit)
        windows, fit = without_rows(log, outlying, windows, fit, pieces)
    return outlying, windows, fit


def without_rows(
    log: Log, rows: Array, windows: Windows, fit: Solution, pieces: list[Piece]
) -> tuple[Windows, Solution]:
    """Windows, and the nominal fit there, without the poses of some rows."""
    found = obeying_as(windows, stretches(blind(log, rows), len(windows.step), pieces))
    return found, rough_fit(found, fit.vector)

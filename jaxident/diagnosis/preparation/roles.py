"""What each part of a log is for: fits and names, or judging alone."""

import itertools
from typing import NamedTuple

import numpy as np

from jaxident.diagnosis.motion.windows import Piece
from jaxident.effects.fast_input import RUN_UP
from jaxident.log import Log, run_begins

FEWEST_RUNS = 3
"""Runs from which on whole runs have a role; fewer are cut into parts."""
GOLDEN, FIRST, SHARE = (5.0**0.5 - 1.0) / 2.0, 0.45, 1.0 / 3.0
"""The step from run to run, the first place and the width of those that judge (`which_judge`). With this first place
the second and the fifth of six runs judge; no other was tried."""
LONGEST = 1000
"""Rows of a piece that is fitted: a scan over the commands of one longer run takes as long as that over many."""
PARTS = 36
"""Parts at most that one or two runs are cut into."""
MOST_FITTED, MOST_JUDGED = 16_000, 8_000
"""Rows that fit, and rows that judge, at most: cost grows with both. With them a log of 22,200 rows takes 28 s and one
of 1,000,000 rows 32 s (`experiments/speed.md`); no other numbers were tried. Up to some 21,000 rows are all used."""
SHORT = 400
"""Rows of the pieces among which those that tell most are chosen. No other number was tried."""
MORE_STEPS, FINER = 2, 1.1
"""How many steps are tried at most, as a multiple of the pieces of mean length that have the rows wanted, and the
factor from one trial to the next. With these, four fifths of the rows chosen are from where the robot moves, if it
stands for four fifths of the time. No others were tried."""


class Roles(NamedTuple):
    """Pieces that are fitted, and pieces that judge alone."""

    fit: list[Piece]
    judge: list[Piece]


def split(log: Log, rows: int) -> Roles:
    """A third of the runs judges; of one or two runs, a third of their parts, of two windows (of `rows` rows) at
    least. Of a log of many rows those pieces have a role whose commands tell most."""
    runs = log.runs()
    step = float(np.median(np.concatenate([np.diff(run.t) for run in runs])))
    lead = int(np.ceil(RUN_UP / step))
    if len(runs) >= FEWEST_RUNS:
        parts = [(k, 0, len(run.t)) for k, run in enumerate(runs)]
    else:
        size = max(2 * rows, -(-sum(len(run.t) for run in runs) // PARTS))
        parts = [part for k, run in enumerate(runs) for part in _parts(k, 0, len(run.t), size)]
    judges = which_judge(len(parts))
    fitted = [part for part, alone in zip(parts, judges, strict=True) if not alone]
    size = max(rows, LONGEST // rows * rows)
    fit = [_piece(*short, lead) for part in fitted for short in _parts(*part, size)]
    judge = [_piece(*part, lead) for part in itertools.compress(parts, judges)]
    return Roles(_most_telling(log, fit, MOST_FITTED, rows, lead), _most_telling(log, judge, MOST_JUDGED, rows, lead))


def which_judge(count: int) -> list[bool]:
    """Which of some runs judge: the second, the fifth and so on, two to five apart, a third of all.

    Multiples of the golden ratio, less their whole parts, fill 0 to 1 evenly, and so do every second, every third or
    every n-th of them. Those in a third of that judge. If every third run judged, logs with a period would be split by
    it: a Husky's has three runs for each command, of which only the first shows how speeds settle.
    """
    places = GOLDEN * np.arange(count) % 1.0
    return [bool(judges) for judges in (places >= FIRST) & (places < FIRST + SHARE)]


def rows_served(roles: Roles) -> tuple[int, int]:
    """How many rows fit, and how many judge."""
    return _rows_in(roles.fit), _rows_in(roles.judge)


def _rows_in(pieces: list[Piece]) -> int:
    return sum(piece.last - piece.first for piece in pieces)


def _most_telling(log: Log, pieces: list[Piece], most: int, rows: int, lead: int) -> list[Piece]:
    """The pieces, or short ones of them that have `most` rows together at most, at even steps of the information that
    the commands have gathered since the log began: many where the robot moves anyhow, few where it stands. Of short
    runs, and where several steps fall on one piece, more steps are needed for as many rows."""
    if _rows_in(pieces) <= most:
        return pieces
    size, told = max(rows, SHORT // rows * rows), np.concatenate([[0.0], np.cumsum(leverages(log))])
    parts = [part for piece in pieces for part in _parts(piece.run, piece.first, piece.last, size)]
    short = [_piece(*part, lead) for part in parts]
    begins = run_begins(log)
    gathered = np.cumsum([told[begins[p.run] + p.last] - told[begins[p.run] + p.first] for p in short])
    chosen, steps, largest = short[:0], most // size, MORE_STEPS * most * len(short) // _rows_in(short)
    while steps <= largest:
        middles = (np.arange(steps) + 0.5) * gathered[-1] / steps
        found = [short[k] for k in np.unique(np.searchsorted(gathered, middles))]
        if len(chosen) < len(found) and _rows_in(found) <= most:
            chosen = found
        steps = max(steps + 1, int(FINER * steps))
    return chosen


def leverages(log: Log) -> np.ndarray:
    """How much each row's commands tell beside those of all others (rows,), between 0 and 1; 0 where no pose was seen.

    psi' (sum of psi psi')^-1 psi, psi both commands and their changes since the row before: what a linear model would
    learn there (Belsley, Kuh and Welsch 1980, section 2.1). Poses have no say, so that noise has none.
    """
    command = np.nan_to_num(np.stack(log.command, axis=1))
    change = np.diff(command, axis=0, prepend=command[:1])
    change[run_begins(log)] = 0.0
    seen = np.isfinite(np.stack(log.pose)).all(axis=0)
    regressors = np.where(seen[:, None], np.concatenate([command, change], axis=1), 0.0)
    return np.einsum("ti,ij,tj->t", regressors, np.linalg.pinv(regressors.T @ regressors), regressors)


def _parts(run: int, first: int, last: int, size: int) -> list[tuple[int, int, int]]:
    """Rows first to last of a run in parts of some rows."""
    return [(run, begin, min(begin + size, last)) for begin in range(first, last, size)]


def _piece(run: int, first: int, last: int, lead: int) -> Piece:
    return Piece(run, max(first - lead, 0), first, last)

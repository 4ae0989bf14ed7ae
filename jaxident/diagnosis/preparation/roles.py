"""What each part of a log is for: fits and names, or judging alone."""

import itertools
from typing import NamedTuple

import numpy as np

from jaxident.diagnosis.motion.windows import Piece
from jaxident.effects.fast_input import RUN_UP
from jaxident.log import Log

SHARED_BY = 3
"""Every third run judges, the second first, so that both purposes see early and late."""
LONGEST = 1000
"""Rows of a piece that is fitted: a scan over the commands of one longer run takes as long as that over many."""
PARTS = 36
"""Parts at most that one or two runs are cut into."""


class Roles(NamedTuple):
    """Pieces that are fitted, and pieces that judge alone."""

    fit: list[Piece]
    judge: list[Piece]


def split(log: Log, rows: int) -> Roles:
    """Every third run judges; of one or two runs, every third part of them, of two windows (of `rows` rows) at
    least."""
    runs = log.runs()
    step = float(np.median(np.concatenate([np.diff(run.t) for run in runs])))
    lead = int(np.ceil(RUN_UP / step))
    if len(runs) >= SHARED_BY:
        parts = [(k, 0, len(run.t)) for k, run in enumerate(runs)]
    else:
        size = max(2 * rows, -(-sum(len(run.t) for run in runs) // PARTS))
        parts = [part for k, run in enumerate(runs) for part in _parts(k, 0, len(run.t), size)]
    judges = [number % SHARED_BY == 1 for number in range(len(parts))]
    fitted = [part for part, judging in zip(parts, judges, strict=True) if not judging]
    size = max(rows, LONGEST // rows * rows)
    fit = [_piece(*short, lead) for part in fitted for short in _parts(*part, size)]
    return Roles(fit, [_piece(*part, lead) for part in itertools.compress(parts, judges)])


def _parts(run: int, first: int, last: int, size: int) -> list[tuple[int, int, int]]:
    """Rows first to last of a run in parts of some rows."""
    return [(run, begin, min(begin + size, last)) for begin in range(first, last, size)]


def _piece(run: int, first: int, last: int, lead: int) -> Piece:
    return Piece(run, max(first - lead, 0), first, last)

"""The logs as a diagnosis sees them: pieces of runs for what remembers, windows with a start of their own for what
moves."""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.effects.law_arrays import Laws
from jaxident.estimation.poses.runs import stack_runs
from jaxident.estimation.poses.ways import ways
from jaxident.log import Log, join, run_begins
from jaxident.programs import roomy

SMALLEST = 8
"""Poses that a window needs: fewer say nothing beyond its start state."""
FREE = np.full(4, np.nan)
"""Of windows in which nothing is held."""
ROWS = 64
"""Rows that room for pieces comes in. No other number was tried."""


class Windows(NamedTuple):
    """Pieces of runs cut into windows; time first, windows last.

    t (rows of a piece, pieces) [s]: since the piece's first row; session (pieces,) [s]: session time of that row;
    command (rows of a piece, pieces, 2). step (rows, windows) [s]: from each row to the next; pose (rows, windows, 3);
    seen (rows, windows); run (windows,): of which piece; first (windows,): its first row there; row (windows,): in
    the log; way (2, windows): way [m] and turn [rad] of the robot from the piece's first pose to that row, as measured
    (`ways`). wheels (rows, windows, 2) [rad/s], turning (rows, windows): wheel speeds, and where both were measured;
    None in logs without. held (4,): where the search holds the coordinates of `fit.prior.HOLDS`, NaN what it finds
    itself. laws: discovered laws that the robot obeys (`Laws`, phase by window), commands over their largest; None
    without.
    """

    t: Any
    session: Any
    command: Any
    step: Any
    pose: Any
    seen: Any
    run: Any
    first: Any
    row: Any
    way: Any
    wheels: Any = None
    turning: Any = None
    held: Any = FREE
    laws: Any = None


class Piece(NamedTuple):
    """Rows `first` to `last`, the last not included, of a run of a log; commands count from row `begin` on, so that
    what remembers them is run up."""

    run: int
    begin: int
    first: int
    last: int


def whole_runs(log: Log) -> list[Piece]:
    """Every run as one piece."""
    return [Piece(k, 0, 0, len(run.t)) for k, run in enumerate(log.runs())]


def cut(log: Log, rows: int, stride: int | None = None, pieces: list[Piece] | None = None) -> Windows:
    """Windows of some rows, one every `stride` (default: rows, so that no pose counts twice), of every piece (default:
    whole runs).

    Rows past the end of a piece are not seen; what the camera missed neither. Session time is the sum of the durations
    of the runs before, and the time in this one.
    """
    pieces = whole_runs(log) if pieces is None else pieces
    runs, stride = log.runs(), rows if stride is None else stride
    passed = np.concatenate([[0.0], np.cumsum([run.t[-1] - run.t[0] for run in runs])])
    own = [runs[piece.run].rows(piece.begin, piece.last) for piece in pieces]
    stacked = stack_runs(join(own))
    count, length = stacked.seen.shape
    step = np.broadcast_to(np.asarray(stacked.step, float), (count, length))
    t = np.concatenate([np.zeros((count, 1)), np.cumsum(step[:, :-1], axis=1)], axis=1)
    session = [passed[p.run] + run.t[0] - runs[p.run].t[0] for p, run in zip(pieces, own, strict=True)]
    firsts = [np.arange(p.first - p.begin, max(p.last - p.begin - 1, 1), stride) for p in pieces]
    run, first = np.repeat(np.arange(count), list(map(len, firsts))), np.concatenate(firsts)
    places = first[:, None] + np.arange(rows)
    inside = np.minimum(places, length - 1)
    seen = stacked.seen[run[:, None], inside] & (places < length)
    kept = seen.sum(axis=1) >= SMALLEST
    run, first, seen, inside = run[kept], first[kept], seen[kept], inside[kept]
    pose = np.stack(stacked.pose, axis=-1)
    begins = np.array([run_begins(log)[piece.run] + piece.begin for piece in pieces])
    wheels, turning = _wheels_of(own, run, inside, places[kept] < length)
    return Windows(
        t=t.T, session=np.asarray(session, float), command=np.stack(stacked.command, axis=-1).transpose(1, 0, 2),
        step=step[run[:, None], inside].T, pose=pose[run[:, None], inside].transpose(1, 0, 2), seen=seen.T,
        run=run, first=first, row=begins[run] + first, way=ways(own)[:, run, first], wheels=wheels, turning=turning,
    )  # fmt: skip


def _wheels_of(runs: list[Log], run: Array, inside: Array, there: Array) -> tuple[Any, Any]:
    """Wheel speeds (rows, windows, 2) and where both were measured, of places `inside` runs (windows, rows); None for
    logs without."""
    if runs[0].wheel_r is None:
        return None, None
    length = max(len(own.t) for own in runs)
    whole = np.full((len(runs), length, 2), np.nan)
    for k, own in enumerate(runs):
        whole[k, : len(own.t)] = np.stack([own.wheel_r, own.wheel_l], axis=1)
    cut_out = whole[run[:, None], inside]
    turning = np.isfinite(cut_out).all(axis=2) & there
    return np.where(turning[..., None], cut_out, 0.0).transpose(1, 0, 2), turning.T


def uncut(commands: Array, period: float) -> Windows:
    """Commands (inputs, samples, 2) as runs even at a period [s], each one window of zero poses."""
    count, samples, _ = commands.shape
    t = np.tile(period * np.arange(samples)[:, None], (1, count))
    return Windows(
        t=t, session=np.zeros(count), command=np.asarray(commands).transpose(1, 0, 2), step=np.full(t.shape, period),
        pose=np.zeros((*t.shape, 3)), seen=np.ones(t.shape, bool), run=np.arange(count),
        first=np.zeros(count, int), row=np.zeros(count, int), way=np.zeros((2, count)),
    )  # fmt: skip


def obeying_laws(windows: Windows, laws: Laws | None) -> Windows:
    """The windows of a robot that obeys some laws, whose wheels begin each piece at the angle 0."""
    if laws is None:
        return windows._replace(laws=None)
    return windows._replace(laws=laws._replace(phase=np.zeros((len(laws.value), len(windows.run)))))


def with_room(windows: Windows) -> Windows:
    """The windows with copies of the last one behind them, and pieces with rows that go on as the last one and copies
    of the last piece behind: one program then serves logs of many lengths (`roomy`)."""
    rows, pieces = windows.t.shape
    blocks = -(-rows // ROWS)
    row, piece = _filling(rows, ROWS * roomy(blocks, blocks * pieces)), _filling(pieces, roomy(pieces, blocks * pieces))
    beyond = np.maximum(np.arange(len(row)) - (rows - 1), 0)[:, None]
    t = windows.t[row] + beyond * (windows.t[-1] - windows.t[-2])
    own = len(windows.run)
    return take(windows, _filling(own, roomy(own)))._replace(
        t=t[:, piece], session=windows.session[piece], command=windows.command[row][:, piece]
    )


def filled_up(starts: Array) -> np.ndarray:
    """Start states (..., windows) of windows that got room."""
    own = np.shape(starts)[-1]
    return np.take(starts, _filling(own, roomy(own)), axis=-1)


def _filling(count: int, room: int) -> np.ndarray:
    """Places (room,) of the first `count`, then the last one again and again."""
    return np.minimum(np.arange(room), count - 1)


def take(windows: Windows, chosen: Array) -> Windows:
    """Some of the windows; the runs stay whole."""
    if windows.laws is not None:
        windows = windows._replace(laws=windows.laws._replace(phase=windows.laws.phase[:, chosen]))
    if windows.wheels is not None:
        windows = windows._replace(wheels=windows.wheels[:, chosen], turning=windows.turning[:, chosen])
    return windows._replace(
        step=windows.step[:, chosen], pose=windows.pose[:, chosen], seen=windows.seen[:, chosen],
        run=windows.run[chosen], first=windows.first[chosen], row=windows.row[chosen], way=windows.way[:, chosen],
    )  # fmt: skip

"""How late or early the poses come beside the commands, and how the robot answers: NumPy alone, without a model fit.

Per channel (path length, turn) the speed follows the commands u of both wheels with one lag,
    f' = rate (u - f),    y_j = gain [F(q_{j+1}) - F(q_j)] + drift (q_{j+1} - q_j),    F' = f,    q_j = s_j + offset,
with s_j the times of the poses; sign(u) enters as u does and stands for dead zones. Both channels share the offset. It
is first sought by correlation over all lags, then fitted with the rates by Gauss-Newton on residuals that an
autoregression whitens; its standard error holds under what correlation is left (Newey and West 1987, prewhitened as by
Andrews and Monahan 1992). A delay of the robot is a negative offset: commands and poses cannot tell the two apart.
"""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Pose, Wheels
from jaxident.estimation.suspicions.motions import increments_of
from jaxident.estimation.suspicions.whitening import (
    ORDER,
    autoregression,
    inverse_of_products,
    score_covariance,
    unbroken,
)
from jaxident.log import Log

START_RATES = (1.0, 3.0, 8.0, 20.0)
"""Rates [1/s] at which the search by correlation is made: one of them is within a factor of two of a robot's."""
SLOWEST_RATE, FASTEST_RATE = 0.1, 100.0
FEWEST = 60
"""Increments that an estimate needs."""
MOST_CELLS = 1 << 18
"""Cells of the even grid of the search."""
STEPS, EARLY, ARRIVED = 14, 4, 1e-6
"""Steps of Gauss-Newton at most, those without whitening, and the step of the offset [s] and of the logarithms of the
rates at which the fit ends; 1e-6 is the only one tried."""
PART = 1e-5  # of a rate: the step of the derivative by its logarithm
DOUBT = 10.0
"""Log likelihood by which an offset must lead another, one second or more away."""
LONGEST_STEP = 0.3
"""Of the offset [s] in one step."""
PAUSE = 30.0
"""Time [s] put between runs, in which nothing is commanded: whatever a run began has ended."""


class Streams(NamedTuple):
    """Commands (n,) and (n, 2) that hold until the next; increments [m], [rad] between poses: times of both ends (m, 2)
    and values (m, 2), path length and turn."""

    command_t: Any
    command: Any
    ends: Any
    increment: Any


class Response(NamedTuple):
    """offset [s] to add to the times of the poses, and its standard error; gain (2, 2), speeds per command, along and
    in turn by right and left, with deviations; rate (2,) [1/s]; left: deviation of a whitened increment (2,);
    explained: share of the increments' variance (2,); rows: increments used; rival: another offset as good."""

    offset: float
    standard_error: float
    gain: Any
    gain_deviation: Any
    rate: Any
    left: Any
    explained: Any
    rows: int
    rival: float | None = None


def streams_of(command_t: Any, command: Wheels, pose_t: Any, pose: Pose) -> Streams:
    """Streams from commands and poses that were recorded apart."""
    t = np.asarray(pose_t, float)
    ends, increment = np.stack([t[:-1], t[1:]], axis=1), increments_of(pose).T
    return Streams(np.asarray(command_t, float), np.stack(command, axis=1).astype(float), ends, increment)


def streams_of_log(log: Log) -> Streams:
    """Streams from a log, its runs one after another with pauses between."""
    parts, begin = [], 0.0
    for run in log.runs():
        t = np.asarray(run.t, float) - run.t[0] + begin
        seen = np.isfinite(np.stack(run.pose)).all(axis=0)
        command = np.nan_to_num(np.stack(run.command))
        part = streams_of(t, Wheels(*command), t[seen], Pose(*(np.asarray(column)[seen] for column in run.pose)))
        parts.append(
            part._replace(command_t=np.append(t, t[-1] + 1e-3), command=np.pad(part.command, ((0, 1), (0, 0))))
        )
        begin = t[-1] + PAUSE
    return Streams(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def respond(streams: Streams, limit: float = np.inf) -> Response | None:
    """The response of a robot to its commands, offsets up to `limit` [s] searched; None where too little moves."""
    if len(streams.ends) < FEWEST or len(streams.command_t) < 4 or not np.ptp(streams.command, axis=0).any():
        return None
    search = [_search(streams, rate, limit) for rate in START_RATES]
    if not search or not all(len(score) for _, score in search):
        return None
    best = max(range(len(search)), key=lambda k: np.max(search[k][1]))
    lags, score = search[best]
    first = float(lags[np.argmax(score)])
    found = _fit(streams, first, START_RATES[best])
    apart = max(1.0, 3.0 / START_RATES[best])
    far = np.abs(lags - first) > apart
    if found is None or not far.any():
        return found
    other = _fit(streams, float(lags[far][np.argmax(score[far])]), START_RATES[best])
    if other is None or abs(other.offset - found.offset) < 0.5 * apart:
        return found
    close = found.rows * np.sum(np.log(other.left / found.left)) < DOUBT
    return found._replace(rival=other.offset if close else None)


def _lagged(t: np.ndarray, u: np.ndarray, rate: float) -> np.ndarray:
    """f (n, columns) at the times of the commands, from rest: f_{i+1} = k f_i + (1 - k) u_i, by doubling spans."""
    keep = np.exp(-rate * np.diff(t))[:, None]
    found, span = (1.0 - keep) * u[:-1], 1
    while span < len(found) and keep[span - 1 :].max() > 1e-17:
        found[span:] += keep[span:] * found[:-span]
        keep[span:] = keep[span:] * keep[:-span]
        span *= 2
    return np.concatenate([np.zeros((1, u.shape[1])), found])


def follow_commands(t: np.ndarray, u: np.ndarray, rate: float, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Commands u (n, columns), each held from its time t [s] on, through a lag of a rate [1/s] from rest: the integral
    of what comes out, and what comes out, both (len(at), columns) at any times `at` [s]. Before the first command
    nothing was commanded."""
    start = _lagged(t, u, rate)
    area = np.concatenate([np.zeros((1, u.shape[1])), np.cumsum(np.diff(t)[:, None] * u[:-1], axis=0)])
    k = np.maximum(np.searchsorted(t, at, side="right") - 1, 0)
    since = np.maximum(at - t[k], 0.0)[:, None]
    f = u[k] + (start[k] - u[k]) * np.exp(-rate * since)
    return area[k] + since * u[k] - f / rate, f


def _search(streams: Streams, rate: float, limit: float) -> tuple[np.ndarray, np.ndarray]:
    """Offsets of an even grid, and the log likelihood ratio of each: correlation of measured and commanded speeds."""
    t, ends = streams.command_t, streams.ends
    span = max(np.ptp(t), ends[-1, 1] - ends[0, 0])
    step = max(float(np.median(ends[:, 1] - ends[:, 0])), span / MOST_CELLS)
    edges = np.arange(ends[0, 0], ends[-1, 1] + step, step)
    knots = np.concatenate([ends[:1, 0], ends[:, 1]])
    total = np.concatenate([np.zeros((1, 2)), np.cumsum(streams.increment, axis=0)])
    measured = np.stack([np.diff(np.interp(edges, knots, column)) for column in total.T])
    inputs = np.diff(follow_commands(t, streams.command, rate, np.arange(t[0], t[-1] + step, step))[0], axis=0).T
    measured, inputs = (part - part.mean(axis=1, keepdims=True) for part in (measured, inputs))
    size = 1 << int(np.ceil(np.log2(measured.shape[1] + inputs.shape[1] + 1)))
    seen, sent = np.fft.rfft(measured, size), np.fft.rfft(inputs, size)
    shift = np.arange(size)
    shift = np.where(shift < inputs.shape[1], shift, shift - size)
    offset = shift * step + t[0] - ends[0, 0]
    cross = np.fft.irfft(np.conj(seen)[:, None] * sent[None], size)
    gram = inputs @ inputs.T
    gram = gram + 1e-9 * max(np.trace(gram), 1e-300) * np.eye(2)
    explained = np.einsum("cis,ij,cjs->cs", cross, np.linalg.inv(gram), cross)
    share = explained / np.maximum(np.sum(measured**2, axis=1), 1e-300)[:, None]
    score = -0.5 * measured.shape[1] * np.sum(np.log(np.maximum(1.0 - share, 1e-12)), axis=0)
    half = 0.5 * min(np.ptp(t), ends[-1, 1] - ends[0, 0])
    overlap = np.minimum(t[-1], ends[-1, 1] + offset) - np.maximum(t[0], ends[0, 0] + offset)
    kept = (np.abs(offset) <= limit) & (overlap >= half)
    return offset[kept], score[kept]


class _Table(NamedTuple):
    """Per channel, first axis: increments (2, m), columns (2, m, 5) of the gains and the drift, and derivatives of the
    columns with respect to the offset and the logarithm of the rate."""

    y: Any
    columns: Any
    by_offset: Any
    by_rate: Any


def _tabulate(streams: Streams, offset: float, rates: np.ndarray) -> _Table:
    u = np.concatenate([streams.command, np.sign(streams.command)], axis=1)
    at = streams.ends + offset
    length = np.diff(at, axis=1)

    def moved(rate: float) -> tuple[np.ndarray, np.ndarray]:
        both = follow_commands(streams.command_t, u, rate, at.T.ravel())  # at once: the lag is what takes time
        travelled, speed = (each[len(at) :] - each[: len(at)] for each in both)
        return travelled, speed

    columns, by_offset, by_rate = [], [], []
    for rate in rates:
        value, slope = moved(rate)
        change = (moved(rate * (1.0 + PART))[0] - value) / PART
        columns.append(np.concatenate([value, length], axis=1))
        by_offset.append(np.pad(slope, ((0, 0), (0, 1))))
        by_rate.append(np.pad(change, ((0, 0), (0, 1))))
    return _Table(streams.increment.T, np.stack(columns), np.stack(by_offset), np.stack(by_rate))


def _fit(streams: Streams, offset: float, rate: float) -> Response | None:
    """Gauss-Newton on offset and both rates, gains and drifts eliminated, from where the search left off."""
    begin, end = streams.command_t[0], streams.command_t[-1] + PAUSE
    inside = (streams.ends[:, 0] + offset >= begin) & (streams.ends[:, 1] + offset <= end)
    streams = streams._replace(ends=streams.ends[inside], increment=streams.increment[inside])
    if len(streams.ends) < FEWEST:
        return None
    rates, filters, kept = np.full(2, rate), np.zeros((2, ORDER)), np.ones(len(streams.ends), bool)
    for step in range(STEPS + 1):
        table = _tabulate(streams, offset, rates)
        white = _whiten(table, filters, kept)
        gains = np.stack([np.linalg.lstsq(x, y, rcond=1e-9)[0] for x, y in zip(white.columns, white.y, strict=True)])
        residual = table.y - np.einsum("cmk,ck->cm", table.columns, gains)
        if step == EARLY:
            filters, kept = np.stack([autoregression(one) for one in residual]), unbroken(streams.ends)
            white = _whiten(table, filters, kept)
        slopes, left, scale = _stack(white, gains)
        inverse = inverse_of_products(slopes)
        moved = (inverse @ (slopes.T @ left))[:3]
        if step == STEPS or (step > EARLY and np.max(np.abs(moved)) < ARRIVED):
            break
        offset += float(np.clip(moved[0], -LONGEST_STEP, LONGEST_STEP))
        rates = np.clip(rates * np.exp(np.clip(moved[1:], -0.7, 0.7)), SLOWEST_RATE, FASTEST_RATE)
    deviation = np.sqrt(np.maximum(np.diagonal(inverse @ score_covariance(slopes, left) @ inverse), 0.0))
    whole = np.var(table.y, axis=1)
    explained = np.where(whole > 0.0, 1.0 - np.var(residual, axis=1) / np.where(whole > 0.0, whole, 1.0), 0.0)
    gain_deviation = np.stack([deviation[3:5], deviation[8:10]])
    return Response(offset, float(deviation[0]), gains[:, :2], gain_deviation, rates, scale, explained, len(left) // 2)


def _whiten(table: _Table, filters: np.ndarray, kept: np.ndarray) -> _Table:
    """What the autoregression (2, ORDER) leaves of every column, on the rows kept."""

    def through(column: np.ndarray) -> np.ndarray:
        found = column.copy()
        for lag in range(1, ORDER + 1):
            weight = filters[:, lag - 1].reshape(2, *[1] * (column.ndim - 1))
            found[:, lag:] -= weight * column[:, :-lag]
        return found[:, kept]

    return _Table(*(through(column) for column in table))


def _stack(table: _Table, gains: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Slopes (2 m, 13) by offset, two rates, and both channels' gains and drift; residuals (2 m,), over their
    deviation; and that deviation (2,)."""
    left = table.y - np.einsum("cmk,ck->cm", table.columns, gains)
    scale = np.maximum(np.sqrt(np.mean(left**2, axis=1)), 1e-12)
    slopes = np.zeros((*left.shape, 13))
    for c in range(2):
        slopes[c, :, 0] = table.by_offset[c] @ gains[c]
        slopes[c, :, 1 + c] = table.by_rate[c] @ gains[c]
        slopes[c, :, 3 + 5 * c : 8 + 5 * c] = table.columns[c]
    return (slopes / scale[:, None, None]).reshape(-1, 13), (left / scale[:, None]).ravel(), scale

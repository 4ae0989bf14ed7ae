"""How the poses of a window answer to a small extra acceleration or sideways speed in each of its steps.

Linear about a fitted path, in closed form: what slip of the wheels and any missing force or sideways motion do. Numbers
are rows times x, y, heading; NumPy, windows first.
"""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.motion.windows import Windows


class Responses(NamedTuple):
    """Answers (windows, numbers, rows) of the poses to a unit in each step: acceleration along and in heading, speed to
    the left."""

    along: Any
    heading: Any
    left: Any


def modelled_path(residual: Array, windows: Windows) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x, y, heading (windows, rows) that a model with these residuals (windows, numbers) gave; bridged where no pose
    was seen."""
    found = np.asarray(windows.pose).transpose(1, 0, 2) - residual.reshape(*np.asarray(windows.step).T.shape, 3)
    seen = np.asarray(windows.seen).T
    if seen.all():
        found[..., 2] = np.unwrap(found[..., 2], axis=1)
        return found[..., 0], found[..., 1], found[..., 2]
    rows, last = np.arange(seen.shape[1]), seen.shape[1] - 1
    before = np.maximum.accumulate(np.where(seen, rows, 0), axis=1)
    after = np.minimum.accumulate(np.where(seen, rows, last)[:, ::-1], axis=1)[:, ::-1]
    first, end = seen.argmax(axis=1)[:, None], last - seen[:, ::-1].argmax(axis=1)[:, None]
    before, after = np.maximum(before, first), np.minimum(after, end)  # beyond the poses seen: the nearest one
    found[..., 2] = np.unwrap(np.take_along_axis(found[..., 2], before, axis=1), axis=1)
    part = np.clip((rows - before) / np.maximum(after - before, 1), 0.0, 1.0)[..., None]
    low, high = (np.take_along_axis(found, place[..., None], axis=1) for place in (before, after))
    found = (1.0 - part) * low + part * high
    return found[..., 0], found[..., 1], found[..., 2]


def modelled_speeds(path: tuple[Array, Array, Array], windows: Windows) -> tuple[np.ndarray, np.ndarray]:
    """v, w (windows, rows) of a path x, y, heading (windows, rows), from each row to the next; the last row has those
    of the row before."""
    step = np.asarray(windows.step).T
    x, y, turned = (np.diff(place, axis=1, append=place[:, -1:]) for place in path)
    for moved in (x, y, turned):
        moved[:, -1] = moved[:, -2]
    middle = path[2] + 0.5 * turned
    return (x * np.cos(middle) + y * np.sin(middle)) / step, turned / step


def answer_to_start(rates: Array, residual: Array, windows: Windows) -> np.ndarray:
    """Derivatives (windows, numbers, 5) of the poses by the start state x, y, heading, v, w."""
    x, y, theta = modelled_path(residual, windows)
    step = np.asarray(windows.step).T
    time = np.cumsum(step, axis=1) - step
    middle = 0.5 * (theta + np.concatenate([theta[:, 1:], theta[:, -1:]], axis=1))
    far, turn = (-np.expm1(-rate * time) / rate for rate in rates)
    part = np.diff(far, axis=1, append=far[:, -1:])
    mean_turn = 0.5 * (turn + np.concatenate([turn[:, 1:], turn[:, -1:]], axis=1))
    one, none = np.ones_like(time), np.zeros_like(time)
    columns = (
        (one, none, none),
        (none, one, none),
        (y[:, :1] - y, x - x[:, :1], one),
        (_before(part * np.cos(middle)), _before(part * np.sin(middle)), none),
        (-_before(mean_turn * _moved(y)), _before(mean_turn * _moved(x)), turn),
    )
    table = np.stack([np.stack(column, axis=-1) for column in columns], axis=-1)
    seen = np.asarray(windows.seen).T[:, :, None, None]
    return (seen * table).reshape(len(step), -1, 5)


def _moved(place: Array) -> np.ndarray:
    return np.diff(place, axis=1, append=place[:, -1:])


def _before(gained: Array) -> np.ndarray:
    """Sums (windows, rows) of what the steps before each row gained."""
    total = np.cumsum(gained, axis=1)
    return np.concatenate([np.zeros_like(total[:, :1]), total[:, :-1]], axis=1)


def respond(rates: Array, residual: Array, windows: Windows) -> Responses:
    """Answers about the path of a model with some residuals (windows, numbers), for rates (2,) [1/s]."""
    step = np.asarray(windows.step).T
    rows = step.shape[1]
    x, y, theta = modelled_path(residual, windows)
    middle = 0.5 * (theta + np.concatenate([theta[:, 1:], theta[:, -1:]], axis=1))
    sine, cosine = np.sin(middle), np.cos(middle)
    moved_x, moved_y = _moved(x), _moved(y)
    far, turn = (_travel(rate, step) for rate in rates)
    part = np.diff(far, axis=1, append=far[:, -1:])
    mean_turn = 0.5 * (turn + np.concatenate([turn[:, 1:], turn[:, -1:]], axis=1))
    none = np.zeros_like(turn)
    later = np.tril(np.ones((rows, rows)), -1)
    along = _poses(part, cosine, sine, none)
    heading = _poses(mean_turn, -moved_y, moved_x, turn)
    slide = later * step[:, None, :]
    left = np.stack([-slide * sine[:, None, :], slide * cosine[:, None, :], none], axis=2)
    seen = np.repeat(np.asarray(windows.seen).T, 3, axis=1)[:, :, None]
    return Responses(*(seen * part for part in (along, heading, left.reshape(len(step), -1, rows))))


def _poses(part: Array, x: Array, y: Array, turn: Array) -> np.ndarray:
    """Poses (windows, rows * 3, rows) from what each step gains (windows, rows, rows) along directions x, y (windows,
    rows), and turns."""

    def summed(direction):
        total = np.cumsum(part * direction[:, :, None], axis=1)
        return np.concatenate([np.zeros_like(total[:, :1]), total[:, :-1]], axis=1)

    stacked = np.stack([summed(x), summed(y), turn], axis=2)
    return stacked.reshape(len(part), -1, part.shape[2])


def _travel(rate: float, step: Array) -> np.ndarray:
    """Distance at each row (windows, rows, rows) from a unit acceleration in each step, speed decaying at a rate."""
    rate = max(float(rate), 1e-9)
    time = np.concatenate([np.zeros((len(step), 1)), np.cumsum(step[:, :-1], axis=1)], axis=1)
    since = np.maximum(time[:, :, None] - (time + step)[:, None, :], 0.0)
    once = -np.expm1(-rate * step) / rate
    twice = (step - once) / rate
    after = twice[:, None, :] + once[:, None, :] * -np.expm1(-rate * since) / rate
    rows = step.shape[1]
    return np.where(np.tril(np.ones((rows, rows)), -1) > 0.0, after, 0.0)

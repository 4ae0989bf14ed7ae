"""What is random: the camera's error, white or with a memory, and slip of the wheels; and the covariance that it gives
the poses of a window, which is linear in the variances. NumPy, windows first."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.motion.responses import Responses
from jaxident.diagnosis.motion.windows import Windows

EVERY = slice(None)
SMALL = 12
"""Rows below which a general inverse is as fast."""
FINEST = 1e-5
"""The finest camera, as a part of what a robot moves within a window, and in headings [rad]. Squares over a finer error
lose the priors in their rounding: a log without noise and with three poses in four missing ended in a singular matrix.
At 1e-6 what the fit leaves of a log without noise still stood out (5e-6 at six poses a second)."""


class Law(NamedTuple):
    """Standard deviations: white camera error [m], [rad]; slip as an acceleration [m/s^2], [rad/s^2] of correlation
    time [s], None without; camera error with a memory, None without; a wheel speed's
    noise [rad/s], None for that by differences."""

    position: float
    heading: float
    slip: tuple[float, float] | None = None
    slip_time: float | None = None
    coloured: tuple[float, float] | None = None
    coloured_time: float | None = None
    wheel: float | None = None


def less_slip(law: Law, factor: float) -> Law:
    """The law with a part of its slip's variances."""
    return law if law.slip is None else law._replace(slip=tuple(d * factor**0.5 for d in law.slip))


def first_law(windows: Windows) -> Law:
    """Camera error by fourth divided differences of successive poses, which motion hardly enters, however uneven their
    times; the median forgives switches."""
    pose, seen = np.nan_to_num(np.asarray(windows.pose)), np.asarray(windows.seen)
    time = np.cumsum(windows.step, axis=0) - windows.step
    order = np.argsort(~seen, axis=0, kind="stable")  # poses that were seen first, in their order
    pose, time = np.take_along_axis(pose, order[..., None], axis=0), np.take_along_axis(time, order, axis=0)
    pose[..., 2] = np.unwrap(pose[..., 2], axis=0)
    count = len(seen) - 4
    whole = np.arange(4, len(seen))[:, None] < seen.sum(axis=0)
    stencil = np.stack([time[k : count + k] for k in range(5)])
    apart = np.where(whole, stencil[:, None] - stencil, 1.0) + np.eye(5)[:, :, None, None]
    weight = 1.0 / np.prod(apart, axis=1)
    weight /= np.sqrt(np.sum(weight**2, axis=0))
    found: list[float] = []
    for k in range(3):
        change = sum(weight[j] * pose[j : count + j, :, k] for j in range(5))[whole]
        found.append(float(np.median(np.abs(change))) / 0.6745 if change.size else 1e-3)
    least = finest(windows)
    return Law(max(float(np.hypot(found[0], found[1])) / 2.0**0.5, least[0]), max(found[2], least[1]))


def finest(windows: Windows) -> tuple[float, float]:
    """The least white error of position [m] and heading [rad] that a law may have."""
    seen = np.asarray(windows.seen)[..., None]
    place, count = np.where(seen, np.asarray(windows.pose)[..., :2], 0.0), np.maximum(seen.sum(axis=0), 1)
    apart = np.where(seen, place - place.sum(axis=0) / count, 0.0)
    moved = float(np.sqrt(np.mean(apart**2)))
    return FINEST * max(moved, FINEST), FINEST


def covariance(law: Law, windows: Windows, responses: Responses, chosen: slice = EVERY) -> np.ndarray:
    """Covariance (windows, numbers, numbers) of the poses, or of some numbers of every window; unseen ones stand alone
    with variance 1."""
    one = np.arange(3 * len(windows.step))[chosen]
    numbers = np.tile(one, (len(windows.run), 1))
    parts = parts_of(law.slip_time, law.coloured_time, windows, responses, numbers)
    total = sum(variance * part for variance, part in zip(variances_of(law), parts, strict=True))
    return total + of_unseen(windows, numbers)


def whitener_of(law: Law, windows: Windows, responses: Responses) -> np.ndarray:
    """The inverse Cholesky factor (windows, numbers, numbers) of the covariance; rows of unseen poses are zero."""
    factor = inverse_of_lower(np.linalg.cholesky(covariance(law, windows, responses)))
    return factor * numbers_seen(windows)[:, :, None]


def inverse_of_lower(lower: Array) -> np.ndarray:
    """Inverses of lower triangular matrices (..., n, n) by halves: a third of the time of a general inverse."""
    half = lower.shape[-1] // 2
    if half < SMALL:
        return np.linalg.inv(lower)
    first, last = inverse_of_lower(lower[..., :half, :half]), inverse_of_lower(lower[..., half:, half:])
    found = np.zeros_like(lower)
    found[..., :half, :half], found[..., half:, half:] = first, last
    found[..., half:, :half] = -last @ (lower[..., half:, :half] @ first)
    return found


def white_whitener(law: Law, windows: Windows) -> np.ndarray:
    """The whitener (windows, numbers, numbers) of camera errors as large as a law's but without memory; diagonal."""
    seen = numbers_seen(windows)
    scale = np.tile(1.0 / deviations(law), len(windows.step))
    return np.eye(len(scale)) * scale * seen[:, :, None]


def deviations(law: Law) -> np.ndarray:
    """The camera's deviations (3,), white and coloured together, along, lateral [m] and in heading [rad]: where memory
    takes all, the white part alone would weigh a channel without bound."""
    position, angle = law.coloured or (0.0, 0.0)
    flat = np.hypot(law.position, position)
    return np.array([flat, flat, np.hypot(law.heading, angle)])


def variances_of(law: Law) -> np.ndarray:
    """The variances (variances,) of a law, in the order of `parts_of`."""
    return np.array([law.position, law.heading, *(law.slip or ()), *(law.coloured or ())]) ** 2


def parts_of(slip_time, coloured_time, windows: Windows, responses: Responses, numbers: Array) -> list[np.ndarray]:
    """What each variance multiplies (windows, n, n), for some numbers (windows, n)."""
    parts = camera_parts(windows, numbers)
    if slip_time is not None:
        answers = [answers_of(each, windows, numbers) for each in (responses.along, responses.heading)]
        parts += slip_parts(answers, slip_time, windows)
    if coloured_time is not None:
        parts += memory_parts(coloured_time, windows, numbers)
    return parts


def camera_parts(windows: Windows, numbers: Array) -> list[np.ndarray]:
    """What the variances of white camera errors in position and heading multiply (windows, n, n)."""
    seen = numbers_of(numbers_seen(windows), numbers)
    return [(seen * of)[:, :, None] * np.eye(numbers.shape[1]) for of in (numbers % 3 < 2, numbers % 3 == 2)]


def slip_parts(answers: Sequence[Array], slip_time: float, windows: Windows) -> list[np.ndarray]:
    """What the variance of each kind of slip, by what numbers answer to it (windows, n, rows), multiplies (windows, n,
    n)."""
    time = _times(windows)
    memory = np.exp(-np.abs(time[:, :, None] - time[:, None, :]) / slip_time)
    return [one @ memory @ one.transpose(0, 2, 1) for one in answers]


def memory_parts(coloured_time: float, windows: Windows, numbers: Array) -> list[np.ndarray]:
    """What the variances of camera errors with a memory in position and heading multiply (windows, n, n)."""
    seen, own = numbers_of(numbers_seen(windows), numbers), numbers_of(_times(windows), numbers // 3)
    memory = np.exp(-np.abs(own[:, :, None] - own[:, None, :]) / coloured_time)
    memory *= seen[:, :, None] * seen[:, None, :] * ((numbers % 3)[:, :, None] == (numbers % 3)[:, None])
    return [memory * of[:, :, None] for of in (numbers % 3 < 2, numbers % 3 == 2)]


def answers_of(answer: Array, windows: Windows, numbers: Array) -> np.ndarray:
    """What some numbers (windows, n) answer to each row (windows, n, rows), 0 where unseen."""
    return numbers_of(numbers_seen(windows), numbers)[:, :, None] * numbers_of(answer, numbers)


def _times(windows: Windows) -> np.ndarray:
    """Time of each row since its window's first (windows, rows) [s]."""
    step = np.asarray(windows.step).T
    return np.cumsum(step, axis=1) - step


def numbers_seen(windows: Windows) -> np.ndarray:
    """1 or 0 (windows, numbers)."""
    return np.repeat(np.asarray(windows.seen).T, 3, axis=1).astype(float)


def of_unseen(windows: Windows, numbers: Array) -> np.ndarray:
    """Variance 1 (windows, n, n) for those of some numbers (windows, n) that were not seen."""
    unseen = 1.0 - numbers_of(numbers_seen(windows), numbers)
    return unseen[:, :, None] * np.eye(unseen.shape[1])


def numbers_of(values: Array, numbers: Array) -> np.ndarray:
    """Some numbers (windows, n) of values (windows, numbers, ...)."""
    return np.take_along_axis(values, numbers.reshape(*numbers.shape, *[1] * (values.ndim - 2)), axis=1)

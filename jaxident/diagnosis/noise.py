"""What is random: the camera's error, white or with a memory, and slip of the wheels, sized from the residuals.

Restricted likelihood (Patterson and Thompson 1971, Biometrika 58): every window's start state is eliminated, so that
what it takes up of the residuals is not lost from the noise. The covariance is linear in the variances, which are
searched by average information (Gilmour, Thompson and Cullis 1995, Biometrics 51). NumPy, windows first.
"""

from typing import NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.motion.responses import Responses
from jaxident.diagnosis.motion.windows import Windows

MOST_STEPS = 12
SAMPLE, ROWS = 60, 20
"""Windows from which noise is sized, spread evenly, and rows of each that have a pose: slip is slow, and few rows show
it."""
EVERY = slice(None)
SLIP_TIMES = (0.05, 0.2, 0.8)
CAMERA_TIMES = (0.1, 0.5)
HOPE = 5.0
"""Times what its last step gained: what a search can still be expected to."""
WORTH, MEMORY_WORTH = 6.0, 20.0
"""Gain of log-likelihood for which slip is believed, two variances and a correlation time; and a memory of the camera,
which is claimed as an effect: what a model's form leaves looks like a small one."""


class Law(NamedTuple):
    """Standard deviations: white camera error [m], [rad]; slip as an acceleration [m/s^2], [rad/s^2] of correlation
    time [s], None without; camera error with a memory, None without."""

    position: float
    heading: float
    slip: tuple[float, float] | None = None
    slip_time: float | None = None
    coloured: tuple[float, float] | None = None
    coloured_time: float | None = None


class Sized(NamedTuple):
    """A law and the restricted log-likelihood of the windows it was sized on."""

    law: Law
    log_likelihood: float


def first_law(windows: Windows) -> Law:
    """Camera error by fourth differences of the poses, which motion hardly enters; the median forgives switches."""
    pose, seen = np.asarray(windows.pose), np.asarray(windows.seen)
    whole = np.all([seen[k : len(seen) - 4 + k] for k in range(5)], axis=0)
    found: list[float] = []
    for k in range(3):
        column = np.unwrap(pose[..., k], axis=0) if k == 2 else pose[..., k]
        change = np.diff(column, n=4, axis=0)[whole]
        found.append(float(np.median(np.abs(change))) / 0.6745 / np.sqrt(70.0) if change.size else 1e-3)
    return Law(max(float(np.hypot(found[0], found[1])) / 2.0**0.5, 1e-7), max(found[2], 1e-7))


def covariance(law: Law, windows: Windows, responses: Responses, chosen: slice = EVERY) -> np.ndarray:
    """Covariance (windows, numbers, numbers) of the poses, or of some numbers of every window; unseen ones stand alone
    with variance 1."""
    one = np.arange(3 * len(windows.step))[chosen]
    numbers = np.tile(one, (len(windows.run), 1))
    parts = _parts(law.slip_time, law.coloured_time, windows, responses, numbers)
    variances = [law.position, law.heading, *(law.slip or ()), *(law.coloured or ())]
    total = sum(sd**2 * part for sd, part in zip(variances, parts, strict=True))
    return total + _alone(windows, numbers)


def whitener_of(law: Law, windows: Windows, responses: Responses) -> np.ndarray:
    """The inverse Cholesky factor (windows, numbers, numbers) of the covariance; rows of unseen poses are zero."""
    factor = np.linalg.inv(np.linalg.cholesky(covariance(law, windows, responses)))
    return factor * _numbers_seen(windows)[:, :, None]


def white_whitener(law: Law, windows: Windows) -> np.ndarray:
    """The whitener (windows, numbers, numbers) of white camera noise alone; diagonal."""
    seen = _numbers_seen(windows)
    scale = np.tile(1.0 / np.array([law.position, law.position, law.heading]), len(windows.step))
    return np.eye(len(scale)) * scale * seen[:, :, None]


def size_noise(
    residual: Array, starts: Array, windows: Windows, responses: Responses, use: Array, worth: float = WORTH
) -> Law:
    """The likeliest law: white, with slip, with a camera memory, each only where it is worth its terms; from residuals
    (windows, numbers) and derivatives by start states (windows, numbers, 5) of the windows in `use` (boolean). worth:
    the gain for which slip is believed."""
    given = _sample(residual, starts, windows, responses, use)
    begin = first_law(windows)
    base = _size(given, begin, None, None)
    slips = [_size(given, begin, time, None, rival=base.log_likelihood) for time in SLIP_TIMES]
    slip = max(slips, key=lambda s: s.log_likelihood)
    base = slip if slip.log_likelihood > base.log_likelihood + worth else base
    needed = base.log_likelihood + MEMORY_WORTH
    memories = [_size(given, begin, None, time, rival=needed) for time in CAMERA_TIMES]
    memory = max(memories, key=lambda s: s.log_likelihood)
    rival = max(needed, memory.log_likelihood + WORTH)
    both = _size(given, begin, slip.law.slip_time, memory.law.coloured_time, rival=rival)
    if both.log_likelihood > rival:
        return both.law
    return memory.law if memory.log_likelihood > needed else base.law


def doubt_of(
    law: Law, residual: Array, starts: Array, windows: Windows, responses: Responses, use: Array
) -> np.ndarray:
    """Covariance (variances, variances) of the logarithms of a law's variances, by average information from the same
    numbers as `size_noise`; no variance is known worse than by a factor of about e."""
    residual, starts, own, part, numbers = _sample(residual, starts, windows, responses, use)
    parts = _parts(law.slip_time, law.coloured_time, own, part, numbers)
    theta = np.array([law.position, law.heading, *(law.slip or ()), *(law.coloured or ())]) ** 2
    curve = _likelihood(residual, starts, parts, theta, _alone(own, numbers))[2]
    return np.linalg.inv(theta[:, None] * curve * theta + np.eye(len(theta)))


def _sample(residual: Array, starts: Array, windows: Windows, responses: Responses, use: Array):
    """Residuals, derivatives by start states, windows, responses and numbers (windows, n) of those that size the
    noise."""
    chosen = np.flatnonzero(use)
    chosen = chosen[np.unique(np.linspace(0, len(chosen) - 1, min(SAMPLE, len(chosen))).round().astype(int))]
    own = take(windows, chosen)
    part = Responses(*(leaf[chosen] for leaf in responses))
    length = len(own.seen)
    rows = _rows_seen(np.asarray(own.seen), len(range(0, length, max(1, length // ROWS))))
    numbers = (3 * rows[:, :, None] + np.arange(3)).reshape(len(rows), -1)
    return _at(residual[chosen], numbers), _at(starts[chosen], numbers), own, part, numbers


def _rows_seen(seen: Array, count: int) -> np.ndarray:
    """Rows (windows, count) spread over those that are seen (rows, windows) in each window; where these are too few,
    all of them and some others."""
    order = np.argsort(~seen.T, axis=1, kind="stable")
    found, place = seen.sum(axis=0)[:, None], np.arange(count)
    return np.sort(np.take_along_axis(order, np.where(found >= count, place * found // count, place), axis=1), axis=1)


def _at(values: Array, numbers: Array) -> np.ndarray:
    """Some numbers (windows, n) of values (windows, numbers, ...)."""
    return np.take_along_axis(values, numbers.reshape(*numbers.shape, *[1] * (values.ndim - 2)), axis=1)


def take(windows: Windows, chosen: Array) -> Windows:
    """Some of the windows; the runs stay whole."""
    return windows._replace(
        step=windows.step[:, chosen], pose=windows.pose[:, chosen], seen=windows.seen[:, chosen],
        run=windows.run[chosen], first=windows.first[chosen],
    )  # fmt: skip


def _size(given, begin: Law, slip_time: float | None, coloured_time: float | None, rival: float = -np.inf) -> Sized:
    """The best variances of one structure, or poorer ones if it is far from beating a rival's log-likelihood."""
    residual, starts, windows, responses, numbers = given
    parts = _parts(slip_time, coloured_time, windows, responses, numbers)
    size = [begin.position**2, begin.heading**2]
    for part in parts[2:]:  # as much as the camera's variance at the poses
        size.append(begin.position**2 / max(float(np.mean(np.diagonal(part, axis1=1, axis2=2))), 1e-300))
    theta, value = _search(residual, starts, parts, np.array(size), _alone(windows, numbers), rival)
    sd = np.sqrt(theta)
    slip = (float(sd[2]), float(sd[3])) if slip_time is not None else None
    coloured = (float(sd[-2]), float(sd[-1])) if coloured_time is not None else None
    return Sized(Law(float(sd[0]), float(sd[1]), slip, slip_time, coloured, coloured_time), value)


def _parts(slip_time, coloured_time, windows: Windows, responses: Responses, numbers: Array) -> list[np.ndarray]:
    """What each variance multiplies (windows, n, n), for some numbers (windows, n)."""
    seen = _at(_numbers_seen(windows), numbers)
    both = seen[:, :, None] * seen[:, None, :]
    of_position, of_heading = (numbers % 3 < 2)[:, None], (numbers % 3 == 2)[:, None]
    parts = [both * np.eye(numbers.shape[1]) * wanted for wanted in (of_position, of_heading)]
    step = np.asarray(windows.step).T
    time = np.cumsum(step, axis=1) - step
    if slip_time is not None:
        memory = np.exp(-np.abs(time[:, :, None] - time[:, None, :]) / slip_time)
        answers = (_at(g, numbers) for g in (responses.along, responses.heading))
        parts += [both * (g @ memory @ g.transpose(0, 2, 1)) for g in answers]
    if coloured_time is not None:
        own = _at(time, numbers // 3)
        memory = np.exp(-np.abs(own[:, :, None] - own[:, None, :]) / coloured_time)
        same = (numbers % 3)[:, :, None] == (numbers % 3)[:, None]
        parts += [both * memory * (same & wanted) for wanted in (of_position, of_heading)]
    return parts


def _numbers_seen(windows: Windows) -> np.ndarray:
    """1 or 0 (windows, numbers)."""
    return np.repeat(np.asarray(windows.seen).T, 3, axis=1).astype(float)


def _alone(windows: Windows, numbers: Array) -> np.ndarray:
    """Variance 1 for those of some numbers (windows, n) that were not seen."""
    unseen = 1.0 - _at(_numbers_seen(windows), numbers)
    return unseen[:, :, None] * np.eye(unseen.shape[1])


def _search(residual: Array, starts: Array, parts, theta: Array, alone: Array, rival: float):
    """Variances of the highest restricted likelihood, and that likelihood; without hope against a rival it stops."""
    damping, best, value, slope, curve = 1e-3, theta, -np.inf, None, None
    proposed = theta
    for _ in range(MOST_STEPS):
        found = _likelihood(residual, starts, parts, proposed, alone)
        gained = found[0] - value
        if gained >= 0.0 or slope is None:
            best, (value, slope, curve), damping = proposed, found, 0.3 * damping
            if 0.0 <= gained < 0.02 or value + HOPE * gained < rival:
                break
        else:
            damping *= 10.0
        # in logarithms of the variances
        gradient, matrix = best * slope, best[:, None] * curve * best
        matrix = matrix + (damping + 1e-9) * np.diag(np.diagonal(matrix) + 1e-3)
        proposed = best * np.exp(np.clip(np.linalg.solve(matrix, gradient), -3.0, 3.0))
    return best, float(value)


def _likelihood(residual: Array, starts: Array, parts, theta: Array, alone: Array):
    """Restricted log-likelihood, its gradient and average information in the variances."""
    total = sum(t * part for t, part in zip(theta, parts, strict=True)) + alone
    inverse = np.linalg.inv(total)
    weighted = inverse @ starts
    information = starts.transpose(0, 2, 1) @ weighted
    scale = np.sqrt(np.diagonal(information, axis1=1, axis2=2))[:, :, None]
    scale = np.where(scale > 0.0, scale, 1.0)  # a window without any pose among these numbers
    information = information / scale / scale.transpose(0, 2, 1) + 1e-12 * np.eye(5)
    weighted = weighted / scale.transpose(0, 2, 1)
    inverse = inverse - weighted @ np.linalg.solve(information, weighted.transpose(0, 2, 1))
    taken = (inverse @ residual[..., None])[..., 0]
    moved = np.stack([(part @ taken[..., None])[..., 0] for part in parts])
    back = (inverse @ moved[..., None])[..., 0]
    slope = np.array([0.5 * (np.sum(m * taken) - np.sum(inverse * part)) for m, part in zip(moved, parts, strict=True)])
    curve = 0.5 * np.einsum("iwa,jwa->ij", moved, back)
    determinant = sum(np.sum(np.linalg.slogdet(matrix)[1]) for matrix in (total, information))
    determinant += 2.0 * np.sum(np.log(scale))
    return -0.5 * (determinant + np.sum(residual * taken)), slope, curve

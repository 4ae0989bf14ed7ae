"""What is random: the camera's error, white or with a memory, and slip of the wheels, sized from the residuals.

Restricted likelihood (Patterson and Thompson 1971, Biometrika 58): every window's start state is eliminated, so that
what it takes up of the residuals is not lost from the noise. The covariance is linear in the variances, which are
searched by average information (Gilmour, Thompson and Cullis 1995, Biometrics 51). NumPy, windows first.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.motion.responses import Responses
from jaxident.diagnosis.motion.windows import Windows, take
from jaxident.diagnosis.noise.law import Law, first_law, numbers_of, of_unseen, parts_of, slip_parts, variances_of

MOST_STEPS = 12
SAMPLE, ROWS = 60, 20
"""Windows from which noise is sized, spread evenly, and rows of each that have a pose: slip is slow, and few rows show
it."""
SLIP_TIMES = (0.05, 0.2, 0.8)
CAMERA_TIMES = (0.1, 0.5)
HOPE = 5.0
"""Times what its last step gained: what a search can still be expected to."""
WORTH, MEMORY_WORTH = 6.0, 20.0
"""Gain of log-likelihood for which slip is believed, two variances and a correlation time; and a memory of the camera,
which is claimed as an effect: what a model's form leaves looks like a small one."""
REST = 0.01
"""Part of what slip explains that a memory of the camera must bring beside it, on top: where a robot's own form of an
effect is taken for slip, what slip is no word for, such as slides sideways, looks like a memory."""
MOST_GAIN, STEADY = 0.1, 0.15
"""Part of the windows, those that gain most by a memory of the camera, and part of the gain that the others must bring:
a camera's error is there all the time, what a model misses where grip ends is not. The others brought 0.31 to 0.61 on
five robots with such a memory, and less than nothing on four whose wheels slide or have play."""
SLIDING = 10.0
"""Log-likelihood by which wheels that slide sideways at random may explain more than a memory of the camera: on twelve
robots with such a memory they did by 3 or not at all, on six with low grip by 49 to 500."""
LEAST = 1e-4
"""Part of the residuals' size that is white at least: without any the covariance of slip has no inverse."""


class Sample(NamedTuple):
    """Some windows and some numbers of each: residuals (windows, n), derivatives by start states (windows, n, 5), the
    windows and their responses, whole, and which numbers (windows, n) these are."""

    residual: Array
    starts: Array
    windows: Windows
    responses: Responses
    numbers: Array


class Sized(NamedTuple):
    """A law and the restricted log-likelihood of the windows it was sized on."""

    law: Law
    log_likelihood: float


def size_noise(
    residual: Array,
    starts: Array,
    windows: Windows,
    responses: Responses,
    worth: float = WORTH,
    memory_too: bool = True,
) -> Law:
    """The likeliest law: white, with slip, with a camera memory, each only where it is worth its terms; from residuals
    (windows, numbers) and derivatives by start states (windows, numbers, 5). worth: the gain for which slip is
    believed. memory_too: whether the camera may have a memory."""
    given = sample(residual, starts, windows, responses)
    begin = first_law(windows)
    base = size_one(given, begin, None, None)
    slips = [size_one(given, begin, time, None, rival=base.log_likelihood) for time in SLIP_TIMES]
    slip = max(slips, key=_likelihood)
    by_slip = slip.log_likelihood - base.log_likelihood
    base, by_slip = (slip, by_slip) if by_slip > worth else (base, 0.0)
    if not memory_too:
        return base.law
    needed = base.log_likelihood + MEMORY_WORTH + REST * by_slip
    memories = [size_one(given, begin, None, time, rival=needed) for time in CAMERA_TIMES]
    memory = max(memories, key=_likelihood)
    rival = max(needed, memory.log_likelihood + WORTH)
    both = size_one(given, begin, slip.law.slip_time, memory.law.coloured_time, rival=rival)
    if both.log_likelihood > rival:
        return both.law
    return memory.law if memory.log_likelihood > needed else base.law


def steady_gain(residual: Array, starts: Array, windows: Windows, responses: Responses, law: Law) -> float:
    """What a law's memory of the camera gains on the best law without one, both sized here, arguments as in
    `size_noise`; 0 where few windows bring it, or where wheels that slide sideways at random explain more: that is no
    camera.

    A window gains by its memory what it does not gain as well by the same law without that part: where few windows have
    large errors, the others gain by no longer being taken for as bad.
    """
    given = sample(residual, starts, windows, responses)
    own = size_one(given, law, law.slip_time, law.coloured_time)
    without = max((size_one(given, first_law(windows), time, None) for time in (None, *SLIP_TIMES)), key=_likelihood)
    others = (without.law, own.law._replace(coloured=None, coloured_time=None))
    gain = np.sort(_by_window(given, own.law) - np.maximum(*(_by_window(given, other) for other in others)))
    most = int(np.ceil(MOST_GAIN * len(gain)))
    steady = gain[:-most].sum() > STEADY * gain.sum()
    sliding = max(_sliding(given, time).log_likelihood for time in SLIP_TIMES) > own.log_likelihood + SLIDING
    return max(float(gain.sum()), 0.0) if steady and not sliding else 0.0


def _sliding(given: Sample, time: float) -> Sized:
    """The best variances of slip of some memory in all directions; of its speed sideways the law does not tell."""
    sideways = slip_parts((given.responses.left,), time, given.windows, given.numbers)
    return size_one(given, first_law(given.windows), time, None, beside=sideways)


def _likelihood(sized: Sized) -> float:
    return sized.log_likelihood


def _by_window(given: Sample, law: Law) -> np.ndarray:
    """Restricted log-likelihood (windows,) of each window."""
    residual, starts, windows, responses, numbers = given
    parts = parts_of(law.slip_time, law.coloured_time, windows, responses, numbers)
    return _weigh(residual, starts, parts, variances_of(law), of_unseen(windows, numbers))[0]


def sample(residual: Array, starts: Array, windows: Windows, responses: Responses) -> Sample:
    """What sizes the noise, of residuals (windows, numbers) and derivatives by start states (windows, numbers, 5)."""
    count = len(windows.run)
    chosen = np.unique(np.linspace(0, count - 1, min(SAMPLE, count)).round().astype(int))
    own = take(windows, chosen)
    part = Responses(*(leaf[chosen] for leaf in responses))
    length = len(own.seen)
    rows = _rows_seen(np.asarray(own.seen), len(range(0, length, max(1, length // ROWS))))
    numbers = (3 * rows[:, :, None] + np.arange(3)).reshape(len(rows), -1)
    return Sample(numbers_of(residual[chosen], numbers), numbers_of(starts[chosen], numbers), own, part, numbers)


def _rows_seen(seen: Array, count: int) -> np.ndarray:
    """Rows (windows, count) spread over those that are seen (rows, windows) in each window; where these are too few,
    all of them and some others."""
    order = np.argsort(~seen.T, axis=1, kind="stable")
    found, place = seen.sum(axis=0)[:, None], np.arange(count)
    return np.sort(np.take_along_axis(order, np.where(found >= count, place * found // count, place), axis=1), axis=1)


def size_one(
    given: Sample,
    begin: Law,
    slip_time: float | None,
    coloured_time: float | None,
    rival: float = -np.inf,
    beside: Sequence[Array] = (),
) -> Sized:
    """The best variances of one structure, or poorer ones if it is far from beating a rival's log-likelihood; beside:
    what further variances multiply."""
    residual, _, windows, responses, numbers = given
    parts = [*parts_of(slip_time, coloured_time, windows, responses, numbers), *beside]
    size = variances_of(begin)
    if len(size) < len(parts):  # as much as the camera's variance at the poses
        means = [float(np.mean(np.diagonal(part, axis1=1, axis2=2))) for part in parts[2:]]
        size = np.array([*size[:2], *(size[0] / max(mean, 1e-300) for mean in means)])
    least = np.zeros(len(parts))
    least[:2] = [LEAST**2 * np.mean(residual[own] ** 2) for own in (numbers % 3 < 2, numbers % 3 == 2)]
    theta, value = _search(given, parts, np.maximum(size, least), least, rival)
    sd = np.sqrt(theta)
    slip = (float(sd[2]), float(sd[3])) if slip_time is not None else None
    coloured = (float(sd[-2]), float(sd[-1])) if coloured_time is not None else None
    return Sized(Law(float(sd[0]), float(sd[1]), slip, slip_time, coloured, coloured_time), value)


def _search(given: Sample, parts, theta: Array, least: Array, rival: float):
    """Variances of the highest restricted likelihood, none below `least` (variances,), and that likelihood; without
    hope against a rival it stops."""
    residual, starts, windows, _, numbers = given
    alone = of_unseen(windows, numbers)
    damping, best, value, slope, curve = 1e-3, theta, -np.inf, None, None
    proposed = theta
    for _ in range(MOST_STEPS):
        found = likelihood(residual, starts, parts, proposed, alone)
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
        proposed = np.maximum(best * np.exp(np.clip(np.linalg.solve(matrix, gradient), -3.0, 3.0)), least)
    return best, float(value)


def likelihood(residual: Array, starts: Array, parts, theta: Array, alone: Array):
    """Restricted log-likelihood, its gradient (variances,) and average information (variances, variances) in the
    variances `theta`, each of which multiplies its part (windows, n, n); `alone` as in `of_unseen`."""
    values, inverse, taken = _weigh(residual, starts, parts, theta, alone)
    moved = np.stack([(part @ taken[..., None])[..., 0] for part in parts])
    back = (inverse @ moved[..., None])[..., 0]
    slope = np.array([0.5 * (np.sum(m * taken) - np.sum(inverse * part)) for m, part in zip(moved, parts, strict=True)])
    curve = 0.5 * np.einsum("iwa,jwa->ij", moved, back)
    return values.sum(), slope, curve


def _weigh(residual: Array, starts: Array, parts, theta: Array, alone: Array):
    """Restricted log-likelihood (windows,), and what is left of the inverse covariance (windows, n, n), and of it
    times the residual (windows, n), when start states are eliminated."""
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
    determinant = sum(np.linalg.slogdet(matrix)[1] for matrix in (total, information))
    determinant = determinant + 2.0 * np.sum(np.log(scale), axis=(1, 2))
    return -0.5 * (determinant + np.sum(residual * taken, axis=1)), inverse, taken

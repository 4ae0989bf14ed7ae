"""What is random: the camera's error, white or with a memory, and slip of the wheels, sized from the residuals: which
parts a law has, each only where it is worth its terms."""

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.motion.responses import Responses
from jaxident.diagnosis.motion.windows import Windows
from jaxident.diagnosis.noise.law import Law, first_law
from jaxident.diagnosis.noise.likelihood import (
    Amounts,
    Sample,
    Sized,
    amounts_of,
    by_window,
    likeliest,
    sample,
    structure_of,
)

SLIP_TIMES = (0.05, 0.2, 0.8)
CAMERA_TIMES = (0.1, 0.5)
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
FAINT = 0.01
"""Part of all squares at which a search for a part begins at least: from nothing it would crawl. No other value was
tried; it moves where a search begins, not where it ends."""
LITTLE = 0.1
"""The same for slip and memory where the camera seems to explain all."""


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
    base, begin = _white(given, first_law(windows))
    slip = _best(given, begin, [(time, None) for time in SLIP_TIMES], base.log_likelihood)
    by_slip = slip.log_likelihood - base.log_likelihood
    base, by_slip = (slip, by_slip) if by_slip > worth else (base, 0.0)
    if not memory_too:
        return base.law
    needed = base.log_likelihood + MEMORY_WORTH + REST * by_slip
    memory = _best(given, begin, [(None, time) for time in CAMERA_TIMES], needed)
    rival = max(needed, memory.log_likelihood + WORTH)
    begin = _begin(begin, memory.amounts._replace(slip=slip.amounts.slip))
    both = _best(given, begin, [(slip.law.slip_time, memory.law.coloured_time)], rival)
    if both.log_likelihood > rival:
        return both.law
    return memory.law if memory.log_likelihood > needed else base.law


def _white(given: Sample, camera: Law) -> tuple[Sized, Amounts]:
    """The best white law, and where searches for more begin: at the camera's own error, all else slip or memory."""
    structure = structure_of(given, None, None)
    white = likeliest(given, structure, Amounts(given.squares * structure.units))
    whole = white.amounts.camera
    own = np.minimum(amounts_of(camera, structure).camera, whole)
    more = np.maximum(whole - own, LITTLE * whole)
    return white, Amounts(np.maximum(own, FAINT * whole), more, more)


def _best(given: Sample, begin: Amounts, times: list[tuple[float | None, float | None]], rival: float) -> Sized:
    """The best of some correlation times, each searched from where the one before has ended."""
    found: list[Sized] = []
    for pair in times:
        found.append(likeliest(given, structure_of(given, *pair), begin, rival))
        begin = _begin(begin, found[-1].amounts)
    return max(found, key=_likelihood)


def _begin(before: Amounts, found: Amounts) -> Amounts:
    """Where the next search begins: at the amounts of the last, none of them faint; what it had not, as before."""
    least = FAINT * sum(float(np.sum(kind)) for kind in found)
    kinds = zip(found, before, strict=True)
    return Amounts(*(np.maximum(own, least) if len(own) else old for own, old in kinds))


def steady_gain(residual: Array, starts: Array, windows: Windows, responses: Responses, law: Law) -> float:
    """What a law's memory of the camera gains on the best law without one, both sized here, arguments as in
    `size_noise`; 0 where few windows bring it, or where wheels that slide sideways at random explain more: that is no
    camera.

    A window gains by its memory what it does not gain as well by the same law without that part: where few windows have
    large errors, the others gain by no longer being taken for as bad.
    """
    given = sample(residual, starts, windows, responses)
    own = size_one(given, law, law.slip_time, law.coloured_time)
    white, begin = _white(given, first_law(windows))
    slip = _best(given, begin, [(time, None) for time in SLIP_TIMES], -np.inf)
    without = max(white, slip, key=_likelihood)
    others = (without.law, own.law._replace(coloured=None, coloured_time=None))
    gain = np.sort(by_window(given, own.law) - np.maximum(*(by_window(given, other) for other in others)))
    most = int(np.ceil(MOST_GAIN * len(gain)))
    steady = gain[:-most].sum() > STEADY * gain.sum()
    sliding = max(_sliding(given, begin, time).log_likelihood for time in SLIP_TIMES) > own.log_likelihood + SLIDING
    return max(float(gain.sum()), 0.0) if steady and not sliding else 0.0


def _sliding(given: Sample, begin: Amounts, time: float) -> Sized:
    """The best variances of slip of some memory in all directions; of its speed sideways the law does not tell."""
    return likeliest(given, structure_of(given, time, None, sideways=True), begin)


def size_one(
    given: Sample, begin: Law, slip_time: float | None, coloured_time: float | None, rival: float = -np.inf
) -> Sized:
    """The best variances of one structure, searched from those of a law; or poorer ones if it is far from beating a
    rival's log-likelihood."""
    own = amounts_of(begin, structure_of(given, begin.slip_time, begin.coloured_time))
    return likeliest(given, structure_of(given, slip_time, coloured_time), own, rival)


def _likelihood(sized: Sized) -> float:
    return sized.log_likelihood

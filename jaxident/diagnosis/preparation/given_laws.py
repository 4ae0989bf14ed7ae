"""Discovered laws of the model that was given: the search's robot obeys them from the first fit on."""

from collections.abc import Sequence

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.fit.nominal import rough_fit
from jaxident.diagnosis.fit.refit import Solution
from jaxident.diagnosis.laws.wheel_angle import parts_of
from jaxident.diagnosis.motion.linear import follow, without_starts
from jaxident.diagnosis.motion.windows import Windows, obeying_laws, take
from jaxident.diagnosis.noise.law import Law, first_law, white_whitener
from jaxident.effects.coordinates import NOMINAL, neutral_vector
from jaxident.effects.law_arrays import laws_of
from jaxident.effects.law_kinds import ANGLE
from jaxident.estimation.ahead.wheel_phase import closer, phases_of
from jaxident.robot.model import Discovered

ROUNDS = 4
"""Fits between which the angles of wheels are looked for again. On a simulated robot -log p fell to 8612, 3541, 1596,
1563, and by 0.01 in two rounds more."""


def obeying_given(
    windows: Windows, laws: Sequence[Discovered], largest: float, vector: Array, law: Law | None = None
) -> tuple[Windows, Solution]:
    """Windows of a robot that obeys some laws, which are told for the user's commands, `largest` at most, and the
    nominal fit there from a vector (SIZE,) on. law: of the camera's noise, by default as fourth differences size it.

    The angles at which wheels begin are those that fit best beside the effects of that vector, for each part of a run
    by itself.
    """
    plain, windows = windows, obeying_laws(windows, laws_of(laws, largest))
    if of_wheels := [k for k, own in enumerate(laws) if own.signal == ANGLE]:
        windows, vector = _turned(windows, of_wheels, rough_fit(plain, vector, law), law)
    return windows, rough_fit(windows, neutral_vector(vector[: len(NOMINAL)]), law)


def obeying_as(windows: Windows, some: Windows) -> Windows:
    """Some of the windows, cut anew, that obey the laws which these obey, each at its phases."""
    if windows.laws is None:
        return some
    order = np.argsort(windows.row)
    same = order[np.searchsorted(windows.row, some.row, sorter=order)]
    return some._replace(laws=take(windows, same).laws)


def _turned(windows: Windows, of_wheels: Sequence[int], fit: Solution, law: Law | None) -> tuple[Windows, Array]:
    """The windows with the angles of the wheels that some laws go by, from a fit without laws on, and the vector of the
    fit there."""
    parts, whitener = parts_of(windows.run), white_whitener(first_law(windows) if law is None else law, windows)

    def at(phase: Array, acting: Sequence[int]) -> Windows:
        idle = [k for k in of_wheels if k not in acting]
        acts = ~np.isin(np.arange(len(phase)), idle)[:, None, None]
        each = np.zeros((len(phase), len(windows.run)))
        for k, own in enumerate(parts):
            each[:, own] = phase[:, k, None]
        return windows._replace(laws=windows.laws._replace(phase=each, value=windows.laws.value * acts))

    def misfit(phases: Array, acting: Sequence[int]) -> np.ndarray:
        residuals = [follow(fit.vector[None], fit.starts[None], at(phase, acting))[0] for phase in phases]
        left, _ = without_starts(whitener, np.stack(residuals, axis=-1), fit.linear.starts)
        squares = np.sum(left**2, axis=1)
        return np.stack([squares[own].sum(axis=0) for own in parts], axis=1)

    phase, _ = phases_of(misfit, of_wheels, (len(windows.laws.value), len(parts)))
    for _ in range(ROUNDS):
        fit = rough_fit(at(phase, of_wheels), fit.vector, law)
        phase, _ = closer(misfit, of_wheels, phase)
    return at(phase, of_wheels), fit.vector

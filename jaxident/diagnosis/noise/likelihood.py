"""The likeliest variances of a law's parts, by restricted likelihood (Patterson and Thompson 1971, Biometrika 58).

Every window is looked at in coordinates that no start state moves, so that what a fit takes up of the residuals is not
lost from the noise. The covariance is linear in the variances, which are searched by average information (Gilmour,
Thompson and Cullis 1995, Biometrics 51). NumPy, windows first.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.motion.responses import Responses
from jaxident.diagnosis.motion.windows import Windows, take
from jaxident.diagnosis.noise.law import (
    Law,
    answers_of,
    camera_parts,
    finest,
    inverse_of_lower,
    memory_parts,
    numbers_of,
    of_unseen,
    slip_parts,
    variances_of,
)

MOST_STEPS = 12
"""Of one search; seven of one case took 54 together."""
SAMPLE, ROWS = 60, 20
"""Windows from which noise is sized, spread evenly, and rows of each that have a pose: slip is slow, and few rows show
it."""
HOPE = 5.0
"""Times what its last step gained: what a search can still be expected to."""
LEAST = 1e-4
"""Part of the residuals' size that is white at least: without any the covariance of slip has no inverse."""


class Sample(NamedTuple):
    """Some windows and some of their numbers (windows, n). basis (windows, n, m): directions of these that no start
    state moves; along them the residuals (windows, m), what the camera's two variances multiply and what is unseen
    (windows, m, m). squares (2,): mean squares of the residuals in position and heading; least (2,): those of a white
    error that no law falls below."""

    windows: Windows
    responses: Responses
    numbers: Any
    basis: Any
    residual: Any
    camera: list[Any]
    unseen: Any
    squares: Any
    least: Any


class Structure(NamedTuple):
    """Which parts a law has: correlation times of slip and of the camera, None without; what each variance multiplies
    (windows, m, m), over its mean `units` (variances,) on the diagonal."""

    slip_time: float | None
    coloured_time: float | None
    parts: list[Any]
    units: Any


class Amounts(NamedTuple):
    """The mean square that each variance gives: of the white camera (2,), slip (2,), the camera's memory (2,) and
    slides sideways (1,). So told, they are alike for all correlation times."""

    camera: Any
    slip: Any = ()
    memory: Any = ()
    sideways: Any = ()


class Sized(NamedTuple):
    """A law, the restricted log-likelihood of the windows it was sized on, and the amounts of its parts."""

    law: Law
    log_likelihood: float
    amounts: Amounts


def sample(residual: Array, starts: Array, windows: Windows, responses: Responses) -> Sample:
    """What sizes the noise, of residuals (windows, numbers) and derivatives by start states (windows, numbers, 5)."""
    count = len(windows.run)
    chosen = np.unique(np.linspace(0, count - 1, min(SAMPLE, count)).round().astype(int))
    own = take(windows, chosen)
    part = Responses(*(leaf[chosen] for leaf in responses))
    length = len(own.seen)
    rows = _rows_seen(np.asarray(own.seen), len(range(0, length, max(1, length // ROWS))))
    numbers = (3 * rows[:, :, None] + np.arange(3)).reshape(len(rows), -1)
    moves, left = numbers_of(starts[chosen], numbers), numbers_of(residual[chosen], numbers)
    length = np.linalg.norm(moves, axis=1, keepdims=True)
    moves = moves / np.where(length > 0.0, length, 1.0)  # a window without any pose among these numbers
    basis = np.linalg.qr(moves, mode="complete")[0][:, :, moves.shape[2] :]
    squares = np.array([np.mean(left[of] ** 2) for of in (numbers % 3 < 2, numbers % 3 == 2)])
    camera = [_along(each, basis) for each in camera_parts(own, numbers)]
    freed = (basis.transpose(0, 2, 1) @ left[..., None])[..., 0]
    least = np.maximum(LEAST**2 * squares, np.square(finest(windows)))
    alike = float(
        np.sqrt(np.prod(np.maximum(squares, least)))
    )  # beside a variance of 1 nothing small is left of others
    unseen = alike * _along(of_unseen(own, numbers), basis)
    return Sample(own, part, numbers, basis, freed, camera, unseen, squares, least)


def _along(part: Array, basis: Array) -> np.ndarray:
    """A part (windows, n, n) in the directions of a basis (windows, n, m)."""
    return basis.transpose(0, 2, 1) @ part @ basis


def _rows_seen(seen: Array, count: int) -> np.ndarray:
    """Rows (windows, count) spread over those that are seen (rows, windows) in each window; where these are too few,
    all of them and some others."""
    order = np.argsort(~seen.T, axis=1, kind="stable")
    found, place = seen.sum(axis=0)[:, None], np.arange(count)
    return np.sort(np.take_along_axis(order, np.where(found >= count, place * found // count, place), axis=1), axis=1)


def structure_of(
    given: Sample, slip_time: float | None, coloured_time: float | None, sideways: bool = False
) -> Structure:
    """The parts of laws with these memories; sideways: with slides of slip's memory as well."""
    parts, back = list(given.camera), given.basis.transpose(0, 2, 1)
    if slip_time is not None:
        parts += _slip(given, slip_time, given.responses[:2])
    if coloured_time is not None:
        parts += [back @ each @ given.basis for each in memory_parts(coloured_time, given.windows, given.numbers)]
    if sideways and slip_time is not None:
        parts += _slip(given, slip_time, (given.responses.left,))
    means = [float(np.mean(np.diagonal(part, axis1=1, axis2=2))) for part in parts]
    units = np.maximum(means, 1e-300)
    return Structure(slip_time, coloured_time, [part / unit for part, unit in zip(parts, units, strict=True)], units)


def _slip(given: Sample, slip_time: float, answers: Sequence[Array]) -> list[np.ndarray]:
    back = given.basis.transpose(0, 2, 1)
    return slip_parts([back @ answers_of(each, given.windows, given.numbers) for each in answers], slip_time,
                      given.windows)  # fmt: skip


def amounts_of(law: Law, structure: Structure) -> Amounts:
    """The amounts of a law of this structure."""
    return _told(variances_of(law) * structure.units[: len(variances_of(law))], structure)


def _told(amounts: Array, structure: Structure) -> Amounts:
    """Amounts in the order of the parts, by name."""
    slip = 2 + 2 * (structure.slip_time is not None)
    memory = slip + 2 * (structure.coloured_time is not None)
    return Amounts(amounts[:2], amounts[2:slip], amounts[slip:memory], amounts[memory:])


def likeliest(given: Sample, structure: Structure, begin: Amounts, rival: float = -np.inf) -> Sized:
    """The best variances of one structure, or poorer ones if it is far from beating a rival's log-likelihood. What
    `begin` lacks begins at as much as the camera gives."""
    kinds = (begin.camera, begin.slip, begin.memory, begin.sideways)
    wanted = (2, 2 * (structure.slip_time is not None), 2 * (structure.coloured_time is not None))
    counts = (*wanted, len(structure.parts) - sum(wanted))
    amounts = np.concatenate([
        np.full(count, np.mean(begin.camera)) if len(kind) < count else np.asarray(kind)[:count]
        for kind, count in zip(kinds, counts, strict=True)
    ])  # fmt: skip
    least = np.zeros(len(amounts))
    least[:2] = given.least * structure.units[:2]
    found, value = _search(given, structure.parts, np.maximum(amounts, np.maximum(least, 1e-300)), least, rival)
    sd = np.sqrt(found / structure.units).tolist()
    slip = (sd[2], sd[3]) if structure.slip_time is not None else None
    first = sum(wanted) - 2
    coloured = (sd[first], sd[first + 1]) if structure.coloured_time is not None else None
    law = Law(sd[0], sd[1], slip, structure.slip_time, coloured, structure.coloured_time)
    return Sized(law, value, _told(found, structure))


def _search(given: Sample, parts, begin: Array, least: Array, rival: float) -> tuple[np.ndarray, float]:
    """Amounts of the highest restricted likelihood, none below `least` (variances,), and that likelihood; without hope
    against a rival it stops."""
    damping, best, value, slope, curve = 1e-3, begin, -np.inf, None, None
    proposed = begin
    for _ in range(MOST_STEPS):
        found = likelihood(given, parts, proposed)
        gained = found[0] - value
        if gained >= 0.0 or slope is None:
            best, (value, slope, curve), damping = proposed, found, 0.3 * damping
            if 0.0 <= gained < 0.02 or value + HOPE * gained < rival:
                break
        else:
            damping = max(10.0 * damping, 0.1)
        # in logarithms of the amounts
        gradient, matrix = best * slope, best[:, None] * curve * best
        matrix = matrix + (damping + 1e-9) * np.diag(np.diagonal(matrix) + 1e-3)
        proposed = np.maximum(best * np.exp(np.clip(np.linalg.solve(matrix, gradient), -3.0, 3.0)), least)
    return best, float(value)


def likelihood(given: Sample, parts: Sequence[Array], amounts: Array) -> tuple[float, np.ndarray, np.ndarray]:
    """Restricted log-likelihood, its gradient (variances,) and average information (variances, variances)."""
    values, inverse, taken = _weigh(given, parts, amounts)
    moved = np.stack([(part @ taken[..., None])[..., 0] for part in parts])
    back = (inverse @ np.moveaxis(moved, 0, -1)).transpose(2, 0, 1)
    trace = np.array([np.vdot(inverse, part) for part in parts])
    slope = 0.5 * (np.einsum("iwa,wa->i", moved, taken) - trace)
    return float(values.sum()), slope, 0.5 * np.einsum("iwa,jwa->ij", moved, back)


def by_window(given: Sample, law: Law) -> np.ndarray:
    """Restricted log-likelihood (windows,) of each window under a law."""
    structure = structure_of(given, law.slip_time, law.coloured_time)
    return _weigh(given, structure.parts, variances_of(law) * structure.units)[0]


def _weigh(given: Sample, parts: Sequence[Array], amounts: Array) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Restricted log-likelihood (windows,), inverse covariance (windows, m, m), and it times the residual."""
    total = np.array(given.unseen)
    for amount, part in zip(amounts, parts, strict=True):
        total += amount * part
    inverse, determinant = _inverse_of(total)
    taken = (inverse @ given.residual[..., None])[..., 0]
    return -0.5 * (determinant + np.sum(given.residual * taken, axis=1)), inverse, taken


def _inverse_of(total: Array) -> tuple[np.ndarray, np.ndarray]:
    """Inverses (windows, m, m) of covariances and the logarithms of their determinants (windows,)."""
    try:
        lower = np.linalg.cholesky(total)
    except np.linalg.LinAlgError:  # rounding has made one of them indefinite, or it is not finite
        return np.linalg.inv(total), np.linalg.slogdet(total)[1]
    factor = inverse_of_lower(lower)
    diagonal = np.diagonal(lower, axis1=1, axis2=2)
    return factor.transpose(0, 2, 1) @ factor, 2.0 * np.sum(np.log(diagonal), axis=1)

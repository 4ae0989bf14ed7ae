"""What comes once per turn of something on a wheel: its period, where the wheel is, and its angle when a run begins.

A pattern exp(i (k way + q turn)) is held against what the poses ask to be added to a wheel's push. Each window gives
one complex number, and these are added up over a part of a run at the angles that its windows begin at, for many k
[rad/m] and q [rad/rad]: a periodogram (Lomb 1976, Astrophysics and Space Science 39) over the way of a wheel in place
of time. Of noise, the square of such a sum over the sum of squares is an exponential variable of mean 1; from this
follows what the best of so many patterns brings by chance.
"""

from typing import NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.fit.refit import Data, Solution
from jaxident.diagnosis.laws.candidates import Path, Turning, answers_of
from jaxident.diagnosis.laws.kinds import Kind
from jaxident.diagnosis.motion.linear import without_starts
from jaxident.diagnosis.motion.responses import Responses
from jaxident.effects.law_kinds import ANGLE, PUSHES, ROLLINGS
from jaxident.parallel import in_parallel

SLOWEST, FASTEST = 0.7, np.pi
"""Turn of a pattern at the wheel's mean speed: at least in a second [rad], at most from row to row [rad]. From 2 rad in
a second on, what comes once in 0.5 m was not found on a slow robot; no others were tried."""
PLACES = (0.3, 1.2)
"""Half track over what gains and rates say: less than one where wheels slide in turns. No others were tried."""
APART = 1.5
"""Angle [rad] that two neighbouring patterns are apart at the end of a window, or of a part of a run. With 1 rad
as many weak patterns were found, 253 of 360 simulated ones; with 2 rad the weakest of them bring 0.9 less in
log-likelihood. With 0.7 the same was found on three robots."""
LONGEST = 32
"""Windows over which a pattern is added up: the angle is free again in the next ones. So a long log takes no more
patterns than a short one. No other number was tried."""
NARROW = 4.0
"""Steps go by how far nine windows of ten go. If one goes more than NARROW times as far, they go by a part of that: a
robot that mostly stands would ask for thousands of patterns. No other was tried."""
ZOOMS, AROUND = 5, np.linspace(-1.0, 1.0, 5)
"""Times that the search looks closer, and where then, in steps of the grid before; the next grid is half as wide. From
-2 to 2 steps the same was found on 180 simulated logs. Four times left the period of a loud pattern off by 0.3 %, five
by 0.001 %."""


class _Seen(NamedTuple):
    """Of the kinds of laws of one wheel: products of white answers of the poses to a unit in each row (kinds, windows,
    rows, rows), and their products with what is to be explained, which the poses ask for in each row (kinds, windows,
    rows); way and turn since the window's first row (windows, rows), and those of this row in its run (windows,); the
    windows of each part of a run."""

    products: Array
    asked: Array
    way: Array
    turn: Array
    gone: Array
    turned: Array
    parts: list[Array]


Found = list[tuple[Kind, Turning]]
"""Kinds of laws, and what each goes by."""
VARIES = {"1": "push", "own push": "gain", "own speed": "radius"}
"""What varies as a wheel turns, by what a law's curve is multiplied with."""


def in_words(kind: Kind, turning: Turning) -> str:
    """What of which wheel varies, and how often."""
    return f"{VARIES[kind.times]} {kind.acts_on.partition(' ')[2]}, once every {turning.period:.3f} m"


def turnings(data: Data, fit: Solution, base: Array, path: Path, responses: Responses) -> Found:
    """For each wheel and each kind of law that goes by its angle the pattern that the poses ask for most, none where a
    robot runs away; base (windows, numbers, n): whitened columns of a fit free of start states, the residual last."""
    sought: list[tuple[list[Kind], _Seen, float, float]] = []
    if not all(np.isfinite(part).all() for part in (path.way, path.turn, base)):
        return []
    residual = _left(base)
    for number, (push, roll) in enumerate(zip(PUSHES, ROLLINGS, strict=True)):
        along, heading = path.gain[:, number] / path.rates
        if along == 0.0 or heading == 0.0:
            continue  # a wheel that does nothing, of a robot that coasts
        half, side = abs(float(along / heading)), float(np.sign(along * heading))
        kinds = [Kind(push, "1", ANGLE), Kind(push, "own push", ANGLE), Kind(roll, "own speed", ANGLE)]
        # one after the other: memory that threads let go stays with the process, here 100 MB a search of 22,200 rows
        sought.append((kinds, _seen(data, fit, residual, path, responses, kinds), half, side))

    def strongest(kinds: list[Kind], seen: _Seen, half: float, side: float) -> Found:
        return list(zip(kinds, _strongest(seen, path, half, side), strict=True))

    return [pair for found in in_parallel(strongest, sought) for pair in found]


def _left(base: Array) -> np.ndarray:
    """What a fit leaves (windows, numbers): of its residual what its columns do not explain."""
    columns, residual = base[..., :-1].reshape(-1, base.shape[2] - 1), base[..., -1].ravel()
    length = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    size = np.linalg.lstsq(columns / length, residual, rcond=1e-10)[0]
    return (residual - columns / length @ size).reshape(base.shape[:2])


def _seen(data: Data, fit: Solution, residual: Array, path: Path, responses: Responses, kinds: list[Kind]) -> _Seen:
    """What the poses ask for in each row, of some kinds."""
    count, rows = path.way.shape
    unit = np.broadcast_to(np.eye(rows), (count, rows, rows))
    products, asked = np.empty((len(kinds), count, rows, rows)), np.empty((len(kinds), count, rows))
    for k, kind in enumerate(kinds):
        answers, _ = without_starts(data.whitener, answers_of(kind, unit, path, responses), fit.linear.starts)
        turned_over = answers.transpose(0, 2, 1)
        products[k], asked[k] = turned_over @ answers, (turned_over @ residual[..., None])[..., 0]
    gone, turned = path.way[:, 0], path.turn[:, 0]
    parts = parts_of(np.asarray(data.windows.run))
    return _Seen(products, asked, path.way - gone[:, None], path.turn - turned[:, None], gone, turned, parts)


def parts_of(run: Array) -> list[np.ndarray]:
    """The windows of each part of a run, LONGEST at most; run (windows,): of which run."""
    whole = [np.flatnonzero(run == number) for number in np.unique(run)]
    return [part for own in whole for part in np.array_split(own, int(np.ceil(len(own) / LONGEST)))]


def _strongest(seen: _Seen, path: Path, half: float, side: float) -> list[Turning]:
    """Of each kind the pattern of the largest sum over all parts of runs, of a wheel about `half` [m] from the middle
    on one side (1 right, -1 left)."""
    (k_step, more_k), (q_step, more_q) = (
        _steps(seen, *parts) for parts in ((seen.way, seen.gone), (seen.turn, seen.turned))
    )
    a_row = max(float(np.mean(np.abs(np.diff(seen.way + side * half * seen.turn, axis=1)))), 1e-9)
    k_all = np.arange(SLOWEST * float(np.median(path.step)) / a_row, FASTEST / a_row, k_step)
    q_all = np.arange(PLACES[0] * k_all[0] * half, PLACES[1] * k_all[-1] * half + q_step, q_step)
    waves = _waves(seen.turn, side * q_all)
    waves *= _waves(seen.turned, side * q_all)[:, None]
    finer = _waves(seen.gone, more_k), _waves(seen.turned, side * more_q)
    best, count = [(-1.0, 0.0, 0.0)] * len(seen.asked), 0.0
    for k in k_all:
        near = slice(*np.searchsorted(q_all, [PLACES[0] * k * half, PLACES[1] * k * half + q_step]))
        powers = _powers(seen, k, waves[..., near], *finer)
        count += powers[0].size * APART**2  # as many as there are 1 rad apart: `_closer` reaches those between
        for kind, power in enumerate(powers):
            i, j, m = np.unravel_index(power.argmax(), power.shape)
            there = float(power[i, j, m]), float(k + more_k[i]), float(side * (q_all[near][j] + more_q[m]))
            best[kind] = max(best[kind], there)
    steps, chance = (k_step / len(more_k), q_step / len(more_q)), _by_chance(seen.parts, count)
    closer = [_closer(seen, kind, *there[1:], *steps) for kind, there in enumerate(best)]
    return [
        Turning(2.0 * np.pi / k, q / k, phase, there[0], chance)
        for (k, q, phase), there in zip(closer, best, strict=True)
    ]


def _steps(seen: _Seen, since: Array, begun: Array) -> tuple[float, np.ndarray]:
    """Step from one rate to the next that tells patterns apart within windows, and rates between two of these that tell
    them apart within parts of runs; since (windows, rows) the first row of a window, begun (windows,) in its run."""
    each = np.ptp(since, axis=1)
    far = max(float(np.quantile(each, 0.9)), float(each.max()) / NARROW, 1e-6)
    wide = max(float(np.ptp(begun[own])) for own in seen.parts)
    count = int(np.ceil(wide / far)) + 1
    return APART / far, APART / far * ((np.arange(count) + 0.5) / count - 0.5)


def _waves(way: Array, rate: Array) -> np.ndarray:
    """exp(i rate way) (..., rates). Sines of single precision take an eighth of the time; at 10,000 rad they are off by
    0.001. Filled in place: on a long log these are the largest arrays."""
    angle = way.astype(np.float32)[..., None] * np.asarray(rate, np.float32)
    waves = np.empty(angle.shape, np.complex64)
    np.cos(angle, out=waves.real)
    np.sin(angle, out=waves.imag)
    return waves


def _powers(seen: _Seen, k: float, waves: Array, more_k: Array, more_q: Array) -> np.ndarray:
    """Power (kinds, more k, q, more q) of patterns at k and some q, waves (windows, rows, q), each moved by little,
    waves (windows, more) at the first row of each window."""
    asked = seen.asked * np.exp(1j * k * (seen.gone[:, None] + seen.way))
    each = asked.astype(np.complex64).transpose(1, 0, 2) @ waves
    moved = each[..., None] * more_q[:, None, None]
    total: Array = 0.0
    for own in seen.parts:
        whole = np.tensordot(more_k[own], moved[own], axes=(0, 0))
        squares = np.maximum(np.sum(np.abs(each[own]) ** 2, axis=0), 1e-30)
        total = total + (whole.real**2 + whole.imag**2) / squares[..., None]
    return total.swapaxes(0, 1)


def _closer(seen: _Seen, kind: int, k: float, q: float, k_step: float, q_step: float) -> tuple:
    """k, q and phases (windows,) of the pattern of a kind that explains most near some k and q."""
    for zoom in range(ZOOMS):
        k_near, q_near = np.meshgrid(k + 0.5**zoom * k_step * AROUND, q + 0.5**zoom * q_step * AROUND)
        gain = [_explained(seen, kind, *row)[0] for row in zip(k_near, q_near, strict=True)]  # all at once take memory
        best = np.unravel_index(np.argmax(gain), k_near.shape)
        k, q = k_near[best], q_near[best]
    phase = np.zeros(len(seen.gone))
    for own, angle in zip(seen.parts, _explained(seen, kind, np.array([k]), np.array([q]))[1][:, 0], strict=True):
        phase[own] = angle
    return k, q, phase


def _explained(seen: _Seen, kind: int, k: Array, q: Array) -> tuple[np.ndarray, np.ndarray]:
    """Half the squares that patterns k (n,), q (n,) of a kind, of any size and phase in each part of a run, explain
    (n,), and these phases (parts, n)."""
    angle = (seen.gone[:, None] + seen.way)[..., None] * k + (seen.turned[:, None] + seen.turn)[..., None] * q
    cosine, sine = (wave(angle.astype(np.float32)).astype(float) for wave in (np.cos, np.sin))  # as in `_waves`
    products, asked = seen.products[kind], seen.asked[kind][..., None]
    to_cosine, to_sine = products @ cosine, products @ sine
    pairs = (cosine, to_cosine), (sine, to_sine), (cosine, to_sine), (cosine, asked), (sine, asked)
    each = [np.sum(one * other, axis=1) for one, other in pairs]
    cc, ss, cs, c, s = np.array([[part[own].sum(axis=0) for own in seen.parts] for part in each])
    volume = np.maximum(cc * ss - cs**2, 1e-12 * cc * ss + 1e-300)
    a, b = (ss * c - cs * s) / volume, (cc * s - cs * c) / volume
    return 0.5 * np.sum(a * c + b * s, axis=0), np.arctan2(-b, a)


def _by_chance(parts: list[Array], count: float) -> float:
    """What the best of `count` patterns brings by chance: the sum of an exponential variable for each part of a run
    that one of so many exceeds. A part of one window brings 1, whatever the pattern."""
    alone, several = (sum(len(own) == 1 for own in parts), sum(len(own) > 1 for own in parts))
    tried = np.linspace(0.0, 40.0 + 4.0 * several, 4001)[1:]
    return alone + float(tried[np.argmax(_exceeded(tried, max(several, 1)) * count < 1.0)])


def _exceeded(sums: Array, count: int) -> np.ndarray:
    """Probabilities (n,) that `count` exponential variables of mean 1 have more than some sums (n,) above 0."""
    fewer = np.arange(count)
    factorials = np.cumsum(np.log(np.maximum(fewer, 1)))
    return np.sum(np.exp(fewer * np.log(sums)[:, None] - factorials - sums[:, None]), axis=1)

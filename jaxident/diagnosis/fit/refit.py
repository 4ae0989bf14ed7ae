"""The best fit of the nominal robot with some effects, start states free: Levenberg-Marquardt on whitened windows."""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.fit.prior import GAINS, as_held, as_uncertain_as_prior, unlikeliness, with_prior
from jaxident.diagnosis.motion.linear import Linear, follow, gram, linearise, normal
from jaxident.diagnosis.motion.rims import Rims, rim_speeds
from jaxident.diagnosis.motion.windows import Windows
from jaxident.effects.coordinates import (
    INSTANTS,
    NOMINAL,
    PLACES,
    STEPPED,
    free_places,
    limits,
    natural,
    neutral_vector,
    sizes,
)
from jaxident.effects.effect import EDGE

MOST_STEPS = 20
"""Of one refit; what fits arrives in two to nine, what crawls is mostly an effect that is not there."""
ENOUGH = 0.05
"""Promised fall of -log p, by coordinates and start states, below which the search ends."""
LONGEST = 0.5
"""A step changes a rate by at most this much, as a logarithm."""
LONGEST_GAIN = 1.0
"""A step changes a gain by at most this many times both gains of its channel. The prior of the gains is an angle. Where
the runs tell nothing of a wheel, a free step would overshoot by up to pi/2 times the gains, and the next by more: the
gain of a wheel that hardly ever passed its dead zone went to -4e25. One time the gains brings both wheels back."""
WIDE = 10.0
"""Deviation of a coordinate of which the runs say nothing, in its typical sizes. No other value was tried."""
_INSTANTS = [PLACES[pair] for pair in sorted(INSTANTS)]
COUPLING = [NOMINAL.index("coupling_1"), NOMINAL.index("coupling_2")]
PARTS = (1.0, 0.25, 0.0)
"""Of the step of a window's start state that are tried."""


class Data(NamedTuple):
    """Windows and the whitener of their noise (windows, numbers, numbers); rims: wheel speeds, None without."""

    windows: Windows
    whitener: Any
    rims: Rims | None = None

    def of_rims(self, rims: Linear | None, *columns: Array, residual: bool = False) -> np.ndarray | None:
        """White rows (windows, rows, n + 5) of some columns of rim speeds, of the residual and of the start states."""
        if self.rims is None or rims is None:
            return None
        own = [self.rims.white(each) for each in columns]
        own += [self.rims.whitener @ self.rims.residual(rims.residual)[..., None]] if residual else []
        return np.concatenate([*own, self.rims.white(rims.starts)], axis=2)


class Solution(NamedTuple):
    """A fit: vector (SIZE,), starts (5, windows), the linearisation there in `places`, half the squares, the prior's
    among them, and the covariance of the free coordinates."""

    vector: Any
    starts: Any
    places: list
    linear: Linear
    cost: float
    covariance: Any
    steps: int


def refit(data: Data, vector: Array, starts: Array, effects: tuple[str, ...], hold: tuple = (), most=MOST_STEPS):
    """The fit nearest downhill of a vector and starts with the coordinates of `effects` free, but those in `hold`.
    Where the robot would run away there, effects begin at neutral, or couplings too."""
    held = {PLACES[pair] for pair in {*hold, *STEPPED}}
    places = [place for place in free_places(effects) if place not in held]
    vector, starts = np.array(vector), np.array(starts)
    low, high = (bound[places] for bound in bounds(data.windows))
    vector[places] = np.clip(vector[places], low, high)
    for begin in (vector, *_calmer(vector)):
        linear, products, solve = _around(data, begin, starts, places)
        if np.all(np.isfinite(products)):
            break
    vector = begin
    cost, damping = 0.5 * products[-1, -1] + _taken(data, linear), 1e-4
    for step_number in range(1, most + 1):
        step, promised = _step(products, vector[places], low, high, damping)
        by_starts = cost - 0.5 * products[-1, -1]
        if promised + by_starts < ENOUGH and step_number > 1:
            break
        new_vector = vector.copy()
        new_vector[places] = np.clip(vector[places] + step, low, high)
        step = new_vector[places] - vector[places]
        moved = solve[:, :, -1] - solve[:, :, :-1] @ step
        new_starts, new_cost = best_starts(data, new_vector, starts, moved.T)
        new_cost += unlikeliness(new_vector, data.windows)
        taken = new_cost < cost and not (speeds_up(new_vector) and not speeds_up(vector))
        there = _around(data, new_vector, new_starts, places) if taken else None
        if there is not None and np.all(np.isfinite(there[1])):  # beside a robot that runs away nothing can be told
            gained, damping = cost - new_cost, max(0.2 * damping, 1e-7)
            vector, starts, cost = new_vector, new_starts, new_cost
            linear, products, solve = there
            if gained < ENOUGH:
                break
        else:
            damping *= 10.0
            if damping > 1e6:
                break
    vector = as_held(vector, data.windows)
    return Solution(vector, starts, places, linear, cost, covariance_from(products, places, data.windows), step_number)


def speeds_up(vector: Array) -> bool:
    """Whether the robot of a vector (SIZE,) speeds up by itself, without a command: its coupling outdoes its rates. On
    three runs of a Husky's log a fit ended at such a one."""
    one, other = natural(vector)[COUPLING]
    return bool(one * other > np.exp(vector[0] + vector[1]))


def _calmer(vector: Array) -> tuple[np.ndarray, np.ndarray]:
    """Vectors for a robot that runs away with this one: without effects, whose sizes may be another robot's; and also
    without coupling, where both speeds settle by themselves."""
    plain = neutral_vector(vector[: len(NOMINAL)])
    calm = plain.copy()
    calm[COUPLING] = 0.0
    return plain, calm


def bounds(windows: Windows) -> tuple[np.ndarray, np.ndarray]:
    """The lowest and highest vector (SIZE,) of a search on some windows."""
    low, high = limits()
    session = float(windows.session[-1] + windows.t[-1, -1])
    low[_INSTANTS], high[_INSTANTS] = EDGE * session, (1.0 - EDGE) * session
    return low, high


def _around(data: Data, vector: Array, starts: Array, places: list[int]) -> tuple[Linear, np.ndarray, np.ndarray]:
    """The linearisation there; summed products (n, n) with the prior's, the residual last; and what start states take
    in every window (windows, 5, n)."""
    linear = linearise(vector, starts, data.windows, places)
    columns = np.concatenate([linear.slopes, linear.residual[..., None]], axis=2)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # a robot may run away
        more = None if linear.rims is None else data.of_rims(linear.rims, linear.rims.slopes, residual=True)
        found = gram(data.whitener, columns, linear.starts, more)
    return linear, with_prior(found.products.sum(axis=0), vector, data.windows), found.solve


def best_starts(data: Data, vector: Array, starts: Array, moved: Array) -> tuple[np.ndarray, float]:
    """Starts (5, windows) moved in every window by the part of what is asked for (5, windows) that fits best, and half
    the squares: one window that shows little of its start must not stop the others."""
    lanes = starts + np.array(PARTS)[:, None, None] * moved
    found = follow(np.tile(vector, (len(lanes), 1)), lanes, data.windows)
    residual = np.ascontiguousarray(np.moveaxis(found, 0, -1))  # the whitener is read once for all of them
    with np.errstate(over="ignore", invalid="ignore"):  # a start may run away
        squares = 0.5 * np.sum((data.whitener @ residual) ** 2, axis=1).T
        if data.rims is not None:
            lots = np.tile(vector, (len(lanes), 1))
            squares = squares + data.rims.squares(rim_speeds(lots, lanes, data.windows))
    squares = np.where(np.isnan(squares), np.inf, squares)
    best = np.argmin(squares, axis=0)
    chosen = np.take_along_axis(lanes, best[None, None], axis=0)[0]
    return chosen, float(np.sum(squares.min(axis=0)))


def _taken(data: Data, linear: Linear) -> float:
    """What start states would still take of the squares."""
    residual = linear.residual
    whole = 0.5 * float(np.sum((data.whitener @ residual[..., None]) ** 2))
    if data.rims is not None:
        whole += float(np.sum(data.rims.squares(linear.rims.residual)))
    rest = gram(data.whitener, residual[..., None], linear.starts, data.of_rims(linear.rims, residual=True))
    return whole - 0.5 * float(np.sum(rest.products))


def _step(products: Array, now: Array, low: Array, high: Array, damping: float) -> tuple[np.ndarray, float]:
    """The damped step within the bounds, and the fall it promises; coordinates that a bound stops are held."""
    free = list(range(len(now)))
    step = np.zeros(len(now))
    for _ in range(4):
        if not free:
            break
        own, cross, scale = normal(products, free)
        step[:] = 0.0
        step[free] = np.linalg.solve(own + damping * np.eye(len(free)), cross) / scale
        out = ((now <= low) & (step < 0.0)) | ((now >= high) & (step > 0.0))
        if not out.any():
            break
        free = [k for k in free if not out[k]]
    longest = np.max(np.abs(step[:2])) if len(step) > 1 else 0.0
    if longest > LONGEST:
        step = step * LONGEST / longest
    for pair in map(list, GAINS):
        largest = LONGEST_GAIN * np.hypot(*now[pair])
        step[pair] = np.clip(step[pair], -largest, largest)
    step = np.clip(now + step, low, high) - now
    return step, float(step @ products[:-1, -1] - 0.5 * step @ products[:-1, :-1] @ step)


def covariance_from(products: Array, places: list[int], windows: Windows) -> np.ndarray:
    """Covariance of the free coordinates in `places`, and of what products (n, n) have behind them. No coordinate is
    less certain than WIDE of its sizes: what the runs say nothing of would else have a deviation of 1e90, and a
    prediction with it. Rates that are held are as uncertain as robots' rates are."""
    whole, own = np.array(products[:-1, :-1]), np.arange(len(places))
    whole[own, own] += (WIDE * sizes()[places]) ** -2.0
    scale = np.sqrt(np.diagonal(whole))
    values, vectors = np.linalg.eigh(whole / scale[:, None] / scale)
    rows = vectors / np.sqrt(np.maximum(values, 1e-12))
    return as_uncertain_as_prior(rows @ rows.T / scale[:, None] / scale, windows)

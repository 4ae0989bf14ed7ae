"""How the poses of all windows answer to every effect, linear about one fit: the table of a search.

An effect takes part by one of its options: by the slopes of its coordinates; or, where it has no derivative at neutral
or another form of itself, by the difference that a point of a grid makes. Start states of windows have flat priors,
the nominal parameters that of `alike`; both are eliminated. What is regular and in no catalogue is first freed of all
that the catalogue can do (orthogonal discrepancy: Plumlee 2017, J. Amer. Statist. Assoc. 112). Then it is taken away.
So it never competes with a name, and what it leaves says how windows agree on a name.
"""

from collections.abc import Collection
from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.causes.points import differences, points_of, rim_differences, seeded
from jaxident.diagnosis.fit.prior import with_prior
from jaxident.diagnosis.fit.refit import Data, Solution
from jaxident.diagnosis.motion.linear import Linear, gram, linearise, normal
from jaxident.effects.coordinates import (
    COORDINATES,
    NOMINAL,
    PLACES,
    SHAPES,
    SILENT,
    SMOOTH,
    STEPPED,
    limits,
    neutral_vector,
    sizes,
)

AMPLITUDE = 1.5
"""Prior standard deviation of the multiple of a grid's point that an effect is. Grids have steps of a factor of two or
less. No other value was tried."""
FAR = 1e4
"""Answer in poses [m, rad] to one prior deviation from which on a robot runs away. Windows last seconds; beside the
mass offset of one Create, other effects answered with 1e10 to 1e125."""
SAME = 1e-6
"""Part of a term's squares below which it is a copy of other columns."""
NEUTRAL = neutral_vector(np.zeros(len(NOMINAL)))
LOW, _ = limits()


class Option(NamedTuple):
    """One way in which an effect takes part: its columns in the table; the point of a grid, coordinates, at which a
    refit begins, None where it begins at neutral or goes on; and the price of having looked at so many points."""

    effect: str
    columns: tuple[int, ...]
    point: dict[str, float] | None
    price: float


class Table(NamedTuple):
    """options; here: place of the option of each effect that the fit has. products (windows, n, n) and cross
    (windows, n): whitened products of columns among each other, and with the residual of a robot without effects;
    whole (n, n) and right (n,): their sums over windows. scale (n,): prior standard deviation of what a column is
    multiplied with, which is zero without the effect; positive (n,): whether it is above zero."""

    options: list[Option]
    here: dict[str, int]
    products: Any
    cross: Any
    whole: Any
    right: Any
    scale: Any
    positive: Any

    def effects(self, chosen: Collection[int]) -> tuple[str, ...]:
        """Names of some options."""
        return tuple(self.options[k].effect for k in chosen)


class _Column(NamedTuple):
    """A slope by the coordinate at `place`, or `sign` times the difference that `vector` makes; `value`: how many times
    the fit has it."""

    scale: float
    positive: bool
    value: float = 0.0
    place: int | None = None
    vector: Any = None
    sign: float = 1.0


class Answers(NamedTuple):
    """What a table about a fit is made from: options and their columns, the answers (windows, numbers, columns) of the
    poses to these, the linearisation about the fit, and the answers of the rims, None without wheel speeds."""

    options: list[Option]
    columns: list[_Column]
    poses: Any
    linear: Linear
    rims: Any = None


def answers_of(data: Data, fit: Solution, active: Collection[str]) -> Answers:
    """The answers about a fit that has some effects: they take most of a table's time."""
    options: list[Option] = []
    columns: list[_Column] = []
    for name in COORDINATES:
        for point, price, own in _ways(data, fit, name, name in active):
            options.append(Option(name, tuple(range(len(columns), len(columns) + len(own))), point, price))
            columns += own
    places = [column.place for column in columns if column.place is not None]
    vectors = [column.vector for column in columns if column.place is None]
    linear = linearise(fit.vector, fit.starts, data.windows, [*range(len(NOMINAL)), *places])
    poses = _in_order(columns, linear.slopes, differences(data, fit, vectors))
    rims = None
    if data.rims is not None:
        rims = _in_order(columns, linear.rims.slopes, rim_differences(data, fit, vectors))
    return Answers(options, columns, poses, linear, rims)


def tabulate(
    data: Data,
    fit: Solution,
    active: Collection[str],
    rest: Array | None = None,
    free: bool = False,
    owners: Collection[str] = (),
    answers: Answers | None = None,
) -> Table:
    """The table about a fit that has some effects. rest (windows, numbers, terms): answers of the poses to what is in
    no catalogue, taken away; or free like nominal parameters, so that it may stand in for effects, but not for the
    `owners` among them, to which counts what both can do. answers: those about this fit, if they are known."""
    options, columns, poses, linear, rims = answers_of(data, fit, active) if answers is None else answers
    here = {option.effect: k for k, option in enumerate(options) if option.effect in active}
    more = np.zeros((*linear.residual.shape, 0)) if rest is None else rest
    base = np.concatenate([linear.slopes[..., : len(NOMINAL)], more], axis=2)
    whole = np.concatenate([base, poses, linear.residual[..., None]], axis=2)
    products = gram(data.whitener, whole, linear.starts, _rim_rows(data, linear.rims, rims, more.shape[2])).products
    owned = [base.shape[2] + column for name in owners for column in options[here[name]].columns]
    products = _less_owned(products, range(len(NOMINAL), base.shape[2]), owned)
    cross = products[:, :-1, -1] + products[:, :-1, base.shape[2] : -1] @ [column.value for column in columns]
    scale = np.array([column.scale for column in columns])
    products, cross = _eliminated(data, fit, products[:, :-1, :-1], cross, base.shape[2] if free else len(NOMINAL))
    if not free:
        products, cross = _without_rest(products, cross, scale)
    positive = np.array([column.positive for column in columns])
    return Table(options, here, products, cross, products.sum(axis=0), cross.sum(axis=0), scale, positive)


def _less_owned(products: Array, terms: range, owned: list[int]) -> np.ndarray:
    """Products (windows, n, n) with terms replaced by what nominal parameters and some columns leave of them."""
    if not terms or not owned:
        return products
    known, whole = [*range(len(NOMINAL)), *owned], products.sum(axis=0)
    turn = np.eye(len(whole))
    for term in terms:
        own, cross, length = normal(whole[np.ix_([*known, term], [*known, term])], list(range(len(known))))
        turn[term, known] = -np.linalg.solve(own, cross) / length
        if turn[term] @ whole @ turn[term] < SAME * whole[term, term]:
            turn[term] = 0.0  # what rounding leaves of it would be that very effect again
    return turn @ products @ turn.T


def _ways(data: Data, fit: Solution, name: str, active: bool) -> list[tuple[Any, float, list[_Column]]]:
    """Ways in which an effect may take part: point, price and columns of each."""
    if active:
        return [(None, 0.0, _stands(fit, name))]
    ways: list[tuple[Any, float, list[_Column]]] = []
    if name in SMOOTH:
        ways.append((None, 0.0, [_slope(PLACES[pair]) for pair in _pairs(name) if pair not in SILENT]))
    points = [point for point in points_of(name, data, fit) if point]
    first = COORDINATES[name][0]
    signed = first.low < first.neutral < first.high
    for point in points:
        scale = first.size / abs(point[first.name]) if signed else AMPLITUDE
        column = _Column(scale, not signed, vector=seeded(fit.vector, name, point))
        ways.append((point, float(np.log(len(points))), [column]))
    return ways


def _stands(fit: Solution, name: str) -> list[_Column]:
    """Columns of an effect that the fit has; without a derivative at neutral all that the effect does is one."""
    if name not in SMOOTH:
        vector = np.array(fit.vector)
        own = [PLACES[pair] for pair in _pairs(name)]
        vector[own] = NEUTRAL[own]
        return [_Column(AMPLITUDE, True, 1.0, vector=vector, sign=-1.0)]
    free = [pair for pair in _pairs(name) if pair not in STEPPED and PLACES[pair] in fit.places]
    return [_slope(PLACES[pair], fit, pair in SHAPES) for pair in free]


def _slope(place: int, fit: Solution | None = None, shape: bool = False) -> _Column:
    """The slope by a coordinate; what only shapes an effect has a prior about where the fit has it."""
    value = 0.0 if fit is None or shape else float(fit.vector[place] - NEUTRAL[place])
    return _Column(float(sizes()[place]), LOW[place] == NEUTRAL[place] and not shape, value, place=place)


def _pairs(name: str) -> list[tuple[str, str]]:
    return [(name, coordinate.name) for coordinate in COORDINATES[name]]


def _in_order(columns: list[_Column], slopes: Array, differences: Array) -> np.ndarray:
    """Answers (windows, numbers, columns): slopes, those of the nominal parameters first, and differences in the order
    of the columns. A robot that runs away answers nothing."""
    slope, jump = iter(np.moveaxis(slopes[..., len(NOMINAL) :], -1, 0)), iter(np.moveaxis(differences, -1, 0))
    answers = np.stack([c.sign * next(jump if c.place is None else slope) for c in columns], axis=-1)
    with np.errstate(over="ignore", invalid="ignore"):
        largest = np.max(np.abs(answers), axis=(0, 1), initial=0.0) * [column.scale for column in columns]
    return np.where(largest < FAR, answers, 0.0)


def _rim_rows(data: Data, own: Linear | None, answers: Array | None, rest: int) -> np.ndarray | None:
    """White rows of the rims for the columns of a table; what is in no catalogue, `rest` columns, moves no rim, as
    random slip does not."""
    if own is None or answers is None:
        return None
    none = np.zeros((*own.residual.shape, rest))
    return data.of_rims(own, own.slopes[..., : len(NOMINAL)], none, answers, residual=True)


def _eliminated(data: Data, fit: Solution, products: Array, cross: Array, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Products and cross products of the later columns, the first `count` free but for the nominal robot's prior."""
    summed = np.zeros((len(products[0]) + 1, len(products[0]) + 1))
    summed[:-1, :-1], summed[:-1, -1] = products.sum(axis=0), cross.sum(axis=0)
    summed = with_prior(summed, fit.vector, data.windows)
    whole, right = summed[:-1, :-1], summed[:-1, -1]
    squares = np.diagonal(whole)[:count]
    length = np.sqrt(np.where(squares > 1e-200, squares, 1.0))  # a column that answers nothing takes nothing
    own = whole[:count, :count] / length[:, None] / length + 1e-10 * np.eye(count)
    inverse = np.linalg.inv(own) / length[:, None] / length
    turn = np.concatenate([-whole[count:, :count] @ inverse, np.eye(len(whole) - count)], axis=1)
    left = cross - products[:, :, :count] @ (inverse @ right[:count])
    return turn @ products @ turn.T, left @ turn.T


def _without_rest(products: Array, cross: Array, scale: Array) -> tuple[np.ndarray, np.ndarray]:
    """The catalogue's columns, the last ones, alone; and their products with what the terms before them leave of the
    residual once these are freed of all that the catalogue's can do under their priors."""
    terms = products.shape[1] - len(scale)
    if terms:
        whole = products.sum(axis=0)
        shared = np.linalg.solve(whole[terms:, terms:] + np.diag(scale**-2.0), whole[terms:, :terms])
        turn = np.concatenate([np.eye(terms), -shared.T], axis=1)
        # a term that the catalogue can do as well is left nothing, and has no size
        own = turn @ whole @ turn.T + 1e-3 * np.diag(np.diagonal(whole)[:terms] + 1e-300)
        cross = cross - products @ (turn.T @ np.linalg.solve(own, turn @ cross.sum(axis=0)))
    return products[:, terms:, terms:], cross[:, terms:]

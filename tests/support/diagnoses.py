"""A diagnosis made up by hand for each verdict: what pages and files are tried with, at no cost."""

from typing import Any

import numpy as np
from support.tables import table_of

from jaxident.diagnosis.account.account import account_of
from jaxident.diagnosis.account.discovered import Shown
from jaxident.diagnosis.account.floor import Floor
from jaxident.diagnosis.account.measure import Gap
from jaxident.diagnosis.account.shrink import Shrink
from jaxident.diagnosis.account.where import Place, Region
from jaxident.diagnosis.causes.discrepancy import Rest
from jaxident.diagnosis.causes.discrepancy_basis import Term
from jaxident.diagnosis.causes.finding import Finding, Values
from jaxident.diagnosis.decide import Parameter
from jaxident.diagnosis.detectability import Replay
from jaxident.diagnosis.diagnose import Diagnosis
from jaxident.diagnosis.discovery.forms import Form
from jaxident.diagnosis.fit.refit import Solution
from jaxident.diagnosis.laws.kinds import Kind
from jaxident.diagnosis.noise.law import Law
from jaxident.diagnosis.posterior import Cause, Judgement
from jaxident.diagnosis.preparation.pose_screening import Frames
from jaxident.diagnosis.preparation.prepare import Prepared
from jaxident.effects.catalogue import SITES
from jaxident.effects.coordinates import COORDINATES, NOMINAL, free_places, neutral_vector
from jaxident.estimation.ahead.stretches import Starts
from jaxident.log import Log
from jaxident.robot.drive import Physical
from jaxident.robot.model import Discovered, Effect, Model

VERDICTS = ("no_gap", "parameters", "effects", "partly", "unknown", "undecided")
LARGEST = 2.0
COUNT, ROWS = 30, 30
"""Starts, and rows of the horizon."""
_LAW = Law(1e-3, 5e-3)
UNIT = np.array([1e-3, 1e-3, 5e-3]) ** 2
REPLAY = Replay(("slope", "motor_lag"), np.array([[0.99, 0.01, 0.0], [0.02, 0.98, 0.0], [0.3, 0.0, 0.7]]))
_NOTHING: Any = None
"""Stands for parts of a search that no page shows."""


def made_up(verdict: str, *, given: bool = False) -> Diagnosis:
    """A diagnosis of 30 starts with some verdict; `given`: of a nominal model that the user gave."""
    gap = verdict in ("effects", "partly", "unknown")
    given = given or verdict == "parameters"
    selected = {"effects": ("transport_delay", "quadratic_drag"), "partly": ("quadratic_drag",)}.get(verdict, ())
    after = {"effects": 1.2, "partly": 25.0, "unknown": 40.0}.get(verdict, 1.1)
    levels = (60.0 if given else 40.0) if gap or given else 1.1, 40.0 if gap else 1.1, after
    shrinks = {name: Shrink(*_shrink(value, gap)) for name, value in SHRINKS.items()}
    shrink = Shrink(*_shrink(1.0 - (after - 1.0) / 39.0, gap))
    errors = np.stack([level * np.random.default_rng(4).chisquare(3, (COUNT, 3)) / 3.0 for level in levels])
    errors = errors * (np.array([1.5, 0.3, 1.2]) if gap else 1.0)
    levels, errors = (*levels, after), np.concatenate([errors, errors[-1:]])  # nothing is discovered
    parts = (np.full((COUNT, 3), part) * UNIT for part in (1.0, 0.05, 0.0))
    floor = Floor(*parts, {}, *[np.linspace(0.8, 1.3, 400)] * 2, {}, np.linspace(0.8, 1.3, 400))
    placebo = ("camera_scale", shrinks["camera_scale"])
    model = Model(0.05, Physical(np.array([2.0, 3.0]), np.ones((2, 2)), np.zeros(2)), np.array([0.1, 0.1]))
    return Diagnosis(
        verdict, _judgement(verdict, selected),
        Gap(1.0, *levels, 1.05, (0.8, 1.3), shrink, shrink, placebo, errors, _paths(selected), floor, UNIT, 0),
        account_of(1.0, _errors(errors, selected), selected, floor, UNIT), _place(gap), selected,
        [Parameter(n, 2.0 if given else None, 2.0 + 0.1 * k, 0.06) for k, n in enumerate(NOMINAL)],
        {name: 1.7**k / 10.0 for k, name in enumerate(reversed(COORDINATES))},
        REPLAY, "Record a longer <run> & more.",
        model, _with_effects(model, selected), shrinks,
        Prepared(_log(), LARGEST, _NOTHING, _starts(1), _starts(0), _NOTHING, ROWS, 1.0,
                 Frames(_NOTHING, _NOTHING), _NOTHING, served=(COUNT * ROWS + 1, COUNT * ROWS + 1)),
        _finding(selected, gap, verdict),
    )  # fmt: skip


def _log() -> Log:
    """Two runs, the first of which fits and the second judges."""
    run = np.repeat([0, 1], COUNT * ROWS + 1)
    none = np.zeros(len(run))
    return Log(0.05 * np.arange(len(run)), none, none, 0.001 * np.arange(len(run)), none, none, run)


def _paths(selected) -> np.ndarray:
    """Poses that the nominal and the corrected model predict; the same where no effect is selected."""
    paths = np.zeros((2, COUNT, ROWS, 3))
    paths[1] += 1e-3 * len(selected)
    return paths


def _starts(run: int) -> Starts:
    return Starts(np.full(COUNT, run), ROWS * np.arange(COUNT))


def _errors(errors, selected) -> dict[frozenset[str], Any]:
    """Errors of models with each set of the selected effects: the first takes two thirds away, the second the rest."""
    before, after = np.sqrt(errors[1] * UNIT), np.sqrt(errors[2] * UNIT)
    middle = np.sqrt((errors[1] + 2.0 * errors[2]) / 3.0 * UNIT)
    if len(selected) < 2:
        return {frozenset(): before, frozenset(selected): after}
    one, other = (frozenset((name,)) for name in selected)
    return {frozenset(): before, one: middle, other: before, frozenset(selected): after}


SHRINKS = {
    "transport_delay": 0.8,
    "motor_lag": 0.75,
    "quadratic_drag": 0.3,
    "marker_offset": 0.39,
    "camera_scale": 0.01,
}


def _shrink(value: float, stands_out: bool) -> tuple[Any, Any]:
    return (value, (value - 0.03, value + 0.02)) if stands_out else (None, None)


def _with_effects(model: Model, selected: tuple[str, ...]) -> Model:
    known = {
        "transport_delay": Effect("transport_delay", {"delay": 0.0521}, {"delay": 0.0034}),
        "quadratic_drag": Effect("quadratic_drag", {"along": 0.51, "heading": 0.3}, {"along": 0.02, "heading": 0.05}),
        "marker_offset": Effect("marker_offset", {"ahead": 0.02, "left": -0.01}, {"ahead": 0.001, "left": 0.002}),
    }
    return Model(model.sample_period, model.dynamics, model.dead_zone, effects=tuple(known[n] for n in selected))


def _judgement(verdict: str, selected: tuple[str, ...]) -> Judgement:
    if verdict == "effects":
        causes = [Cause("transport_delay", "actuation", 0.99, ("motor_lag",), False),
                  Cause("quadratic_drag", "drive", 0.9, (), False),
                  Cause("motor_lag", "actuation", 0.01, (), False)]  # fmt: skip
        sets = [(tuple(sorted(selected)), 0.9), (("transport_delay",), 0.09), (("motor_lag", "quadratic_drag"), 0.01)]
        return Judgement(0.0, sets, causes, dict(zip(SITES, (1.0, 0.9, 0.0, 0.0, 0.0), strict=True)))
    if verdict in ("partly", "unknown"):
        name, site = (selected[0], "drive") if selected else ("marker_offset", "camera")
        causes = [Cause(name, site, 0.95 if selected else 0.05, (), False)]
        sites = dict(zip(SITES, (0.1, 0.0, 0.8, 0.0, 0.15), strict=True))
        sets = [((name,), causes[0].probability), ((), 1.0 - causes[0].probability)]
        return Judgement(0.95, sorted(sets, key=lambda pair: -pair[1]), causes, sites)
    return Judgement(0.01, [((), 0.97), (("camera_scale",), 0.03)], [], dict.fromkeys(SITES, 0.0))


def _place(gap: bool) -> Place:
    edges = {"u_r": np.linspace(-1.0, 1.0, 5), "|v|": np.array([0.0, 0.1, 0.25, 0.3, 0.9]),
             "reversals": np.array([0.0, 1.0, 4.0]), "session time": np.linspace(0.0, 120.0, 5)}  # fmt: skip
    size = 40.0 if gap else 0.1
    table = {n: (e, size * np.linspace(-0.1, 1.0 + 0.1 * k, len(e) - 1) ** 3) for k, (n, e) in enumerate(edges.items())}
    regions = [Region("u_r", 0.5, 1.0, 0.6, 0.001), Region("|v|", 0.3, 0.9, 0.4, 0.01)] if gap else []
    moved, excess = (
        dict(zip(("along", "lateral", "heading"), shares if gap else (0.0, 0.0, 0.0), strict=True))
        for shares in ((0.7, 0.0, 0.3), (0.55, 0.05, 0.4))
    )
    return Place(moved, excess, regions, table)


def fit_of(effects: tuple[str, ...], size=0.0, deviation=0.01, cost=0.0) -> Solution:
    """A fit with every coordinate of its effects `size` away from neutral, known to within `deviation`."""
    vector, places = neutral_vector(np.ones(len(NOMINAL))), free_places(effects)
    vector[places[len(NOMINAL) :]] += size
    return Solution(vector, _NOTHING, places, _NOTHING, cost, deviation**2 * np.eye(len(places)), 1)


def finding_of(worth: dict[tuple[str, ...], float], selected: tuple[str, ...] = (), terms=()) -> Finding:
    """A search that ended at a set, by the log evidence of sets beyond that of none, which is also what they gain."""
    whole = {frozenset(effects): value for effects, value in {(): 0.0, **worth}.items()}
    own = whole[frozenset(selected)]
    values: Values = {effects: value - own for effects, value in whole.items()}
    table = _table(tuple(dict.fromkeys(name for effects in worth for name in effects)), selected, own)
    return Finding(_NOTHING, _LAW, _LAW, fit_of((), cost=own), fit_of(selected, 0.1), selected, values,
                   Rest(list(terms), _NOTHING, _LAW, 0.0), table)  # fmt: skip


def _finding(selected: tuple[str, ...], gap: bool, verdict: str) -> Finding:
    size = 400.0 if gap else 3.0
    worth: dict[tuple[str, ...], float] = {(name,): size * max(value, 0.01) for name, value in SHRINKS.items()}
    if len(selected) == 2:
        worth[selected] = 1.2 * size
        worth["motor_lag", "quadratic_drag"] = 1.19 * size
        worth["transport_delay", "marker_offset"] = 0.82 * size
    terms: list[tuple[Any, float]] = [(Term("contact", "|v| w in the speed sideways"), 150.0)] * (
        verdict in ("partly", "unknown")
    )
    return finding_of(worth, selected, terms)


def _table(names: tuple[str, ...], selected: tuple[str, ...], gain: float):
    """Answers of windows to some effects: the selected ones alone make up the residual; delay and lag look alike."""
    rng = np.random.default_rng(5)
    columns = rng.normal(size=(COUNT, 20, len(names))) / np.sqrt(20.0 * COUNT)
    if {"motor_lag", "transport_delay"} <= set(names):
        lag, delay = (names.index(name) for name in ("motor_lag", "transport_delay"))
        columns[..., lag] = 0.99 * columns[..., delay] + 0.14 * columns[..., lag]
    residual = columns[..., [names.index(name) for name in selected]].sum(axis=2) * np.sqrt(2.0 * abs(gain))
    return table_of(columns, residual + rng.normal(size=residual.shape), names, scale=20.0, here=selected)


def discovered_law() -> Shown:
    """A made-up law: speed that falls with the square of the turn rate."""
    at = np.linspace(-1.0, 1.0, 10)
    law = Discovered("acceleration along", "v", "w", at, -0.3 * at**2, np.full(10, 0.01))
    return Shown(Kind("acceleration along", "v", "w"), law, (5,) * 10, 0.4, 0.001, Form("c s^2", {"c": -0.3}, 0.97))

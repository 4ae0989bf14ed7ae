"""The user's own simulator, known by its logs or as a model: its parameters, and the effects that it has already."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from jaxident.diagnosis.account.measure import measure
from jaxident.diagnosis.causes.chance_effects import direct_effects, direct_evidence, present
from jaxident.diagnosis.causes.finding import CLAIMED, Finding, find_effects
from jaxident.diagnosis.fit.refit import refit
from jaxident.diagnosis.joint_comparison import MOSTLY, explain_together
from jaxident.diagnosis.noise.law import Law, deviations, first_law
from jaxident.diagnosis.preparation.dropped_commands import gain_beyond
from jaxident.diagnosis.preparation.prepare import Prepared, prepare
from jaxident.effects.catalogue import BY_CHANCE
from jaxident.effects.checks import check_effects
from jaxident.effects.coordinates import vector_of
from jaxident.errors import InputError
from jaxident.log import Log, join
from jaxident.robot.model import Model

LOST, MEMORY = BY_CHANCE["lost"], BY_CHANCE["memory"]
STRIDE = 10
"""Rows over which speeds are taken: camera noise hardly counts."""
NOISY = 0.5
"""Part of the robot's camera error from which on a simulator's logs have noise of their own, as those of another robot
have, and slip."""
FAINT = 0.01
"""Part of a camera's error that white noise is taken for where memory has taken all: even logs without noise have
digits."""
UNITS = 15.0
"""Ratio of speeds beyond which no two robots that are meant to be the same differ."""


class Simulator(NamedTuple):
    """What the user's simulator is: vector (SIZE,) of its nominal parameters and effects, and their names; the search
    of its logs, None for a model; what a difference between it and the robot must be worth; how far its own gap exceeds
    its noise, where it has noise (`Gap.excess`)."""

    vector: Any
    effects: tuple[str, ...]
    finding: Finding | None = None
    price: float = CLAIMED
    excess: float = 0.0


def check_units(sim: Log | Sequence[Log], logs: Log | Sequence[Log]) -> None:
    """InputError where a simulator's robot moves so much faster or slower for the same commands, or turns, that the two
    are in different units: metres and millimetres, radians and degrees, commands in parts and in per cent."""
    theirs, own = _answers(join(sim)), _answers(join(logs))
    for name, unit, a, b in zip(("moves", "turns"), ("lengths", "angles"), theirs, own, strict=True):
        ratio = a / max(b, 1e-12)
        if not 1.0 / UNITS < ratio < UNITS:
            raise InputError(
                f"for the same commands the simulator {name} {ratio:.3g} times as fast as the robot: are {unit} and "
                "commands in the same units?"
            )


def _answers(log: Log) -> tuple[float, float]:
    """Typical speed and turn rate over the size of the commands."""
    seen = np.isfinite(log.x) & np.isfinite(log.y) & np.isfinite(log.theta)
    runs = [run for run in Log(*(np.asarray(column)[seen] for column in log)).runs() if len(run.t) > STRIDE]
    if not runs:
        return 1.0, 1.0
    time = np.concatenate([run.t[STRIDE:] - run.t[:-STRIDE] for run in runs])
    moved = np.concatenate([np.hypot(*(p[STRIDE:] - p[:-STRIDE] for p in (run.x, run.y))) for run in runs])
    # as they stand: unwrapping takes radians for granted, and the median forgives where they wrap
    turn = np.concatenate([np.abs(run.theta[STRIDE:] - run.theta[:-STRIDE]) for run in runs])
    command = float(np.nanmean(np.abs(np.stack(log.command)))) + 1e-12
    return float(np.mean(moved / time)) / command, float(np.median(turn / time)) / command


def inspect_simulator(sim: Log | Sequence[Log], prepared: Prepared, finding: Finding) -> tuple[Simulator, Finding]:
    """The simulator behind some logs, and the robot's search with names that agree with the simulator's where they
    can."""
    own, found, noisy = _search(sim, prepared, finding)
    together = explain_together(finding, found)
    effects = (*together.effects, *_direct((own, found), (prepared, finding), together.price))
    excess = _excess(own, together.simulator) if noisy else 0.0
    return Simulator(together.fit.vector, effects, together.simulator, together.price, excess), together.robot


def _direct(sim: tuple[Prepared, Finding], robot: tuple[Prepared, Finding], price: float) -> list[str]:
    """Effects that show without a refit and that a simulator has as well, by both sides' logs and searches. A memory of
    its camera counts however few windows show it: what looks like one in both is no difference."""
    found = direct_evidence(*sim)
    worth = {
        name: value for name, value in found.items() if value > CLAIMED or (name == MEMORY and sim[1].law.coloured)
    }
    theirs, own = (direct_effects(*side, tuple(worth)) for side in (sim, robot))
    scale = len(robot[0].log.t) / max(len(sim[0].log.t), 1)
    beyond = {name: value - scale * worth.get(name, 0.0) for name, value in direct_evidence(*robot).items()}
    if LOST in worth and robot[0].lost[0] > 0.0:
        beyond[LOST] = _lost_beyond(*robot, sim[0].lost[0])
    return [name for name in worth if name not in rarer(theirs, own, beyond, price)]


def _lost_beyond(prepared: Prepared, finding: Finding, share: float) -> float:
    """What the robot's own share of lost commands explains beyond what the simulator's does. Even a small one lets in
    every change that was late beyond doubt; what these are worth is no difference."""
    data = finding.data._replace(windows=finding.data.windows._replace(command=prepared.sent))
    return gain_beyond(data, refit(data, finding.fit.vector, finding.fit.starts, finding.selected), share)


def rarer(
    theirs: dict[str, dict[str, float]], own: dict[str, dict[str, float]], beyond: dict[str, float], price: float
) -> list[str]:
    """Effects of chance that a simulator has hardly any of: most of the robot's share of rows is missing there, and
    what its rows are worth `beyond` the simulator's is more than the price of a difference."""
    shares = {name: values["probability"] for name, values in own.items() if "probability" in values}
    fewer = [name for name, share in shares.items() if theirs[name]["probability"] < (1.0 - MOSTLY) * share]
    return [name for name in fewer if beyond[name] > price]


def _search(sim: Log | Sequence[Log], prepared: Prepared, finding: Finding) -> tuple[Prepared, Finding, bool]:
    """The search of a simulator's logs: as far as the robot's camera could tell or, where they are as noisy themselves,
    under their own noise, some of their runs kept for judging; and whether they are."""
    law, nominal = Law(*deviations(finding.law)[1:]), finding.nominal.vector
    own = prepare(sim, prepared.horizon, nominal, prepared, law)
    if is_noisy(first_law(own.windows), finding.law):
        return *find_effects(prepare(sim, prepared.horizon, nominal, prepared)), True
    return *find_effects(own, law=law), False


def is_noisy(white: Law, robot: Law) -> bool:
    """Whether white camera noise [m], [rad] (`first_law`) is like that of a robot under a law, which may have left none
    of it white."""
    least = np.maximum([robot.position, robot.heading], FAINT * deviations(robot)[1:])
    return bool(np.any(np.array([white.position, white.heading]) > NOISY * least))


def _excess(own: Prepared, found: Finding) -> float:
    """How far a simulator's own gap exceeds its noise, on runs that it was not fitted to; 0 where there are none."""
    if not len(own.judging.row):
        return 0.0
    direct = direct_effects(own, found, present(found, direct_evidence(own, found)))
    return measure(own, found, None, (), direct).gap.excess


def as_simulator(model: Model, logs: Log | Sequence[Log]) -> Simulator:
    """A model as the simulator of some logs' commands. InputError for effects that `check_effects` refuses."""
    check_effects(model.effects)
    return Simulator(vector_of(model, largest_command(logs)), tuple(effect.name for effect in model.effects))


def largest_command(logs: Log | Sequence[Log]) -> float:
    """The largest command of some logs, which the search has as its unit."""
    return float(np.nanmax(np.abs(np.stack(join(logs).command))))


def shared(found: tuple[str, ...], simulator: Simulator | None) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Effects that robot, by what was found, and simulator both have, and those that the simulator has alone."""
    if simulator is None:
        return (), ()
    common = tuple(name for name in found if name in simulator.effects)
    return common, tuple(name for name in simulator.effects if name not in common)

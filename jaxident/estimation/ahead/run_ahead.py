"""From a physical model and a log to filtered starts and free runs, in blocks of stretches of one shape."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np

from jaxident.array_types import Array
from jaxident.effects.catalogue import BY_CHANCE
from jaxident.effects.coordinates import vector_of
from jaxident.effects.fast_input import RUN_UP
from jaxident.effects.law_arrays import Laws, laws_of
from jaxident.effects.law_kinds import ANGLE, MOST_LAWS
from jaxident.effects.past import Past
from jaxident.estimation.ahead.camera_noise import noise_for
from jaxident.estimation.ahead.filtered_state import Run, filter_and_run
from jaxident.estimation.ahead.parameter_spread import directions, opposite
from jaxident.estimation.ahead.stretches import AXES, Starts, Stretch, cut_stretches, until_last_start
from jaxident.estimation.ahead.wheel_phase import closer, followed, phases_of
from jaxident.estimation.increments.observations import blind, repeats
from jaxident.estimation.poses.ways import ways
from jaxident.log import Log
from jaxident.numerics import wrap
from jaxident.parallel import in_parallel
from jaxident.programs import kept_program
from jaxident.robot.model import Model
from jaxident.robot.noise import Noise

FORGOTTEN = 200
"""Rows after which a filter with slip has forgotten where it began."""
DIVERGED = 9.0
"""Mean square of normalised innovations over the burn-in, three channels alike and none counted beyond `LIMIT`, above
which a filter has not converged: three deviations where one is expected."""
LANES, ROWS = 32, 64
"""Stretches that one call of the compiled program takes, and what their rows are a multiple of: there are few shapes,
for each takes seconds to compile. 32 and 128 stretches cost 0.8 and 0.9 ms each on one core; of fewer at a time less is
filled up, and more cores have work. A prediction from eight starts or fewer takes 30 ms, not the 14 of blocks of eight,
which would be a second program to compile (6 s)."""


JUMP = 30.0
"""Times the median of all starts that the slope of the heading by a parameter may be before the other side is looked
at. At one start of 779 of a robot in a wrong session time it was a million times that, and the predicted deviation of
all 35 rad. No other number was tried."""
ANGLE_STEP = 1e-3
"""Step of the differences by the angle of a wheel [rad]."""


class Ahead(NamedTuple):
    """Predicted rows: pose (starts, horizon, 3); covariances (starts, horizon, 3, 3) of it by what is not known at the
    start and by slip since; its slopes by the parameters, a deviation's worth of each independent direction, and by the
    angles of wheels that laws go by (directions, starts, horizon, 3); run_up (starts,): whether a start comes from a
    run-up of earlier commands."""

    pose: Any
    start: Any
    slip: Any
    parameters: Any
    run_up: Any

    @property
    def covariance(self) -> np.ndarray:
        """Covariance (starts, horizon, 3, 3) of the predicted pose by all that is known to be uncertain."""
        own = np.einsum("dshi,dshj->shij", self.parameters, self.parameters)
        return self.start + self.slip + own


def run_ahead(model: Model, log: Log, starts: Starts, horizon: int, *, burn_in: int, session_time: float) -> Ahead:
    """Free runs of a physical model over `horizon` rows from filtered states.

    With slip the filter forgets by itself and takes in FORGOTTEN rows at least. Without, it trusts the model for ever:
    the burn-in alone then bounds how far small errors of the model pile up. Where a law goes by the angle of a wheel,
    the rows before a start tell this angle.
    """
    noise = jax.tree.map(np.float64, noise_for(model, until_last_start(log, starts)))  # one type, one program
    slips = float(noise.slip_along) > 0.0 or float(noise.slip_heading) > 0.0
    before = max(burn_in, FORGOTTEN) if slips or laws_of_wheels(model) else burn_in
    step = float(np.median(np.concatenate([np.diff(run.t) for run in log.runs()])))
    first = int(np.ceil(RUN_UP / step)) + before
    chance = {effect.name: effect.parameters for effect in model.effects}
    if BY_CHANCE["repeat"] in chance:
        log = blind(log, repeats(log))
    lost = chance[BY_CHANCE["lost"]]["probability"] if BY_CHANCE["lost"] in chance else None
    filler = -(first + 1 + horizon) % ROWS
    stretch = cut_stretches(log, starts, first - before, before, horizon + filler, session_time,
                            past=bool(model.discovered))  # fmt: skip
    ahead = slice(first + 1, first + 1 + horizon)

    def run(robot: Model, phase: Array, stretch: Stretch, sure: Array | None = None) -> Run:
        laws = laws_of(robot.discovered)
        if laws is not None:
            laws = laws._replace(phase=phase, sure=np.ones(phase.shape) if sure is None else sure)
        return _in_blocks(vector_of(robot), laws, noise, lost, stretch, first)

    phase, deviation = _phases(run, model, log, starts, stretch, first)
    sure = np.exp(-0.5 * deviation**2)  # the mean of a cosine whose angle is so uncertain
    found, phase, stretch, run_up = _filtered(partial(run, model, sure=sure), phase, stretch, ahead, burn_in)
    pose, begin, slip = (np.moveaxis(leaf[ahead], -1, 0) for leaf in found[:3])

    def there(robot: Model, phase: Array, sure: Array) -> np.ndarray:
        return np.moveaxis(run(robot, phase, stretch, sure).pose[ahead], -1, 0)

    slopes = [_slope(lambda robot: there(robot, phase, sure), pose, model, *each) for each in directions(model)]
    for k in laws_of_wheels(model):
        whole, turn = np.ones(sure.shape), ANGLE_STEP * (np.arange(MOST_LAWS) == k)[:, None]
        slope = _less(there(model, phase + turn, whole), there(model, phase, whole)) / ANGLE_STEP
        slopes.append(slope * np.minimum(deviation[k], 1.0)[:, None, None])  # an angle that may be any: as a sine's
    return Ahead(pose, begin, slip, np.array(slopes).reshape(-1, *pose.shape), run_up)


def _slope(there: Callable[[Model], Array], pose: Array, model: Model, other: Model, size: float) -> np.ndarray:
    """Slopes (starts, horizon, 3) of a model's poses towards another robot, `size` deviations away; where poses jump
    between the two, the slope on the other side."""
    slope = _less(there(other), pose) / size
    each = np.abs(slope[..., 2]).max(axis=1)
    usual = np.median(each)
    steep = (each > JUMP * usual) & (usual > 0.0)  # a parameter may matter at few starts
    if not steep.any() or (across := opposite(model, other)) is None:
        return slope
    back = _less(pose, there(across)) / size
    jumps = steep & (np.abs(back[..., 2]).max(axis=1) < each)
    return np.where(jumps[:, None, None], back, slope)


def laws_of_wheels(model: Model) -> list[int]:
    """The laws that go by the angle of a wheel."""
    return [k for k, law in enumerate(model.discovered) if law.signal == ANGLE]


def _phases(
    run: Callable[..., Run], model: Model, log: Log, starts: Starts, stretch: Stretch, first: int
) -> tuple[np.ndarray, np.ndarray]:
    """Phases (laws, starts) of the wheels that laws go by where the filter of each start begins, and their deviations
    [rad]; first: row of the starts in their stretches."""
    none, laws = np.zeros((MOST_LAWS, len(starts.row))), laws_of(model.discovered)
    if laws is None or not laws_of_wheels(model):
        return none, none
    anchors, own = np.unique(followed(starts), return_inverse=True)
    part = jax.tree.map(lambda axis, leaf: np.take(leaf, anchors, axis), AXES, stretch)

    def misfit(stretch: Stretch, phases: Array, acting: Sequence[int]) -> np.ndarray:
        count = len(phases)  # side by side, so that blocks are full
        many = jax.tree.map(lambda axis, leaf: np.concatenate([leaf] * count, axis), AXES, stretch)
        phases = np.concatenate(phases, axis=-1)
        acts = np.isin(np.arange(MOST_LAWS), acting)[:, None] * np.ones(phases.shape)
        found = run(model, phases, many, acts)
        return found.innovation[: first + 1].sum(axis=0).reshape(count, -1)

    phase, _ = phases_of(partial(misfit, part), laws_of_wheels(model), (MOST_LAWS, len(anchors)))
    gone = ways(log.runs())[:, starts.run, np.maximum(starts.row - first + stretch.first, 0)]
    phase = phase[:, own] + laws.per_way @ (gone - gone[:, anchors[own]])
    return closer(partial(misfit, stretch), laws_of_wheels(model), phase)


def _less(pose: Array, other: Array) -> np.ndarray:
    """Poses (..., 3) less others next to them, whose headings may be told in other turns."""
    change = pose - other
    change[..., 2] = wrap(change[..., 2])
    return change


def _filtered(
    run: Callable[..., Run], phase: Array, stretch: Stretch, ahead: slice, burn_in: int
) -> tuple[Run, Array, Stretch, Array]:
    """The filter and the free run of every stretch, over the rows `ahead`; where it does not converge, a run-up of the
    commands from rest, laid on the last pose; phases (laws, stretches) and stretches as they were run, and where they
    are run-ups."""
    found = run(phase, stretch)
    late = slice(max(ahead.start - burn_in, 0), ahead.start)
    seen = np.maximum(stretch.seen[late].sum(axis=0), 1)
    misses = found.innovation[late].sum(axis=0) / (3.0 * seen)
    lost = ~(np.isfinite(found.pose[ahead.stop - 1]).all(axis=0) & (misses < DIVERGED))
    if not lost.any():
        return found, phase, stretch, lost
    rows = np.arange(len(stretch.t))[:, None]
    last = len(rows) - 1 - np.argmax(stretch.seen[::-1], axis=0)
    other = stretch._replace(
        seen=np.where(lost, rows == last, stretch.seen), first=np.where(lost, last, stretch.first),
        speeds=np.where(lost, np.nan, stretch.speeds),
    )  # fmt: skip
    if found.angles is not None:
        phase = np.where(lost, np.take_along_axis(found.angles, last[None, None], axis=0)[0], phase)
    again = run(phase, other)
    return jax.tree.map(lambda new, old: np.where(lost, new, old), again, found), phase, other, lost


_run_block = kept_program(Laws, Noise, Stretch, Past, Run)(filter_and_run)


def _in_blocks(vector: Array, laws: Laws | None, noise: Noise, lost: float | None, stretch: Stretch, first: int) -> Run:
    """`filter_and_run` of any number of stretches; the last block is filled up with copies of its last one.

    Blocks run side by side where there are cores."""
    count, blocks = stretch.t.shape[1], []
    for begin in range(0, count, LANES):
        chosen = np.minimum(np.arange(begin, begin + LANES), count - 1)
        block = jax.tree.map(lambda axis, leaf, chosen=chosen: np.take(leaf, chosen, axis), AXES, stretch)
        own = None if laws is None else laws._replace(phase=laws.phase[:, chosen], sure=laws.sure[:, chosen])
        blocks.append((vector, own, noise, lost, block, first))
    parts = [jax.tree.map(np.asarray, block) for block in in_parallel(_run_block, blocks, ahead=False)]
    return jax.tree.map(lambda *leaves: np.concatenate(leaves, axis=-1)[..., :count], *parts)

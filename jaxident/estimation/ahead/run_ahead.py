"""From a physical model and a log to filtered starts and free runs, in blocks of stretches of one shape."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np

from jaxident.array_types import Array
from jaxident.effects.catalogue import BY_CHANCE
from jaxident.effects.coordinates import vector_of
from jaxident.effects.discovered import Laws, laws_of
from jaxident.effects.fast_input import RUN_UP
from jaxident.effects.past import Past
from jaxident.estimation.ahead.camera_noise import noise_for
from jaxident.estimation.ahead.filtered_state import Run, Stretch, filter_and_run
from jaxident.estimation.ahead.parameter_spread import directions
from jaxident.estimation.ahead.stretches import AXES, Starts, cut_stretches, until_last_start
from jaxident.estimation.increments.observations import blind, repeats
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


class Ahead(NamedTuple):
    """Predicted rows: pose (starts, horizon, 3); covariances (starts, horizon, 3, 3) of it by what is not known at the
    start and by slip since; its slopes by the parameters, a deviation's worth of each independent direction
    (directions, starts, horizon, 3); run_up (starts,): whether a start comes from a run-up of earlier commands."""

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
    the burn-in alone then bounds how far small errors of the model pile up.
    """
    noise = jax.tree.map(np.float64, noise_for(model, until_last_start(log, starts)))  # one type, one program
    slips = float(noise.slip_along) > 0.0 or float(noise.slip_heading) > 0.0
    before = max(burn_in, FORGOTTEN) if slips else burn_in
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

    def run(robot: Model, stretch: Stretch) -> Run:
        return _in_blocks(vector_of(robot), laws_of(robot.discovered), noise, lost, stretch, first)

    found, stretch, run_up = _filtered(partial(run, model), stretch, ahead, burn_in)
    pose, begin, slip = (np.moveaxis(leaf[ahead], -1, 0) for leaf in found[:3])
    slopes = [
        _less(np.moveaxis(run(other, stretch).pose[ahead], -1, 0), pose) / size for other, size in directions(model)
    ]
    return Ahead(pose, begin, slip, np.array(slopes).reshape(-1, *pose.shape), run_up)


def _less(pose: Array, other: Array) -> np.ndarray:
    """Poses (..., 3) less others next to them, whose headings may be told in other turns."""
    change = pose - other
    change[..., 2] = np.asarray(wrap(change[..., 2]))
    return change


def _filtered(
    run: Callable[[Stretch], Run], stretch: Stretch, ahead: slice, burn_in: int
) -> tuple[Run, Stretch, Array]:
    """The filter and the free run of every stretch, over the rows `ahead`; where it does not converge, a run-up of the
    commands from rest, laid on the last pose; the stretches as they were run, and where they are run-ups."""
    found = run(stretch)
    late = slice(max(ahead.start - burn_in, 0), ahead.start)
    seen = np.maximum(stretch.seen[late].sum(axis=0), 1)
    misses = found.innovation[late].sum(axis=0) / (3.0 * seen)
    lost = ~(np.isfinite(found.pose[ahead.stop - 1]).all(axis=0) & (misses < DIVERGED))
    if not lost.any():
        return found, stretch, lost
    rows = np.arange(len(stretch.t))[:, None]
    last = len(rows) - 1 - np.argmax(stretch.seen[::-1], axis=0)
    other = stretch._replace(
        seen=np.where(lost, rows == last, stretch.seen), first=np.where(lost, last, stretch.first),
        speeds=np.where(lost, np.nan, stretch.speeds),
    )  # fmt: skip
    again = run(other)
    return Run(*(np.where(lost, new, old) for new, old in zip(again, found, strict=True))), other, lost


_run_block = kept_program(Laws, Noise, Stretch, Past, Run)(filter_and_run)


def _in_blocks(vector: Array, laws: Laws | None, noise: Noise, lost: float | None, stretch: Stretch, first: int) -> Run:
    """`filter_and_run` of any number of stretches; the last block is filled up with copies of its last one.

    Blocks run side by side where there are cores."""
    count, blocks = stretch.t.shape[1], []
    for begin in range(0, count, LANES):
        chosen = np.minimum(np.arange(begin, begin + LANES), count - 1)
        block = jax.tree.map(lambda axis, leaf, chosen=chosen: np.take(leaf, chosen, axis), AXES, stretch)
        blocks.append((vector, laws, noise, lost, block, first))
    parts = [jax.tree.map(np.asarray, block) for block in in_parallel(_run_block, blocks, ahead=False)]
    return Run(*(np.concatenate(leaves, axis=-1)[..., :count] for leaves in zip(*parts, strict=True)))

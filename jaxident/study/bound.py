"""The Cramer-Rao bound of a study's cells: what no unbiased estimator can beat on the same commands."""

import functools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import xarray

from jaxident.array_types import AT_REST, Array, Pose, Wheels
from jaxident.estimation.poses.parameters import Law, Robot, to_vector
from jaxident.estimation.poses.runs import Runs
from jaxident.estimation.uncertainty.precision import bound_covariance, difference_covariance
from jaxident.numerics import require_float64
from jaxident.robot.model import DIFFERENCE_ORDER, require_physical
from jaxident.robot.noise import Noise
from jaxident.study.design import Study
from jaxident.study.engine import cells
from jaxident.study.trial import Cell, commands, draw_robot, seed_keys

SEEDS = 8
"""Seeds of a cell whose bounds are averaged (as variances): commands and, where drawn, robots differ."""

MOST_CELLS = 500


def bounds(study: Study) -> xarray.DataArray | None:
    """Smallest standard deviation possible on the axes of a summary's cells and `parameter`, in DIFFERENCE_ORDER.

    NaN without noise and where effects or discovered laws are in force, of which no estimator knows. None for a study
    of more than MOST_CELLS cells at one noise level, or with a camera that makes no error in heading. Needs double
    precision.
    """
    require_float64("bounds")
    if not study.heading_per_position > 0.0 or np.prod(study.shape[:-2]) > MOST_CELLS:
        return None
    noise, found = np.asarray(study.noise, float), np.full((*study.shape[:-1], len(DIFFERENCE_ORDER)), np.nan)
    models = [candidate.model for candidate in study.robots]
    slip = any(m.noise is not None and m.noise.slip_along + m.noise.slip_heading for m in models)
    single = not slip and models[0].wheels is None  # without another source of error the bound grows as the noise does
    for place in np.ndindex(study.shape[:-2]):
        at = dict(zip(study.axes, place, strict=False))
        if study.in_force[at["robot"]][at.get("effect", 0)] or study.robots[at["robot"]].model.discovered:
            continue
        levels = np.flatnonzero(noise)[:1] if single else np.flatnonzero(noise)
        for level in levels:
            found[(*place, level)] = _deviation(study, (*place, level), bool(slip))
        if single and len(levels):
            found[place] = found[(*place, levels[0])] * np.where(noise > 0.0, noise / noise[levels[0]], np.nan)[:, None]
    return xarray.DataArray(found, dims=(*study.axes[:-1], "parameter"))


def _deviation(study: Study, place: tuple[int, ...], slip: bool) -> np.ndarray:
    """The bound (12,) of one cell: root of the mean variance over its first seeds."""
    count = min(SEEDS, study.seeds)
    index = np.stack([np.full(count, k) for k in place] + [np.arange(count)])
    where, base = cells(study, index), jax.random.key(study.seed)
    kind, rows = study.excitations[place[0]], study.samples[place[1]]
    law = Law(
        where.robot.coupling is not None, study.correlation_time is not None, slip, where.robot.wheels is not None
    )
    sent = commands(base, where, kind, rows, study.hold, study.runs)
    variances = np.asarray(_variances(base, where, sent, law, study.runs))
    return np.sqrt(np.mean(np.where(variances > 0.0, variances, np.nan), axis=0))


@functools.partial(jax.jit, static_argnames=("law", "count"))
def _variances(base: Array, where: Cell, command: Wheels, law: Law, count: int) -> Array:
    """Variances (trials, 12) by the information in each trial of `count` runs."""

    def one(cell: Cell, command: Wheels) -> Any:
        robot = draw_robot(seed_keys(base, cell)[0], cell)
        slips = (0.0, 0.0) if cell.robot.slip is None else cell.robot.slip
        noise = Noise(cell.position, cell.heading, cell.correlation_time, *slips)
        vector = to_vector(Robot(require_physical(robot), robot.dead_zone, noise, robot.wheels), law)
        command = Wheels(*(u.reshape(count, -1) for u in command))
        blank = jnp.zeros(command.right.shape)
        every = blank == 0.0
        wheels, turning = (Wheels(blank, blank), Wheels(every, every)) if law.wheels else (None, None)
        runs = Runs(cell.period, command, Pose(blank, blank, blank), every, wheels, turning)
        covariance = bound_covariance(vector, jnp.asarray(AT_REST, float), runs, law)
        return jnp.diagonal(difference_covariance(vector, covariance, cell.period, law))

    return jax.vmap(one)(where, command)

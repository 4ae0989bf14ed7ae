"""The paper's experiment: its robot, its kind of excitation, its method, and what camera noise does to it."""

import dataclasses
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import AT_REST, Array, Pose, Wheels
from jaxident.estimation.identify import Identification, identify
from jaxident.estimation.increments import recursive
from jaxident.estimation.increments.initialise import initialise
from jaxident.estimation.increments.observations import observe_log, tail
from jaxident.estimation.predict import Prediction, predict
from jaxident.log import Log
from jaxident.parallel import as_precise
from jaxident.robot.dead_zone import effective_command
from jaxident.robot.difference import to_difference
from jaxident.robot.drive import force, hold
from jaxident.robot.model import DIFFERENCE_ORDER, Model, difference_vector, require_physical
from jaxident.robot.noise import Noise, UnitNoise, draw_noise, observe
from jaxident.robot.simulate import run_forces, simulate
from jaxident.study.synthetic import excite

SAMPLES = 2000
HOLD = 5
"""Samples that a level of the staircase lasts: short enough to tell d from e, which long levels do not."""

SETUP_ROWS = 200
D_MAX = 0.9
PREDICTED_ROWS = 60
HEADING_PER_POSITION = 10.0
"""Heading noise for each metre of position noise [rad/m]: 10 mrad at 1 mm, an overhead camera's usual ratio."""

NOISE_LEVELS = (1e-6, 1e-5, 1e-4, 1e-3)
"""Standard deviations of the camera's position [m]."""

TABLE_NOISE = 1e-6
"""Camera noise [m] at which the table's standard errors are taken: above it the method's own bias shows."""

PAPER = (
    0.9818, 0.7699,
    8.6728e-5, 6.6979e-5, 0.0343, -0.0335,
    -5.4438e-5, -7.5772e-5, -0.0312, 0.0308,
    0.2493, 0.2013,
)  # fmt: skip
"""The paper's printed estimates in DIFFERENCE_ORDER (its section VII)."""

FORGETTING = 0.99
"""Forgetting factor of the drift study: a memory of about 100 samples."""

ESTIMATORS = ("batch, 200 samples", "recursive, 2000 samples")
"""The paper's two, both in its own reading (13)-(14), with the measured last increment on the right."""


BLOCK = 20
"""Trials at once: few enough that their work stays in the cache."""


class Row(NamedTuple):
    """One line of the table; ours is without noise, standard_error that of one noisy run at TABLE_NOISE."""

    parameter: str
    true: float
    paper: float
    ours: float
    standard_error: float


class NoiseStudy(NamedTuple):
    """Estimates (levels, seeds, estimators, 12) by camera noise [m] (levels,), and which of them converged
    (levels, seeds, estimators)."""

    levels: Any
    estimates: Any
    ok: Any


class Drift(NamedTuple):
    """A robot that ages: time [s] (samples,), one true parameter and the recursion's estimate of it and deviation."""

    name: str
    t: Any
    truth: Any
    estimate: Any
    deviation: Any


class Reproduction(NamedTuple):
    """All that the page of `jaxident reproduce` shows.

    robot made the log, reference is the simplified robot that estimates are scored against, modelled the free run of
    the identified model. noise may still be computing: read it last.
    """

    robot: Model
    reference: Model
    log: Log
    found: Identification
    modelled: Log
    prediction: Prediction
    noise: NoiseStudy
    drifts: list[Drift]


def paper_log(robot: Model, key: Array) -> Log:
    """The noise-free log of the robot under the staircase of figure 7."""
    log = simulate(robot, excite(key, "staircase", SAMPLES, robot.sample_period, hold=HOLD))
    return Log(*(np.asarray(column) for column in log))


def table_rows(result: Reproduction) -> list[Row]:
    """The paper's table beside ours."""
    study = result.noise
    level = NOISE_LEVELS.index(TABLE_NOISE)
    estimates = np.asarray(study.estimates)[level, :, -1][np.asarray(study.ok)[level, :, -1]]
    deviation = np.std(estimates, axis=0, ddof=1)
    true, ours = (
        np.asarray(difference_vector(m.difference, m.dead_zone)) for m in (result.reference, result.found.model)
    )
    columns = zip(DIFFERENCE_ORDER, true.tolist(), PAPER, ours.tolist(), deviation.tolist(), strict=True)
    return [Row(*cells) for cells in columns]


@partial(jax.jit, static_argnames="seeds")
def noise_study(log: Log, key: Array, levels: Array, seeds: int) -> NoiseStudy:
    """Every estimator on `seeds` noisy copies of a noise-free log (samples,) at each noise level [m].

    All levels see the same unit noise, so that curves against noise are smooth and differences sharp.
    """
    keys = jax.random.split(key, seeds)
    pairs = jnp.repeat(levels, seeds), jnp.tile(keys, len(levels))

    def trial(pair):
        level, k = pair
        return _estimate_all(log, level, draw_noise(k, len(log.t)))

    estimates, ok = jax.lax.map(trial, pairs, batch_size=BLOCK)
    shape = len(levels), seeds, len(ESTIMATORS)
    return NoiseStudy(levels, estimates.reshape(*shape, -1), ok.reshape(shape))


def _estimate_all(log: Log, level: Array, unit: UnitNoise) -> tuple[Array, Array]:
    """Estimates (estimators, 12) and convergence (estimators,) on one noisy copy; the recursion starts from the
    batch."""
    pose = observe(log.pose, Noise(level, HEADING_PER_POSITION * level), unit, log.t[1] - log.t[0])
    observations = observe_log(log._replace(x=pose.x, y=pose.y, theta=pose.theta))
    early = jax.tree.map(lambda column: column[: SETUP_ROWS - 1], observations)
    setup = initialise(early, d_max=D_MAX, reading="one_step")
    first = recursive.start(setup.difference, setup.dead_zone, early, D_MAX, 1.0)
    last = recursive.run_to_end(first, tail(observations, SETUP_ROWS - 1))
    batch = difference_vector(setup.difference, setup.dead_zone)
    final = difference_vector(*recursive.parameters(last))
    ok = jnp.stack([setup.ok, setup.ok & jnp.all(jnp.isfinite(final))])
    return jnp.stack([batch, final]), ok


def drifting_log(robot: Model, log: Log, gain: Array, widening: Array) -> Log:
    """The log of a robot whose gains are multiplied by `gain` (samples,) and whose dead zones widen by `widening`."""
    pose = _drifting_pose(robot, log.command, gain, widening)
    return log._replace(x=np.asarray(pose.x), y=np.asarray(pose.y), theta=np.asarray(pose.theta))


@jax.jit
def _drifting_pose(robot: Model, command: Wheels, gain: Array, widening: Array) -> Pose:
    drive = require_physical(robot)
    passed = effective_command(command, jnp.asarray(robot.dead_zone)[:, None] + widening)
    pull = jax.tree.map(lambda f: f * gain, force(drive, passed))
    return run_forces(hold(drive, jnp.asarray(robot.sample_period)), pull, AT_REST).pose


def drift_study(robot: Model, log: Log) -> list[Drift]:
    """Battery (gains fall by a fifth over the run) and wear (dead zones rise by a tenth of the command), each
    followed by the recursion with forgetting."""
    course = jnp.linspace(0.0, 1.0, len(log.t))
    drive = require_physical(robot)._replace(coupling=None)
    robot = dataclasses.replace(robot, dynamics=drive)
    tired = 1.0 - 0.2 * course
    slope = np.asarray(to_difference(drive, robot.sample_period).delta)[1, 0]
    return [
        _follow(drifting_log(robot, log, tired, 0.0 * course), "delta_21", slope * tired),
        _follow(drifting_log(robot, log, 1.0 + 0.0 * course, 0.1 * course), "dead_zone_r", 0.25 + 0.1 * course),
    ]


def _follow(log: Log, name: str, truth: Array) -> Drift:
    found = identify(log, "paper", forgetting=FORGETTING, reading="one_step")
    column = DIFFERENCE_ORDER.index(name)
    late = slice(len(log.t) - len(found.history.parameters), None)
    return Drift(
        name,
        log.t[late],
        np.asarray(truth)[late],
        np.asarray(found.history.parameters[:, column]),
        np.asarray(found.history.standard_deviation[:, column]),
    )


def reproduce(robot: Model, reference: Model, *, seed: int = 0, seeds: int = 200) -> Reproduction:
    """The whole experiment on the third-order `robot`, scored against the simplified `reference`.

    Needs double precision.
    """
    key_input, key_noise = jax.random.split(jax.random.key(seed))
    log, levels = paper_log(robot, key_input), jnp.array(NOISE_LEVELS)
    with ThreadPoolExecutor() as both:  # most of the time is compilation, which runs side by side
        noise = both.submit(as_precise(noise_study), jax.tree.map(jnp.asarray, log), key_noise, levels, seeds)
        found = identify(log, "paper", reading="one_step")
        drifts = drift_study(robot, log)
        modelled = Log(*(np.asarray(column) for column in simulate(found.model, log)))
        prediction = predict(found.model, log, PREDICTED_ROWS)
        return Reproduction(robot, reference, log, found, modelled, prediction, noise.result(), drifts)


def count_closer(rows: list[Row]) -> int:
    """How many of our numbers lie closer to the truth than the paper's."""
    return sum(abs(row.ours - row.true) < abs(row.paper - row.true) for row in rows)

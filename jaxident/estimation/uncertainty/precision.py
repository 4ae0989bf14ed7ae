"""How well parameters can be known: Fisher information, the Cramer-Rao bound, and standard deviations from either."""

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import AT_REST, Array, DifferenceMatrix, State, StateVector, Unknowns, UnknownsMatrix
from jaxident.errors import InputError
from jaxident.estimation.poses.covariance import covariance_at
from jaxident.estimation.poses.curvature import Point, local_at
from jaxident.estimation.poses.parameters import Law, Robot, from_vector, names, to_vector
from jaxident.estimation.poses.runs import Runs, run_axes, stack_runs, with_room, with_wheels
from jaxident.estimation.uncertainty.verdict import Verdict, verdicts_of
from jaxident.log import Log, join
from jaxident.numerics import require_float64
from jaxident.robot.difference import to_difference
from jaxident.robot.drive import Physical
from jaxident.robot.model import DIFFERENCE_ORDER, Model, Spread, difference_vector, require_physical
from jaxident.robot.noise import Noise
from jaxident.robot.simulate import run_physical
from jaxident.robot.wheel_sensor import WheelSensor, wheel_rates


class Bound(NamedTuple):
    """The Cramér-Rao bound: no unbiased estimator does better.

    Attributes:
        order: names of the physical parameters and the noise law.
        covariance: (n, n) in that order.
        standard_deviation: (n,) in that order.
        difference_order: names of the twelve numbers of (13)-(14) with their dead zones.
        difference_covariance: (12, 12), to first order.
        difference_deviation: (12,), to first order.
        verdicts: whether this input determines each physical parameter.
    """

    order: tuple[str, ...]
    covariance: Any
    standard_deviation: Any
    difference_order: tuple[str, ...]
    difference_covariance: Any
    difference_deviation: Any
    verdicts: list[Verdict]


def cramer_rao(model: Model, inputs: Log | Sequence[Log], noise: Noise, *, start: State = AT_REST) -> Bound:
    """Compute the Cramér-Rao bound: the smallest covariance that an unbiased estimator can have.

    The bound is the inverse of the Fisher information, which comes from the simulator by automatic differentiation.
    Five start states per run and the noise law count as unknowns. With slip the information is that of the innovations
    along the path without it. Needs double precision.

    Args:
        model: the robot.
        inputs: commands and times. Rows without a pose count as not measured, unless no row has one. Wheel speeds count
            where the inputs have them, or at all rows where their columns are empty throughout.
        noise: of the camera and of slip; position and heading above 0.
        start: state at the first row of each run.

    Returns:
        Bound: covariance and standard deviation of each parameter, in natural units and as difference equations, and
            whether this input determines the parameter.

    Raises:
        InputError: a model of free numerators, a camera or wheel speeds without noise, wheel speeds of a model without
            `wheels`.

    Examples:
        >>> import jax, jaxident as ji
        >>> ji.start_jax()
        >>> robot = ji.load_model("published")
        >>> inputs = ji.excite(jax.random.key(0), "multilevel", 300, robot.sample_period)
        >>> bound = ji.cramer_rao(robot, inputs, ji.Noise(position=5e-4, heading=5e-3))
        >>> print(f"{bound.order[0]}: {bound.standard_deviation[0]:.5f}")
        rate_1: 0.00094
    """
    require_float64("cramer_rao")
    drive = require_physical(model)
    if not (float(noise.position) > 0.0 and float(noise.heading) > 0.0):
        raise InputError("noise: position and heading must be above 0; without noise there is no bound")
    log = Log(*(np.asarray(column) for column in join(inputs)))
    runs = stack_runs(log)
    runs = runs if runs.seen.any() else runs._replace(seen=stack_runs(log._replace(x=log.t, y=log.t, theta=log.t)).seen)
    runs = _with_planned_wheels(model, runs, log)
    law = law_of(drive, noise, wheels=runs.wheels is not None)
    vector = to_vector(Robot(drive, model.dead_zone, noise, model.wheels), law)
    covariance = bound_covariance(vector, jnp.stack([jnp.asarray(s, float) for s in start]), with_room(runs), law)
    difference = difference_covariance(vector, covariance, model.sample_period, law)
    largest = max(float(np.max(np.abs(u))) for u in runs.command)
    values = natural_values(from_vector(vector, law), law)
    return Bound(
        names(law), covariance, jnp.sqrt(jnp.diagonal(covariance)),
        DIFFERENCE_ORDER, difference, jnp.sqrt(jnp.diagonal(difference)),
        verdicts_of(names(law), np.asarray(values), np.asarray(covariance), largest),
    )  # fmt: skip


def _with_planned_wheels(model: Model, runs: Runs, log: Log) -> Runs:
    """The runs with the wheel speeds of a log that has their columns; all rows count where no row has one."""
    if log.wheel_r is None:
        return runs
    if model.wheels is None or not float(model.wheels.noise) > 0.0:
        raise InputError(
            "wheels: the inputs have wheel speeds, so the model needs wheels {radius, track, noise}, noise above 0; "
            "without these columns the bound is that of the poses alone"
        )
    blank = not (np.isfinite(log.wheel_r).any() or np.isfinite(log.wheel_l).any())
    return with_wheels(runs, log._replace(wheel_r=log.t, wheel_l=log.t) if blank else log)


def law_of(drive: Physical, noise: Noise, wheels: bool = False) -> Law:
    """The terms that a robot has, with wheel speeds or without."""
    return Law(
        wheels=wheels,
        coupling=drive.coupling is not None,
        memory=noise.correlation_time is not None,
        slip=bool(noise.slip_along > 0.0 or noise.slip_heading > 0.0),
    )


@partial(jax.jit, static_argnames="law")
def bound_covariance(vector: Unknowns, start: StateVector, runs: Runs, law: Law) -> UnknownsMatrix:
    """Covariance (unknowns, unknowns) by the information of runs (runs, rows), all from one start state (5,): pure,
    maps over trials. What they measured is not read."""
    robot = from_vector(vector, law)
    model = Model(0.0, robot.drive, robot.dead_zone)

    def path(run):
        step = run.step if jnp.ndim(run.step) == 0 else run.step[:-1]
        return run_physical(model, run.command, step, State(*start))

    states: State = jax.vmap(path, in_axes=(run_axes(runs),))(runs)
    point = Point(vector, jnp.tile(start, (len(runs.seen), 1)))
    exact = runs._replace(pose=states.pose)
    if law.wheels:
        exact = exact._replace(wheels=wheel_rates(robot.wheels, states.v, states.w))
    return covariance_at(point, local_at(point, exact, law), law)


@partial(jax.jit, static_argnames="law")
def natural_values(robot: Robot, law: Law) -> Unknowns:
    """The unknowns (unknowns,) of a robot in natural units, in the order of `names(law)`."""
    parts = [*robot.drive.rate, *(g for row in robot.drive.gain for g in row), *robot.dead_zone]
    parts += list(robot.drive.coupling) if law.coupling else []
    noise = robot.noise
    parts += [noise.position, noise.heading]
    parts += [noise.correlation_time] if law.memory else []
    parts += [noise.slip_along, noise.slip_heading] if law.slip else []
    parts += [] if robot.wheels is None or not law.wheels else list(robot.wheels)
    return jnp.stack([jnp.asarray(part) for part in parts])


@partial(jax.jit, static_argnames="law")
def difference_covariance(vector: Unknowns, covariance: UnknownsMatrix, period: Array, law: Law) -> DifferenceMatrix:
    """Covariance (12, 12) in DIFFERENCE_ORDER of the hold image at a period [s], carried to first order; the coupling
    is neglected as in the image itself."""

    def image(values):
        drive = Physical(values[:2], values[2:6].reshape(2, 2))
        return difference_vector(to_difference(drive, period), values[6:8])

    slope = jax.jacfwd(image)(natural_values(from_vector(vector, law), law)[:8])
    return slope @ covariance[:8, :8] @ slope.T


def spread_of(covariance: UnknownsMatrix, difference: DifferenceMatrix, law: Law) -> Spread:
    """Standard deviations in the shape of a model's parameters, from both covariances."""
    deviation = dict(zip(names(law), np.sqrt(np.diagonal(np.asarray(covariance))), strict=True))
    image = np.sqrt(np.diagonal(np.asarray(difference)))
    values = np.array(list(deviation.values()))
    return Spread(
        alpha=image[:2], delta=image[2:6].reshape(2, 2), epsilon=image[6:10].reshape(2, 2), dead_zone=image[10:],
        physical=Physical(values[:2], values[2:6].reshape(2, 2), values[8:10] if law.coupling else np.zeros(2)),
        noise=Noise(*(deviation.get(name) for name in Noise._fields)),
        wheels=WheelSensor(*(deviation[f"wheel_{name}"] for name in WheelSensor._fields)) if law.wheels else None,
    )  # fmt: skip

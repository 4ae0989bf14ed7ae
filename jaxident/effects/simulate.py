"""`ji.simulate`: the nominal program for a model without effects, the full one for a model with."""

from functools import partial

import jax
import numpy as np

from jaxident.array_types import AT_REST, Array, Pose, State, Wheels
from jaxident.effects.catalogue import CATALOGUE, to_vector
from jaxident.effects.checks import check_delay, check_effects
from jaxident.effects.full import run_full, run_states, substeps_for
from jaxident.effects.law_arrays import laws_of
from jaxident.effects.law_kinds import check_discovered
from jaxident.log import Log
from jaxident.robot import simulate as nominal
from jaxident.robot.drive import rim_motion
from jaxident.robot.model import Model, require_physical
from jaxident.robot.wheel_sensor import measure_wheels


def simulate(
    model: Model, log: Log, *, start: State = AT_REST, key: Array | None = None, session_time: Array = 0.0
) -> Log:
    """Simulate the log that a robot would have produced under the commands and times of a log.

    Differentiable in the model and the start.

    Args:
        model: the robot, with effects or without. One with `wheels` gives wheel speeds too; a wheel that slides turns
            faster than the ground.
        log: commands and times of one run, all arrays (samples,). Steps may differ, unless the model is one of free
            numerators.
        start: state at the first row.
        key: of slip, camera noise, wheel noise, random effects, and the angles at which wheels begin that a discovered
            law goes by. Without a key there is no noise, random effects do not act, and wheels begin at 0.
        session_time: time of the first row in the robot's session [s], for effects that drift.

    Returns:
        Log: the same rows with the poses of the model.

    Raises:
        InputError: a log of several runs; effects that `check_effects` refuses; a model of free numerators that has
            effects or wheels, or meets another period or an uneven one.

    Examples:
        >>> import jax, jaxident as ji
        >>> ji.start_jax()
        >>> robot = ji.load_model("published")
        >>> log = ji.simulate(robot, ji.excite(jax.random.key(0), "multilevel", 300, robot.sample_period))
        >>> log.x.shape
        (300,)
    """
    if model.wheels is not None:
        require_physical(model)
    if not (model.effects or model.discovered):
        made = nominal.simulate(model, log, start=start, key=key)
        return made if model.wheels is None else _with_wheels(model, made, start, key, session_time)
    check_effects(model.effects)
    check_discovered(model.discovered)
    nominal.check_one_run(log)
    require_physical(model)
    if not isinstance(log.t, jax.core.Tracer):
        t = np.asarray(log.t)
        check_delay(model.effects, float(t[-1] - t[0]))
    parts = frozenset(effect.name for effect in model.effects)
    vector = to_vector(model.effects)
    pose = _poses(model.dynamics, model.dead_zone, vector, log, start, model.noise, key, session_time,
                  laws_of(model.discovered), substeps=substeps_for(parts), parts=parts)  # fmt: skip
    made = log._replace(x=pose.x, y=pose.y, theta=pose.theta, wheel_r=None, wheel_l=None)
    return made if model.wheels is None else _with_wheels(model, made, start, key, session_time)


def is_random(model: Model) -> bool:
    """Whether one of the model's effects needs a key to act."""
    return any(CATALOGUE[effect.name].random for effect in model.effects)


def _with_wheels(model: Model, log: Log, start: State, key: Array | None, session_time: Array) -> Log:
    """The log with the wheel speeds of a model that has the sensor."""
    parts = frozenset(effect.name for effect in model.effects)
    wheels = drive_wheels(model.dynamics, model.dead_zone, to_vector(model.effects), log, start, key, session_time,
                          laws=laws_of(model.discovered), sensor=model.wheels, substeps=substeps_for(parts),
                          parts=parts)  # fmt: skip
    return log._replace(wheel_r=wheels.right, wheel_l=wheels.left)


@partial(jax.jit, static_argnames=("substeps", "parts"))
def drive_wheels(
    drive, dead_zone, vector, log: Log, start, key, session_time, *, laws, sensor, substeps, parts
) -> Wheels:
    """Measured wheel speeds (samples,) of one run: those of the drive, in which nothing slips at random and no camera
    is late; arguments as of `full.run_states`."""
    seen = frozenset(name for name in parts if not CATALOGUE[name].poses_only)
    states, excess = run_states(drive, dead_zone, vector, log.t, log.command, start, noise=None, key=key,
                                session_time=session_time, substeps=substeps, parts=seen, laws=laws)  # fmt: skip
    return measure_wheels(sensor, *rim_motion(drive, states.v, states.w, excess), key)


@partial(jax.jit, static_argnames=("substeps", "parts"))
def _poses(drive, dead_zone, vector, log: Log, start, noise, key, session_time, laws, *, substeps: int, parts) -> Pose:
    command = log.command
    return run_full(drive, dead_zone, vector, log.t, command, start, noise=noise, key=key, session_time=session_time,
                    substeps=substeps, parts=parts, laws=laws)  # fmt: skip

"""State and parameters in one extended Kalman filter on poses: a recursive estimator that stands camera noise.

States x, y, theta, v, w, the camera's errors where they have a memory, then log rates, gains and dead zones (Jazwinski
1970, section 8.4); before these the logarithms of radius and track of a robot that measures its wheels, whose speeds
then count as well. `step` is pure and jittable: the same function runs inside a scan, under `vmap`, and once per camera
frame on a robot.

Examples:
    >>> import dataclasses, jax, jaxident as ji
    >>> ji.start_jax()
    >>> robot = dataclasses.replace(ji.load_model("published"), noise=ji.Noise(position=5e-4, heading=5e-3))
    >>> inputs = ji.excite(jax.random.key(0), "multilevel", 300, robot.sample_period)
    >>> log = ji.simulate(robot, inputs, key=jax.random.key(1))
    >>> setup, rest = log[:200], log[200:]
    >>> state, step = ji.joint_filter.init(setup, d_max=0.9, memory=5.0), jax.jit(ji.joint_filter.step)
    >>> for row in zip(rest.t, rest.u_r, rest.u_l, *rest.pose):
    ...     state, info = step(state, ji.joint_filter.Sample(*row))
    >>> bool(info.ok)
    True
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array, Pose, PoseVector, RobotMatrix, RobotVector, Wheels
from jaxident.array_types import State as Motion
from jaxident.errors import InputError
from jaxident.estimation.online.joint_start import begin_from_model, begin_from_run, unsure
from jaxident.estimation.online.joint_step import (
    PARAMETERS,
    SENSOR_AT,
    Drift,
    advance_belief,
    take_in_pose,
    take_in_wheels,
)
from jaxident.estimation.poses.filter import Belief
from jaxident.estimation.poses.noise_law import NOISE_LAWS
from jaxident.estimation.poses.parameters import NAMES
from jaxident.estimation.poses.runs import Runs, stack_runs, with_wheels
from jaxident.log import Log, require_log
from jaxident.numerics import require_float64
from jaxident.robot.drive import Physical
from jaxident.robot.model import Model, require_physical
from jaxident.robot.noise import Noise
from jaxident.robot.wheel_sensor import WheelSensor

LIMIT, GATE = 10.0, 30.0
"""Standard deviations by which a pose may differ from what was expected: beyond LIMIT it counts no more than there,
beyond GATE not at all. A parameter that drifts takes innovations far past 3: a strict gate would stop the filter just
when it must learn."""
LOST_AFTER = 5
"""Poses in a row beyond the gate after which the filter looks for the robot anew."""
LOG_RATE = (-9.0, 7.0)
"""Bounds of the logarithm of a rate [1/s]."""


class Sample(NamedTuple):
    """One row of a log: its time [s], the command from now on, the pose now (NaN: not seen), and the measured wheel
    speeds [rad/s] (NaN: not measured), None for a robot without."""

    t: Any
    u_r: Any
    u_l: Any
    x: Any
    y: Any
    theta: Any
    wheel_r: Any = None
    wheel_l: Any = None


class State(NamedTuple):
    """What the next step needs: the belief, noise law and known coupling (2,) or None, how parameters drift, largest
    dead zone, command (2,) and time [s] of the last row, poses in a row beyond the gate, whether the start was sound;
    wheel_noise [rad/s], None without wheel speeds; radius and track are in the belief then.
    """

    belief: Belief
    noise: Noise
    coupling: Any
    drift: Drift
    d_max: Any
    command: Any
    t: Any
    strikes: Any
    sound: Any
    wheel_noise: Any = None


class Info(NamedTuple):
    """What one row taught: prediction errors over their standard deviations (x, y, theta; 0 where not seen), whether
    the pose was used, whether the filter began to look for the robot anew, and whether the estimate can be trusted:
    sound start, valid row, finite numbers, no negative variance, not lost."""

    error: Pose
    used: Any
    lost: Any
    ok: Any


def init(log: Log, *, d_max: Array, memory: Array = jnp.inf, noise_law: str = "white") -> State:
    """State after a setup log of one run: maximum likelihood on it under a named noise law (`NOISE_LAWS`).

    d_max: largest dead zone [unit of the command]. memory [s]: how long the parameters remember; infinite for a robot
    that does not change. A change is followed after about one memory of rich input. A log that leaves a parameter open,
    such as one with a single level above a dead zone, gives a state that is never `ok`. Of a log with wheel speeds
    radius and track are found, too. InputError for an unknown law or several runs. Needs double precision.
    """
    require_float64("joint_filter.init")
    require_log(log, "joint_filter.init")
    if noise_law not in NOISE_LAWS:
        raise InputError(f"noise law {noise_law!r}: choose from {', '.join(NOISE_LAWS)}")
    if len(log.runs()) != 1:
        raise InputError(f"the setup log holds {len(log.runs())} runs: the recursion begins at the end of one")
    log = Log(*(np.asarray(column) for column in log))
    runs = stack_runs(log) if log.wheel_r is None else with_wheels(stack_runs(log), log)
    run = jax.tree.map(lambda leaf: leaf if np.ndim(leaf) == 0 else leaf[0], runs)
    state = start(run, jnp.asarray(d_max, float), memory, noise_law)
    return state._replace(t=jnp.asarray(log.t[-1], float))


def init_from_model(model: Model, t: Array, *, d_max: Array, memory: Array = jnp.inf) -> State:
    """State before the first row, at a time t [s] that lies before it: parameters and their covariance from a model,
    the pose from the first one seen; wheel speeds count where the model has `wheels` with noise. InputError for a model
    without physical parameters, covariance or noise."""
    require_float64("joint_filter.init_from_model")
    belief, noise, widest, wheel_noise = begin_from_model(model, d_max)
    coupling = require_physical(model).coupling
    return _state(belief, noise, coupling, widest, d_max, memory, jnp.zeros(2), t, LOST_AFTER, True, wheel_noise)


def start(run: Runs, d_max: Array, memory: Array, noise_law: str) -> State:
    """State after a setup run (rows,), its last row at time 0; pure, maps over trials."""
    law = NOISE_LAWS[noise_law]._replace(wheels=run.wheels is not None)
    belief, noise, widest, ok, wheel_noise = begin_from_run(run, d_max, law)
    command = jnp.stack([column[-1] for column in run.command])
    return _state(belief, noise, None, widest, d_max, memory, command, 0.0, 0, ok, wheel_noise)


def step(state: State, sample: Sample) -> tuple[State, Info]:
    """Take one log row: the last command acts until now, the pose corrects, the command opens the next step.

    A row that is not later than the last one, or that gives anything but finite numbers, leaves the belief as it was;
    a missing command is the last one still.
    """
    passed = sample.t - state.t
    later = passed > 0.0
    held = jnp.where(later, passed, 1.0)
    expected = advance_belief(state.belief, state.command, held, state.noise, state.coupling, state.drift)
    pose = jnp.stack([jnp.asarray(part, float) for part in (sample.x, sample.y, sample.theta)])
    seen = jnp.all(jnp.isfinite(pose)) & later
    pose = jnp.where(seen, pose, 0.0)
    lost = seen & (state.strikes >= LOST_AFTER)
    expected = _choose(lost, _search_at(expected, pose, state.noise), expected)
    corrected, error = take_in_pose(expected, pose, seen, state.noise, LIMIT)
    used = seen & jnp.all(jnp.abs(error) < GATE)
    belief = _choose(used, corrected, expected)
    if state.wheel_noise is not None and sample.wheel_r is not None:
        speeds = Wheels(sample.wheel_r, sample.wheel_l)
        belief = take_in_wheels(belief, state.wheel_noise, state.noise, speeds, held, later, LIMIT)
    belief = _bounded(belief, state.d_max)
    good = later & jnp.all(jnp.isfinite(belief.mean)) & jnp.all(jnp.isfinite(belief.covariance))
    command = jnp.stack([jnp.asarray(sample.u_r, float), jnp.asarray(sample.u_l, float)])
    after = state._replace(
        belief=_choose(good, belief, state.belief),
        command=jnp.where(jnp.isfinite(command) & later, command, state.command),
        t=jnp.where(later, sample.t, state.t),
        strikes=jnp.where(seen, jnp.where(used, 0, state.strikes + 1), state.strikes),
    )
    positive = jnp.all(jnp.diagonal(after.belief.covariance) >= 0.0)  # rounding can break it where nothing is noisy
    ok = state.sound & good & positive & ~lost & (after.strikes < LOST_AFTER)
    return after, Info(Pose(*error), used & good, lost, ok)


def estimate(state: State) -> tuple[RobotVector, RobotMatrix]:
    """Rates [1/s], gains and dead zones (8,) in the order of `parameters.NAMES`, and their covariance (8, 8)."""
    values = state.belief.mean[-PARAMETERS:]
    scale = jnp.concatenate([jnp.exp(values[:2]), jnp.ones(PARAMETERS - 2)])
    natural = jnp.concatenate([scale[:2], values[2:]])
    return natural, state.belief.covariance[-PARAMETERS:, -PARAMETERS:] * scale * scale[:, None]


def to_model(state: State, sample_period: float) -> Model:
    """The present estimate as a model, its difference equations at a sample period [s]."""
    values, covariance = estimate(state)
    drive = Physical(values[:2], values[2:6].reshape(2, 2), state.coupling)
    order = NAMES[:PARAMETERS]
    return Model(sample_period, drive, values[6:], state.noise, covariance=covariance, parameter_order=order,
                 wheels=sensor_of(state))  # fmt: skip


def sensor_of(state: State) -> WheelSensor | None:
    """The sensor of wheel speeds as it is known now, None without."""
    if state.wheel_noise is None:
        return None
    radius, track = jnp.exp(state.belief.mean[SENSOR_AT])
    return WheelSensor(radius, track, state.wheel_noise)


def _state(belief, noise, coupling, widest, d_max, memory, command, t, strikes, sound, wheel_noise) -> State:
    """A state whose leaves have the types that `step` gives back."""
    noise, coupling, memory, d_max, t, wheel_noise = jax.tree.map(
        lambda value: jnp.asarray(value, float), (noise, coupling, memory, d_max, t, wheel_noise)
    )
    sound = jnp.asarray(sound) & jnp.all(jnp.isfinite(belief.covariance))
    strikes = jnp.asarray(strikes, int)
    return State(belief, noise, coupling, Drift(memory, widest), d_max, command, t, strikes, sound, wheel_noise)


def _search_at(belief: Belief, pose: PoseVector, noise: Noise) -> Belief:
    """The belief of a robot that may be anywhere near a pose at any speed; what is known of its parameters stays."""
    free = unsure(Motion(pose[0], pose[1], pose[2], 0.0, 0.0), noise)
    states = len(free.mean)
    covariance = belief.covariance.at[:states].set(0.0).at[:, :states].set(0.0)
    return Belief(belief.mean.at[:states].set(free.mean), covariance.at[:states, :states].set(free.covariance))


def _bounded(belief: Belief, d_max: Array) -> Belief:
    """Dead zones within [0, d_max], rates within LOG_RATE, and a covariance that is symmetric to the last bit."""
    mean = belief.mean.at[-2:].set(jnp.clip(belief.mean[-2:], 0.0, d_max))
    mean = mean.at[-PARAMETERS : 2 - PARAMETERS].set(jnp.clip(mean[-PARAMETERS : 2 - PARAMETERS], *LOG_RATE))
    return Belief(mean, 0.5 * (belief.covariance + belief.covariance.T))


def _choose(condition: Array, one: Belief, other: Belief) -> Belief:
    return Belief(*(jnp.where(condition, a, b) for a, b in zip(one, other, strict=True)))

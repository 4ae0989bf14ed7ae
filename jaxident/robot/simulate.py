"""The nominal simulator: commands in, true states and camera poses out."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp

from jaxident.array_types import AT_REST, Array, Increment, PerWheel, Pose, Samples, State, Wheels
from jaxident.errors import InputError
from jaxident.log import EVEN_TOLERANCE, Log, even_period, first_rows
from jaxident.robot.dead_zone import effective_command
from jaxident.robot.difference import Difference, predict_increment
from jaxident.robot.drive import Force, Hold, Physical, advance, force, hold
from jaxident.robot.model import Model, require_physical
from jaxident.robot.noise import UnitNoise, draw_noise, draw_white, observe, slip
from jaxident.robot.path_length import follow


def simulate(model: Model, log: Log, *, start: State = AT_REST, key: Array | None = None) -> Log:
    """The log that `model` would have produced under the commands and times of `log` (one run, all arrays (samples,)).

    Noise-free without a key; with one, slip and camera noise are drawn by the model's noise law. Steps may differ
    for a physical model; a model of free numerators refuses a log of another or an uneven period (InputError), and
    both refuse a log of several runs, each of which has a start of its own. Differentiable in the model and the
    start. Wheel speeds are none of its columns. Needs double precision only for long runs.
    """
    if model.effects:
        raise InputError(f"effect {model.effects[0].name!r}: this simulator runs nominal models only")
    check_one_run(log)
    if not isinstance(model.dynamics, Physical):
        check_period(model, log)
    pose = _poses(model, log.t, log.command, start, None if model.noise is None else key)
    return log._replace(x=pose.x, y=pose.y, theta=pose.theta, wheel_r=None, wheel_l=None)


@jax.jit
def _poses(model: Model, t: Samples, command: Wheels, start: State, key: Array | None) -> Pose:
    unit = None if key is None else draw_noise(key, len(t))
    if isinstance(model.dynamics, Physical):
        step = jnp.diff(t)
        pose = run_physical(model, command, step, start, unit).pose
    else:
        step = model.sample_period
        pose = run_difference(model.dynamics, model.dead_zone, command, start, model.sample_period)
    if key is None or unit is None or model.noise is None:
        return pose
    return observe(pose, model.noise, unit, step, draw_white(model.noise, key, len(t)))


def run_physical(model: Model, command: Wheels, step: Array, start: State, unit: UnitNoise | None = None) -> State:
    """States (samples,) at the rows of a run; step [s] is a scalar, or (samples - 1,) from each row to the next."""
    drive = require_physical(model)
    shove = None
    if unit is not None and model.noise is not None:
        shove = slip(model.noise, unit, jnp.append(step, 1.0) if jnp.ndim(step) else step)

    def pull_of(row: tuple[Wheels, Force | None]) -> Force:
        command, shove = row
        pull = force(drive, effective_command(command, model.dead_zone))
        return pull if shove is None else Force(pull.along + shove.along, pull.heading + shove.heading)

    return _run(hold(drive, jnp.asarray(step)), (command, shove), pull_of, start)


def run_forces(solution: Hold, pull: Force, start: State) -> State:
    """States (samples,) at the rows of a run under forces (samples,), of which the last acts on nothing any more;
    `solution` is that of one step, or of each (samples - 1,)."""
    return _run(solution, pull, lambda row: row, start)


def _run(solution: Hold, rows: Any, pull_of: Callable[[Any], Force], start: State) -> State:
    """States (samples,) under the forces that follow from each of the rows, leaves (samples,).

    Trials may follow on a last axis, as in hot paths: every row of the scan then works on contiguous trials and
    gives one row of the result, and nothing is joined or transposed afterwards, which would cost as much again. Forces
    are made inside the scan, where they stay in the cache: a fifth less time than arrays of them made before.
    """
    even = jnp.ndim(solution.step) == 0
    first = jax.tree.leaves(rows)[0]

    def body(state, now):
        row, own, last = now
        pull = Force(*(jnp.where(last, 0.0, f) for f in pull_of(row)))  # a last command may be missing
        return advance(state, pull, solution if even else own), state

    last = jnp.arange(len(first)) == len(first) - 1
    steps = None if even else jax.tree.map(lambda leaf: jnp.append(leaf, 1.0), solution)
    start = State(*(s + jnp.zeros_like(first[0]) for s in start))
    return jax.lax.scan(body, start, (rows, steps, last))[1]


def run_difference(difference: Difference, dead_zone: PerWheel, command: Wheels, start: State, period: Array) -> Pose:
    """Poses (samples,) by PAPER (13)-(14); before the first row nothing was commanded and the speed was `start`'s."""
    first = Increment(jnp.asarray(start.v) * period, jnp.asarray(start.w) * period)
    return follow(start.pose, free_run(difference, dead_zone, command, first))


def free_run(difference: Difference, dead_zone: PerWheel, command: Wheels, before: Increment) -> Increment:
    """Increments (samples - 1,) between the rows, each from the model's own last one; `before` is the one that ended
    at the first row, when nothing was commanded yet."""
    passed = effective_command(Wheels(*(jnp.asarray(u)[:-1] for u in command)), dead_zone)
    passed_before = Wheels(*(jnp.concatenate([jnp.zeros_like(m[:1]), m[:-1]]) for m in passed))

    def body(last, now):
        new = predict_increment(difference, last, *now)
        return new, new

    before = Increment(*(b + jnp.zeros(passed.right.shape[1:]) for b in before))
    return jax.lax.scan(body, before, (passed, passed_before))[1]


def check_period(model: Model, log: Log) -> None:
    """InputError unless the log is even at the model's own period; needs concrete times, so traced ones pass."""
    if isinstance(log.t, jax.core.Tracer) or isinstance(model.sample_period, jax.core.Tracer):
        return
    period = even_period(log)
    if abs(period - float(model.sample_period)) > EVEN_TOLERANCE * float(model.sample_period):
        raise InputError(
            f"sample_period: the model has free numerators and lives at {float(model.sample_period):.6g} s, "
            f"the log has {period:.6g} s; identify a physical model, or convert the log to the model's period"
        )


def check_one_run(log: Log) -> None:
    """InputError for a log of several runs; traced run numbers pass."""
    if isinstance(log.run, jax.core.Tracer):
        return
    runs = first_rows(log).sum()
    if runs > 1:
        raise InputError(f"the log holds {runs} runs, each with a start of its own: simulate `log.runs()` one by one")

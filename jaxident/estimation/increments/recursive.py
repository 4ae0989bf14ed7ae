"""Recursive least squares on the dead-zone regressors (15)-(18): the paper's estimator, one log row at a time.

`step` is pure and jittable: the same function runs inside `run`, under `vmap`, and once per camera frame on a robot.

Examples:
    >>> import jax, jaxident as ji
    >>> ji.start_jax()
    >>> robot = ji.load_model("published")
    >>> log = ji.simulate(robot, ji.excite(jax.random.key(0), "multilevel", 300, robot.sample_period))
    >>> state, step, rest = ji.recursive.init(log[:200], d_max=0.9), jax.jit(ji.recursive.step), log[200:]
    >>> for row in zip(rest.u_r, rest.u_l, *rest.pose):
    ...     state, info = step(state, ji.recursive.Sample(*row))
    >>> ji.recursive.parameters(ji.recursive.unpack(state).estimate)[1].round(2).tolist()
    [0.25, 0.2]
"""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Increment, Pose, Wheels
from jaxident.estimation.increments.initialise import initialise
from jaxident.estimation.increments.least_squares import LOWER, Equation, equation_from, update
from jaxident.estimation.increments.observations import Observations, observe_log, tail
from jaxident.estimation.increments.regressors import UNKNOWNS, Memory, Vector, empty_memory, next_row
from jaxident.log import Log, require_log
from jaxident.numerics import require_float64, safe_divide
from jaxident.robot.difference import Difference
from jaxident.robot.path_length import increment_between

CLEAR_OF_ZERO = 0.1
"""A numerator coefficient below this part of its start value is too small to divide by."""


class Estimate(NamedTuple):
    """What the recursion carries: both equations, the averaged dead zones, the past, and its two settings.

    smallest holds, per equation and wheel, the size below which a numerator coefficient gives no dead zone.
    """

    length: Equation
    turn: Equation
    dead_zone: Wheels
    memory: Memory
    smallest: tuple[Wheels, Wheels]
    forgetting: Any
    d_max: Any


class Stream(NamedTuple):
    """An estimate with the last two commands and the last measured pose: enough to take the next log row."""

    estimate: Estimate
    command: Wheels
    command_before: Wheels
    pose: Pose
    posed: Any


class State(NamedTuple):
    """A Stream in two arrays of 59 numbers: the call of a compiled function takes some microseconds for every array
    that it passes, and a stream has 118; where one has 512 bytes or more, XLA's CPU runtime hands single kernels to
    other threads, which takes longer than they do. `unpack` opens it."""

    first: Any
    second: Any


_NOTHING = Equation((0.0,) * UNKNOWNS, (0.0,) * len(LOWER), (0.0,) * UNKNOWNS)
_STILL = Wheels(0.0, 0.0)
_EMPTY = Stream(
    Estimate(_NOTHING, _NOTHING, _STILL, empty_memory(), (_STILL, _STILL), 0.0, 0.0),
    _STILL, _STILL, Pose(0.0, 0.0, 0.0), False,
)  # fmt: skip
"""What `unpack` takes the structure from."""


class Sample(NamedTuple):
    """One row of a log: the command from now on, the pose now (NaN: not seen)."""

    u_r: Any
    u_l: Any
    x: Any
    y: Any
    theta: Any


class Info(NamedTuple):
    """What one row taught: prediction errors [m, rad], their variance over the noise variance, whether it was used."""

    error: Increment
    scale: Increment
    used: Any


def absorb(estimate: Estimate, sample: Observations) -> tuple[Estimate, Info]:
    """The estimate after one sample."""
    row, memory = next_row(
        estimate.memory, (estimate.length.unknowns, estimate.turn.unknowns), estimate.dead_zone, sample
    )
    length, *length_info = update(estimate.length, row.length, row.increment.length, estimate.forgetting)
    turn, *turn_info = update(estimate.turn, row.turn, row.increment.turn, estimate.forgetting)
    used = row.usable
    if used is not None:
        length, turn = jax.tree.map(
            lambda new, old: jnp.where(used, new, old), (length, turn), (estimate.length, estimate.turn)
        )
    after = estimate._replace(length=length, turn=turn, memory=memory)
    error, scale = (Increment(*pair) for pair in zip(length_info, turn_info, strict=True))
    return after._replace(dead_zone=average_dead_zone(after)), Info(error, scale, True if used is None else used)


def dead_zone_ratios(estimate: Estimate) -> tuple[Wheels, Wheels]:
    """D' and D'': each equation's own dead zones, unbounded; the last average where the denominator is 0."""

    def wheel(equation: Equation, slope: int, last: Array) -> Array:
        return safe_divide(equation.unknowns[slope + 1], equation.unknowns[slope], last)

    length, turn = (
        Wheels(wheel(e, 1, estimate.dead_zone.right), wheel(e, 4, estimate.dead_zone.left))
        for e in (estimate.length, estimate.turn)
    )
    return length, turn


def average_dead_zone(estimate: Estimate) -> Wheels:
    """D = (D' + D'') / 2, each within [0, d_max]; a ratio whose denominator is not clear of zero keeps the last D."""
    slopes = tuple(Wheels(e.unknowns[1], e.unknowns[4]) for e in (estimate.length, estimate.turn))
    ratios = dead_zone_ratios(estimate)

    def wheel(k: int, last: Array) -> Array:
        kept = (
            jnp.where(jnp.abs(slope[k]) > size[k], ratio[k], last)
            for slope, size, ratio in zip(slopes, estimate.smallest, ratios, strict=True)
        )
        return 0.5 * sum(jnp.clip(ratio, 0.0, estimate.d_max) for ratio in kept)

    return Wheels(wheel(0, estimate.dead_zone.right), wheel(1, estimate.dead_zone.left))


def start(difference: Difference, dead_zone: Array, setup: Observations, d_max: Array, forgetting: Array) -> Estimate:
    """The estimate at the end of the setup time: given parameters, covariance and memory from the setup's samples."""
    width = Wheels(dead_zone[0], dead_zone[1])
    unknowns = tuple(_unknowns(difference, row, width) for row in range(2))
    complete = setup.measured is None
    first = Memory(Increment(setup.increment.length[0], setup.increment.turn[0])) if complete else empty_memory()
    memory, information = _information(unknowns, width, first, tail(setup, 1) if complete else setup)
    slopes = CLEAR_OF_ZERO * jnp.abs(jnp.asarray(difference.delta))
    smallest = Wheels(*slopes[0]), Wheels(*slopes[1])
    length, turn = (equation_from(*pair) for pair in zip(unknowns, information, strict=True))
    return Estimate(length, turn, width, memory, smallest, jnp.asarray(forgetting) * 1.0, jnp.asarray(d_max) * 1.0)


def run(estimate: Estimate, observations: Observations) -> tuple[Estimate, tuple[Estimate, Info]]:
    """All samples in one scan: the last estimate, and the estimate and Info after each sample (samples,)."""

    def body(estimate, sample):
        estimate, info = absorb(estimate, sample)
        return estimate, (estimate, info)

    return jax.lax.scan(body, estimate, observations)


def init(log: Log, *, d_max: Array, forgetting: Array = 1.0, reading: str = "one_step") -> State:
    """State from the setup log (section VI): batch estimate, its covariance, and the last row's command and pose."""
    require_float64("recursive.init")
    require_log(log, "recursive.init")
    return _first_state(Log(*(jnp.asarray(column) for column in log)), d_max, forgetting, reading)


@partial(jax.jit, static_argnames="reading")
def _first_state(log: Log, d_max: Array, forgetting: Array, reading: str) -> State:
    """`init` as one program: 6 s for a first call and 2 ms for others; operation by operation 9 and 5 s."""
    observations = observe_log(log)
    setup = initialise(observations, d_max=d_max, reading=reading)
    estimate = start(setup.difference, setup.dead_zone, observations, d_max, forgetting)
    seen = jnp.isfinite(log.x)
    last = jnp.max(jnp.where(seen, jnp.arange(len(log.t)), -1))
    pose = Pose(*(column[last] for column in log.pose))
    command, before = (Wheels(log.u_r[k], log.u_l[k]) for k in (-1, -2))
    return pack(Stream(estimate, command, before, pose, last >= 0))


def step(state: State, sample: Sample) -> tuple[State, Info]:
    """Take one log row: the pose closes the sample begun by the last row's command, the command opens the next."""
    before = unpack(state)
    pose = Pose(sample.x, sample.y, sample.theta)
    seen = jnp.isfinite(pose.x) & jnp.isfinite(pose.y) & jnp.isfinite(pose.theta)
    measured = seen & before.posed
    pose = Pose(*(jnp.where(seen, new, old) for new, old in zip(pose, before.pose, strict=True)))
    moved = increment_between(
        Pose(*(jnp.where(measured, p, 0.0) for p in before.pose)), Pose(*(jnp.where(measured, p, 0.0) for p in pose))
    )
    observation = Observations(before.command, before.command_before, moved, seen, measured, False, True)
    estimate, info = absorb(before.estimate, observation)
    command = Wheels(sample.u_r, sample.u_l)
    return pack(Stream(estimate, command, before.command, pose, before.posed | seen)), info


def pack(stream: Stream) -> State:
    """The stream as two arrays (59,), conditions as 0 and 1."""
    leaves = [jnp.asarray(leaf, float) for leaf in jax.tree.leaves(stream)]
    half = len(leaves) // 2
    return State(jnp.stack(leaves[:half]), jnp.stack(leaves[half:]))


def unpack(state: State) -> Stream:
    """The stream inside a state."""
    kinds, structure = jax.tree.flatten(_EMPTY)
    values = zip(kinds, (*state.first, *state.second), strict=True)
    return jax.tree.unflatten(structure, [value != 0.0 if isinstance(kind, bool) else value for kind, value in values])


def parameters(estimate: Estimate) -> tuple[Difference, Array]:
    """The parameters of (13)-(14) and the dead zones (2,) of an estimate."""
    rows = jnp.stack([jnp.stack(e.unknowns, axis=-1) for e in (estimate.length, estimate.turn)], axis=-2)
    difference = Difference(rows[..., 0], rows[..., (1, 4)], -rows[..., (3, 6)])
    return difference, jnp.stack(estimate.dead_zone, axis=-1)


def _unknowns(difference: Difference, row: int, width: Wheels) -> Vector:
    (slope_r, slope_l), (old_r, old_l) = difference.delta[row], difference.epsilon[row]
    return (difference.alpha[row], slope_r, width.right * slope_r, -old_r, slope_l, width.left * slope_l, -old_l)


def _information(unknowns, width: Wheels, memory: Memory, setup: Observations):
    """Memory after the setup, and per equation the sum of row row' over its usable samples, lower triangle."""

    def body(carry, sample):
        memory, sums = carry
        row, memory = next_row(memory, unknowns, width, sample)
        weight = 1.0 if row.usable is None else jnp.where(row.usable, 1.0, 0.0)
        products = (tuple(weight * r[i] * r[j] for i, j in LOWER) for r in (row.length, row.turn))
        return (memory, tuple(tuple(map(jnp.add, *pair)) for pair in zip(sums, products, strict=True))), None

    zero = 0.0 * setup.increment.length[0]
    memory = jax.tree.map(lambda m: m | (zero != 0.0) if isinstance(m, bool) else m + zero, memory)
    return jax.lax.scan(body, (memory, ((zero,) * len(LOWER),) * 2), setup)[0]


def run_to_end(estimate: Estimate, observations: Observations) -> Estimate:
    """As `run`, keeping the last estimate alone: for studies of many trials.

    Hot: samples first, trials on a last axis or under vmap, some hundred of them. Each of the 70 carried numbers is
    then a row of contiguous trials: fewer pay for the start of some ninety kernels a sample, more leave the cache.
    """
    return jax.lax.scan(lambda e, sample: (absorb(e, sample)[0], None), estimate, observations)[0]

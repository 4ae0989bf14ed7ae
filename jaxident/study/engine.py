"""From a study to arrays: cut into chunks, chunks into blocks of one shape, blocks over all cores and devices."""

import functools
import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import jax
import numpy as np

from jaxident.array_types import Wheels
from jaxident.effects.catalogue import to_vector
from jaxident.effects.law_arrays import IDLE, Laws, laws_of
from jaxident.numerics import require_float64
from jaxident.parallel import at_most, in_parallel, trials_at_once
from jaxident.robot.excitation import EXCITATIONS
from jaxident.robot.model import Model, require_physical
from jaxident.robot.wheel_sensor import WheelSensor
from jaxident.study.design import PARTS, Study
from jaxident.study.diagnosed import with_diagnoses
from jaxident.study.estimators import runs_alone
from jaxident.study.trial import Cell, Outcome, Plan, Recording, Robot, commands, record, run_trial

BLOCK = 50
"""Trials at once on a CPU: so few that their work stays in the cache."""

DIAGNOSED_AT_ONCE = 4
"""Trials of a chunk where they are diagnosed, half a minute's work: a study that is stopped loses its last chunk."""

TRIAL_BYTES, ROW_BYTES = 1e6, 4e3
"""What a graphics card is given for a trial of one estimator, and for each of its rows: on an H200 a whole trial of the
recursion took 0.3 MB with 1000 rows; what others take was not measured."""

STATIC = ("excitation", "samples")
"""Axes that the compiled program is fixed to: no chunk spans two of their entries."""

_KINDS = tuple(EXCITATIONS)
_record = jax.jit(record, static_argnames=("effects", "runs"))


class Piece(NamedTuple):
    """A part of an array: a slice per axis."""

    cut: tuple[Any, ...]

    @property
    def shape(self) -> tuple[int, ...]:
        """Length of each axis of the piece."""
        return tuple(part.stop - part.start for part in self.cut)


def chunk_shape(study: Study) -> tuple[int, ...]:
    """Lengths of a chunk on the study's axes: whole axes from the last one on, as long as its trials are not more than
    `study.chunk`."""
    room, shape = min(study.chunk, DIAGNOSED_AT_ONCE) if study.diagnoses else study.chunk, []
    for axis, length in zip(reversed(study.axes), reversed(study.shape), strict=True):
        size = 1 if axis in STATIC else max(1, min(length, room))
        room = room // size if size == length else 1
        shape.append(size)
    return tuple(reversed(shape))


def pieces(shape: Sequence[int], chunk: Sequence[int]) -> list[Piece]:
    """An array's chunks in their order, the last axis fastest."""
    counts = [range(-(-length // size)) for length, size in zip(shape, chunk, strict=True)]
    return [
        Piece(tuple(slice(k * c, min((k + 1) * c, n)) for k, c, n in zip(index, chunk, shape, strict=True)))
        for index in itertools.product(*counts)
    ]


def chunks(study: Study) -> list[Piece]:
    """The chunks of a study."""
    return pieces(study.shape, chunk_shape(study))


def run_chunk(study: Study, piece: Piece, cores: int | None = None) -> Outcome:
    """The trials of one chunk, as NumPy arrays of the chunk's shape; on `cores` threads, all cores by default.

    The same numbers whenever and wherever it runs on one type of machine: blocks have one shape, the last one filled
    up with copies of its last trial. Needs double precision.
    """
    require_float64("study")
    index = np.indices(piece.shape).reshape(len(piece.shape), -1) + np.array([[part.start] for part in piece.cut])
    with at_most(cores):
        outcome = with_diagnoses(study, _run(study, index, cores), lambda trial: _recording(study, index[:, trial]))
    return jax.tree.map(lambda part: part.reshape(*piece.shape, *part.shape[1:]), outcome)


def run_one(study: Study, number: int) -> tuple[Recording, Outcome]:
    """Trial `number`, counted along the study's axes with the last fastest, alone: its recording, and its outcome,
    which is bit by bit that in the whole study."""
    require_float64("study")
    index = np.array(np.unravel_index(number, study.shape))
    recording = _recording(study, index)
    outcome = _run(study, np.repeat(index[:, None], block_size(study), axis=1), 1)
    outcome = with_diagnoses(study, jax.tree.map(lambda part: part[:1], outcome), lambda trial: recording)
    return recording, jax.tree.map(lambda part: part[0], outcome)


def run_locally(study: Study, numbers: Sequence[int]) -> Iterator[tuple[int, Outcome]]:
    """The chunks of these numbers one after the other, each on all cores and devices of this machine."""
    cut = chunks(study)
    for number in numbers:
        yield number, run_chunk(study, cut[number])


def block_size(study: Study) -> int:
    """Trials of a block: fixed for a study, so that the program is compiled once for each run length."""
    each = len(study.estimators) * (TRIAL_BYTES + ROW_BYTES * max(study.samples) * study.runs)
    size = trials_at_once(BLOCK, each)
    return min(size, math.prod(chunk_shape(study))) * jax.local_device_count()


def cells(study: Study, index: np.ndarray) -> Cell:
    """The cells of trials whose indices on the study's axes are the columns of `index` (axes, trials)."""
    at = dict(zip(study.axes, index, strict=True))
    position = np.asarray(study.noise, float)[at["noise"]]
    memory = None if study.correlation_time is None else np.full(index.shape[1], float(study.correlation_time))
    return Cell(
        _robots(study, at["robot"], at.get("effect", np.zeros_like(at["robot"]))),
        np.asarray(study.period, float)[at["period"]],
        np.asarray(study.amplitude, float)[at["amplitude"]],
        position,
        study.heading_per_position * position,
        memory,
        at["seed"],
        np.array([_KINDS.index(kind) for kind in study.excitations])[at["excitation"]],
    )


def _run(study: Study, index: np.ndarray, cores: int | None) -> Outcome:
    """Trials at `index` (axes, trials) of one excitation and run length: arrays (trials, ...)."""
    size, count = block_size(study), index.shape[1]
    padded = np.concatenate([index, np.repeat(index[:, -1:], -count % size, axis=1)], axis=1)
    program = _program(study, size)(study.samples[index[1, 0]])
    base = jax.random.key(study.seed)

    def work(block: np.ndarray) -> Outcome:
        where = cells(study, block)
        return jax.tree.map(np.asarray, program(base, *_spread((where, _commands(study, block, where)))))

    blocks = [(block,) for block in np.split(padded, padded.shape[1] // size, axis=1)]
    if any(runs_alone(choice) for choice in study.estimators):
        cores = 1
    outcomes = in_parallel(work, blocks, cores)
    return jax.tree.map(lambda *parts: np.concatenate(parts)[:count], *outcomes)


def _recording(study: Study, place: np.ndarray) -> Recording:
    """The recording of one trial by its place on the study's axes (axes,), as NumPy arrays."""
    where = cells(study, place[:, None])
    command = Wheels(*(u[0] for u in _commands(study, place[:, None], where)))
    cell = jax.tree.map(lambda leaf: leaf[0], where)
    made = _record(jax.random.key(study.seed), cell, command, study.effect_names, study.runs)
    return jax.tree.map(np.asarray, made)._replace(runs=study.runs)


def _commands(study: Study, index: np.ndarray, where: Cell) -> Wheels:
    kind, samples = study.excitations[index[0, 0]], study.samples[index[1, 0]]
    return commands(jax.random.key(study.seed), where, kind, samples, study.hold, study.runs)


def _program(study: Study, size: int) -> Callable[[int], Callable[..., Outcome]]:
    """For a run length the compiled program of a block: the shapes of its arguments are those of any cell."""
    cell = cells(study, np.zeros((len(study.axes), size), int))
    leaves, tree = jax.tree.flatten(cell)
    shapes = tuple((leaf.shape, str(leaf.dtype)) for leaf in leaves)
    return lambda samples: _compiled(Plan(samples, study.runs, study.estimators, study.effect_names), tree, shapes)


@functools.lru_cache(maxsize=64)
def _compiled(plan: Plan, tree: Any, shapes: tuple[tuple[tuple[int, ...], str], ...]) -> Callable[..., Outcome]:
    """Compiled once for all threads, ahead of the first call: threads that come first would each compile it."""
    sharding = _sharding()
    leaves = [jax.ShapeDtypeStruct(shape, dtype, sharding=sharding) for shape, dtype in shapes]
    command = jax.ShapeDtypeStruct((shapes[0][0][0], plan.runs * plan.samples), float, sharding=sharding)
    program = jax.jit(jax.vmap(functools.partial(run_trial, plan), in_axes=(None, 0, 0)))
    base = jax.eval_shape(lambda: jax.random.key(0))
    return program.lower(base, jax.tree.unflatten(tree, leaves), Wheels(command, command)).compile()


def _sharding() -> jax.sharding.Sharding:
    """The trial axis cut over all devices of this machine."""
    mesh = jax.sharding.Mesh(np.array(jax.local_devices()), ("trials",))
    return jax.sharding.NamedSharding(mesh, jax.sharding.PartitionSpec("trials"))


def _spread(block: Any) -> Any:
    return jax.device_put(block, _sharding())


def _robots(study: Study, robot: np.ndarray, effect: np.ndarray) -> Robot:
    """The robots of trials whose places on these two axes (trials,) are given, each part as one array (trials, ...); a
    part that none in the study has is None."""
    models = [candidate.model for candidate in study.robots]
    drives = [require_physical(model) for model in models]
    coupled = any(drive.coupling is not None for drive in drives)
    slips = [(0.0, 0.0) if m.noise is None else (m.noise.slip_along, m.noise.slip_heading) for m in models]
    vectors = [[to_vector(effects) for effects in sets] for sets in study.in_force] if study.effect_names else None
    return Robot(
        np.array([drive.rate for drive in drives], float)[robot],
        np.array([drive.gain for drive in drives], float)[robot],
        np.array([np.zeros(2) if d.coupling is None else d.coupling for d in drives])[robot] if coupled else None,
        np.array([model.dead_zone for model in models], float)[robot],
        np.array(slips, float)[robot] if np.any(np.array(slips, float)) else None,
        np.array([candidate.spread for candidate in study.robots], float).reshape(-1, len(PARTS))[robot],
        None if vectors is None else np.array(vectors, float)[robot, effect],
        _laws(models, robot) if any(model.discovered for model in models) else None,
        None if any(model.wheels is None for model in models) else _sensors(models, robot),
    )


def _sensors(models: Sequence[Model], robot: np.ndarray) -> WheelSensor:
    """The sensors of wheel speeds of trials (trials,) whose places among the robots are given."""
    return WheelSensor(*(np.array([m.wheels[k] for m in models if m.wheels], float)[robot] for k in range(3)))


def _laws(models: Sequence[Model], robot: np.ndarray) -> Laws:
    """Discovered laws of trials (trials, laws, ...) whose places among the robots are given."""
    surfaces = any(law.second_signal for model in models for law in model.discovered)
    each = [laws_of(model.discovered or (IDLE,), surfaces=surfaces) for model in models]
    return Laws(*(np.stack(leaves)[robot] for leaves in zip(*each, strict=True)))

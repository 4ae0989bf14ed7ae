"""One trial of a study, a pure function of its key and its cell: robot, excitation, simulation, camera, estimators.

    seed_key = fold_in(key(study.seed), seed)       the robot, where it is drawn
    run_key  = fold_in(seed_key, excitation)        the excitation's draws and the unit noise of the first run
               split from it, folded in once more   those of each further run

Noise level, amplitude, robot, effects and estimator are in no key: all of them see the same random
numbers (common random numbers), so that differences between them are sharp. No trial depends on which others a study
holds.
"""

import functools
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import AT_REST, Array, Pose, Wheels
from jaxident.effects.catalogue import NEUTRAL
from jaxident.effects.full import disturb, run_undisturbed, substeps_for
from jaxident.effects.simulate import drive_wheels
from jaxident.log import Log, make_log
from jaxident.robot.drive import Physical
from jaxident.robot.excitation import EXCITATIONS
from jaxident.robot.model import Model, difference_vector
from jaxident.robot.noise import Noise, draw_noise, observe
from jaxident.robot.simulate import run_physical
from jaxident.robot.wheel_sensor import measure_wheels
from jaxident.study.estimators import estimate, see
from jaxident.study.sight import Choice, places_of_rows

FURTHER_RUN = 1 << 24
"""Added to the number of a run before it is folded into a key: the draws within a run fold in small numbers."""


class Robot(NamedTuple):
    """Parts of a robot: rate (2,), gain (2, 2), coupling (2,) or None, dead_zone (2,), slip (2,) along and in heading
    or None; spread (4,): the largest relative departure of each part, drawn anew for each seed; effects (parameters,):
    the catalogue's vector, or None where no trial of the study has any; laws: discovered ones, or None likewise;
    wheels: the sensor of wheel speeds, or None for robots that measure none."""

    rate: Any
    gain: Any
    coupling: Any
    dead_zone: Any
    slip: Any
    spread: Any
    effects: Any
    laws: Any
    wheels: Any = None


class Cell(NamedTuple):
    """Where in the study a trial lies, its numbers: period [s], amplitude, position and heading [m], [rad] of the
    camera's noise and its correlation time [s] or None, seed and excitation as whole numbers for the keys."""

    robot: Robot
    period: Any
    amplitude: Any
    position: Any
    heading: Any
    correlation_time: Any
    seed: Any
    excitation: Any


class Plan(NamedTuple):
    """What the compiled program of a trial is fixed to: rows of a run, runs of a trial; effects: names of those in
    force in any trial of the study."""

    samples: int
    runs: int
    estimators: tuple[Choice, ...]
    effects: frozenset[str]


class Outcome(NamedTuple):
    """estimate and deviation (estimators, 12), truth (12,), all in DIFFERENCE_ORDER, and reason (estimators,): indices
    of `sight.REASONS`. What diagnoses say (`study.diagnosed`), None in studies without: verdict (estimators,),
    takes_part, named and alike (estimators, effects)."""

    estimate: Any
    deviation: Any
    truth: Any
    reason: Any
    verdict: Any = None
    takes_part: Any = None
    named: Any = None
    alike: Any = None


class Recording(NamedTuple):
    """What a trial's estimators are given, and what is true: commands and poses (rows,) of its runs, one after the
    other, the robot. The exact poses hold everything but the camera's random errors. wheels: measured wheel speeds,
    None of robots without. runs: how many, all of one length."""

    command: Wheels
    measured: Pose
    exact: Pose
    robot: Model
    wheels: Wheels | None = None
    runs: int = 1

    def log(self, exact: bool = False) -> Log:
        """What a camera, and wheels where they are measured, tell of the trial; or the exact poses."""
        run, row = places_of_rows(self.runs, len(self.measured.x))
        pose, wheels = (self.exact, None) if exact else (self.measured, self.wheels)
        return make_log(float(self.robot.sample_period) * row, *self.command, *pose, run, *(wheels or ()))


def seed_keys(base: Array, cell: Cell) -> tuple[Array, Array, Array]:
    """Keys of the robot, of the excitation and of the noise of the first run; `base` is the study's key."""
    seed_key = jax.random.fold_in(base, cell.seed)
    key_robot, key_runs = jax.random.split(seed_key)
    key_input, key_noise = jax.random.split(jax.random.fold_in(key_runs, cell.excitation))
    return key_robot, key_input, key_noise


def _keys_of_runs(key: Array, runs: int) -> Array:
    """The key of the first run, and one of each further run."""
    further = jax.vmap(lambda run: jax.random.fold_in(key, FURTHER_RUN + run))(jnp.arange(1, runs))
    return jnp.concatenate([key[None], further])


@functools.partial(jax.jit, static_argnames=("kind", "samples", "hold", "runs"))
def commands(base: Array, cells: Cell, kind: str, samples: int, hold: int, runs: int = 1) -> Wheels:
    """Commands (trials, runs * samples) of trials that share a kind of excitation; runs one after the other."""

    def one(cell: Cell) -> Wheels:
        _, key, _ = seed_keys(base, cell)
        made = jax.vmap(lambda own: EXCITATIONS[kind](own, samples, cell.amplitude, hold))(_keys_of_runs(key, runs))
        return jax.tree.map(jnp.ravel, made)

    return jax.vmap(one)(cells)


def record(base: Array, cell: Cell, command: Wheels, effects: frozenset[str] = frozenset(), runs: int = 1) -> Recording:
    """Simulate one trial under given commands (runs * samples,), each run from rest, and let the camera look. Effects
    that drift go on from run to run."""
    key_robot, _, key = seed_keys(base, cell)
    robot = draw_robot(key_robot, cell)
    if runs == 1:
        measured, exact, wheels = _record_run(robot, cell, command, key, 0.0, effects)
        return Recording(command, measured, exact, robot, wheels)
    each = Wheels(*(u.reshape(runs, -1) for u in command))
    begin = jnp.arange(runs) * (each.right.shape[1] - 1) * cell.period
    of_runs = jax.vmap(lambda u, own, since: _record_run(robot, cell, u, own, since, effects))
    measured, exact, wheels = jax.tree.map(jnp.ravel, of_runs(each, _keys_of_runs(key, runs), begin))
    return Recording(command, measured, exact, robot, wheels, runs)


def _record_run(
    robot: Model, cell: Cell, command: Wheels, key: Array, begin: Array, effects: frozenset[str]
) -> tuple[Pose, Pose, Wheels | None]:
    """Measured and exact poses and wheel speeds (samples,) of one run that begins at a session time [s]: by the nominal
    simulator, or the full one where trials of the study have `effects` (their names) or discovered laws."""
    law, wheels = Noise(cell.position, cell.heading, cell.correlation_time), None
    if not effects and cell.robot.laws is None:
        unit = draw_noise(key, len(command.right))
        exact = run_physical(robot, command, cell.period, AT_REST, unit).pose
        if robot.wheels is not None:
            drive = run_physical(robot, command, cell.period, AT_REST)  # random slip comes after the wheel
            wheels = measure_wheels(robot.wheels, drive.v, drive.w, key)
        return observe(exact, law, unit, cell.period), exact, wheels
    t, vector = cell.period * jnp.arange(len(command.right)), cell.robot.effects
    vector = NEUTRAL if vector is None else vector
    settings: Any = {"substeps": substeps_for(effects), "parts": effects, "laws": cell.robot.laws}
    exact = run_undisturbed(robot.dynamics, robot.dead_zone, vector, t, command, AT_REST, noise=robot.noise, key=key,
                            session_time=begin, **settings)  # fmt: skip
    if robot.wheels is not None:
        made = make_log(t, *command)
        wheels = drive_wheels(robot.dynamics, robot.dead_zone, vector, made, AT_REST, key, begin, sensor=robot.wheels,
                              **settings)  # fmt: skip
    return disturb(exact, vector, t, noise=law, key=key, parts=effects), exact, wheels


def draw_robot(key: Array, cell: Cell) -> Model:
    """The trial's robot: every number of every part moved by its own uniform draw within the part's spread."""
    values = cell.robot
    parts = (values.rate, values.gain, values.coupling, values.dead_zone)
    rate, gain, coupling, dead_zone = (
        None if part is None else part * (1.0 + width * jax.random.uniform(k, jnp.shape(part), minval=-1.0))
        for k, part, width in zip(jax.random.split(key, 4), parts, values.spread, strict=True)
    )
    noise = None if values.slip is None else Noise(slip_along=values.slip[0], slip_heading=values.slip[1])
    return Model(cell.period, Physical(rate, gain, coupling), dead_zone, noise, wheels=values.wheels)


def run_trial(plan: Plan, base: Array, cell: Cell, command: Wheels) -> Outcome:
    """One trial: what every estimator makes of one noisy recording."""
    made = record(base, cell, command, plan.effects, plan.runs)
    moves = jnp.any(jnp.stack([jnp.ptp(column) for column in made.exact]) > 0.0)
    sight = see(made.command, made.measured, cell.period, made.wheels, plan.runs)
    found = [estimate(choice, sight, moves) for choice in plan.estimators]
    estimates, deviations, reasons = (jnp.stack(part) for part in zip(*found, strict=True))
    return Outcome(estimates, deviations, difference_vector(made.robot.difference, made.robot.dead_zone), reasons)

"""One trial of a study, a pure function of its key and its cell: robot, excitation, simulation, camera, estimators.

    seed_key = fold_in(key(study.seed), seed)       the robot, where it is drawn
    run_key  = fold_in(seed_key, excitation)        the excitation's draws and the unit noise

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
from jaxident.log import make_log
from jaxident.robot.drive import Physical
from jaxident.robot.excitation import EXCITATIONS
from jaxident.robot.model import Model, difference_vector
from jaxident.robot.noise import Noise, draw_noise, observe
from jaxident.robot.simulate import run_physical
from jaxident.robot.wheel_sensor import measure_wheels
from jaxident.study.estimators import estimate, see
from jaxident.study.sight import Choice


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
    """What the compiled program of a trial is fixed to; effects: names of those in force in any trial of the study."""

    samples: int
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
    """What a trial's estimators are given, and what is true: commands and poses (samples,), the robot. The exact poses
    hold everything but the camera's random errors. wheels: measured wheel speeds, None of robots without."""

    command: Wheels
    measured: Pose
    exact: Pose
    robot: Model
    wheels: Wheels | None = None


def seed_keys(base: Array, cell: Cell) -> tuple[Array, Array, Array]:
    """Keys of the robot, of the excitation and of the noise; `base` is the study's key."""
    seed_key = jax.random.fold_in(base, cell.seed)
    key_robot, key_runs = jax.random.split(seed_key)
    key_input, key_noise = jax.random.split(jax.random.fold_in(key_runs, cell.excitation))
    return key_robot, key_input, key_noise


@functools.partial(jax.jit, static_argnames=("kind", "samples", "hold"))
def commands(base: Array, cells: Cell, kind: str, samples: int, hold: int) -> Wheels:
    """Commands (trials, samples) of trials that share a kind of excitation."""

    def one(cell: Cell) -> Wheels:
        _, key, _ = seed_keys(base, cell)
        return EXCITATIONS[kind](key, samples, cell.amplitude, hold)

    return jax.vmap(one)(cells)


def record(base: Array, cell: Cell, command: Wheels, effects: frozenset[str] = frozenset()) -> Recording:
    """Simulate one trial under given commands (samples,), and let the camera look: by the nominal simulator, or the
    full one where trials of the study have `effects` (their names) or discovered laws."""
    key_robot, _, key = seed_keys(base, cell)
    robot = draw_robot(key_robot, cell)
    law = Noise(cell.position, cell.heading, cell.correlation_time)
    if not effects and cell.robot.laws is None:
        unit = draw_noise(key, len(command.right))
        exact = run_physical(robot, command, cell.period, AT_REST, unit).pose
        wheels = None
        if robot.wheels is not None:
            drive = run_physical(robot, command, cell.period, AT_REST)  # random slip comes after the wheel
            wheels = measure_wheels(robot.wheels, drive.v, drive.w, key)
        return Recording(command, observe(exact, law, unit, cell.period), exact, robot, wheels)
    t, vector = cell.period * jnp.arange(len(command.right)), cell.robot.effects
    vector = NEUTRAL if vector is None else vector
    settings: Any = {"substeps": substeps_for(effects), "parts": effects, "laws": cell.robot.laws}
    exact = run_undisturbed(robot.dynamics, robot.dead_zone, vector, t, command, AT_REST, noise=robot.noise, key=key,
                            **settings)  # fmt: skip
    wheels = None
    if robot.wheels is not None:
        made = make_log(t, *command)
        wheels = drive_wheels(robot.dynamics, robot.dead_zone, vector, made, AT_REST, key, 0.0, sensor=robot.wheels,
                              **settings)  # fmt: skip
    return Recording(command, disturb(exact, vector, t, noise=law, key=key, parts=effects), exact, robot, wheels)


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
    made = record(base, cell, command, plan.effects)
    moves = jnp.any(jnp.stack([jnp.ptp(column) for column in made.exact]) > 0.0)
    sight = see(made.command, made.measured, cell.period, made.wheels)
    found = [estimate(choice, sight, moves) for choice in plan.estimators]
    estimates, deviations, reasons = (jnp.stack(part) for part in zip(*found, strict=True))
    return Outcome(estimates, deviations, difference_vector(made.robot.difference, made.robot.dead_zone), reasons)

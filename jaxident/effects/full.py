"""The full simulator: every effect in one compiled program, each neutral unless its parameters say otherwise."""

from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Pose, State, Wheels
from jaxident.effects import camera
from jaxident.effects.actuation import input_quantisation, input_saturation, lost_commands
from jaxident.effects.catalogue import by_name
from jaxident.effects.input_chain import AT_REST, push
from jaxident.effects.intervals import Grid, make_grid
from jaxident.effects.substep import move, solve
from jaxident.robot.drive import Force, Physical
from jaxident.robot.noise import Noise, correlated, draw_noise, observe, slip

SUBSTEPS = 4
"""Per interval; enough for 1e-6 m in a run of 200 samples where the effects are smooth."""

Settings = Mapping[str, dict[str, Any]]


def run_full(
    drive: Physical,
    dead_zone: Array,
    vector: Array,
    t: Array,
    command: Wheels,
    start: State,
    *,
    noise: Noise | None = None,
    key: Array | None = None,
    session_time: Array = 0.0,
    substeps: int = SUBSTEPS,
) -> Pose:
    """Poses (samples,) that the camera reports of one run.

    drive, dead_zone (2,): the nominal robot. vector: all parameters of the catalogue (`catalogue.to_vector`). t [s],
    command: (samples,), steps may differ. start: the robot's own state, not the marker's. Without a key nothing is
    drawn: neither `noise` nor the random effects act. session_time [s]: that of the first row. substeps is static.
    Pure: works under jit, vmap and grad; the derivative by a delay is one of its value and the commands' switches.
    """
    settings = by_name(vector)
    keys = None if key is None else jax.random.split(jax.random.fold_in(key, 1), 5)
    unit = None if key is None else draw_noise(key, len(t))
    sent = _sent(settings, command, None if keys is None else keys[0])
    change = settings["payload_change"]["instant"] - session_time + t[0]
    grid = make_grid(t, sent, settings["transport_delay"]["delay"], change)
    push_aside = Force(jnp.zeros_like(t), jnp.zeros_like(t))
    if unit is not None and noise is not None:
        push_aside = slip(noise, unit, jnp.append(jnp.diff(t), 1.0))
    states = _scan(settings, drive, dead_zone, grid, push_aside, start, session_time - t[0], substeps)
    pose = _optics(settings, Pose(*(column[grid.at_row] for column in states.pose)))
    if unit is not None and noise is not None:
        pose = observe(pose, noise, unit, jnp.diff(t))
    return pose if keys is None else _disturbed(settings, pose, jnp.diff(t), keys[1:])


def _sent(settings: Settings, command: Wheels, key: Array | None) -> Wheels:
    """The commands (samples,) that enter the delay line."""
    level, step = settings["input_saturation"]["level"], settings["input_quantisation"]["step"]
    sent = Wheels(*(input_quantisation(input_saturation(jnp.asarray(u), level), step) for u in command))
    if key is None:
        return sent
    lost = jax.random.uniform(key, jnp.shape(sent.right)) < settings["lost_commands"]["probability"]
    return Wheels(*(lost_commands(u, lost) for u in sent))


def _scan(settings, drive, dead_zone, grid: Grid, slips: Force, start: State, offset: Array, substeps: int) -> State:
    """True states (points,) at the points of the grid; `offset` takes times of the log to session times."""
    solved = solve(drive, grid.step / substeps)

    def interval(carry, now):
        begin, target, shove, changed, solution = now

        def one(inner, number):
            state, memory = inner
            time = begin + number * solution.step
            pushed, memory = push(settings, dead_zone, memory, target, time, solution.step)
            return (move(settings, drive, state, pushed, shove, changed, solution), memory), None

        after, _ = jax.lax.scan(one, carry, jnp.arange(substeps))
        return after, carry[0]

    begin = State(*(jnp.asarray(s, grid.start.dtype) for s in start))
    remembered = jax.tree.map(lambda value: jnp.asarray(value, grid.start.dtype), AT_REST)
    shoves = Force(*(f[grid.row] for f in slips))
    inputs = (grid.start + offset, grid.command, shoves, grid.changed, solved)
    (last, _), states = jax.lax.scan(interval, (begin, remembered), inputs)
    return State(*(jnp.append(column, end) for column, end in zip(states, last, strict=True)))


def _optics(settings: Settings, pose: Pose) -> Pose:
    """What the camera makes of true poses without drawing anything."""
    pose = camera.marker_offset(pose, **settings["marker_offset"])
    pose = camera.heading_offset(pose, **settings["heading_offset"])
    pose = camera.lens_distortion(pose, **settings["lens_distortion"])
    pose = camera.camera_tilt(pose, **settings["camera_tilt"])
    return camera.camera_scale(pose, **settings["camera_scale"])


def _disturbed(settings: Settings, pose: Pose, step: Array, keys: Array) -> Pose:
    """Random effects of the camera; step [s] (samples - 1,)."""
    samples = len(pose.x)
    coloured, rare, frozen = settings["coloured_noise"], settings["outliers"], settings["frozen_frames"]
    draws = jax.random.normal(keys[0], (3, samples))
    error = Pose(*(correlated(draw, step, coloured["correlation_time"]) for draw in draws))
    pose = camera.coloured_noise(pose, error, coloured["position"], coloured["heading"])
    chance = jax.random.uniform(keys[1], (2, samples))
    pose = camera.outliers(pose, chance[0], Pose(*jax.random.normal(keys[2], (3, samples))), **rare)
    return camera.frozen_frames(pose, chance[1], **frozen)

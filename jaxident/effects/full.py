"""The full simulator: every effect in one compiled program, each neutral unless its parameters say otherwise."""

from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Pose, State, Wheels
from jaxident.effects.catalogue import CATALOGUE, by_name
from jaxident.effects.discovered import Here, shifted, turned, with_laws
from jaxident.effects.input_chain import at_rest, push
from jaxident.effects.intervals import Grid, make_grid
from jaxident.effects.law_arrays import Laws
from jaxident.effects.law_kinds import DISCOVERED
from jaxident.effects.past import Past, past_of
from jaxident.effects.signals import Motion
from jaxident.effects.stages import CORNERED, MOVING, acting, holds, seen
from jaxident.effects.substep import after_half, move, solve_half
from jaxident.numerics import sin_cos
from jaxident.robot.drive import Force, Physical, advance, force, hold, wheel_speeds
from jaxident.robot.noise import Noise, draw_noise, draw_white, observe, slip

SUBSTEPS = 4
"""Per camera interval; enough for 1e-6 m in a run of 200 samples where the effects are smooth."""

SHARP_SUBSTEPS = 16
"""Where an effect has corners within a sample (friction, play, slew, the |w| of a castor, a wheel that begins to
slide)."""
KEYS = 5
"""Of effects that draw, apart from that of the noise; `Chance.keys` are their numbers."""

EVERY = frozenset(CATALOGUE)
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
    parts: frozenset[str] = EVERY,
    laws: Laws | None = None,
) -> Pose:
    """Poses (samples,) that the camera reports of one run.

    drive, dead_zone (2,): the nominal robot. vector: all parameters of the catalogue (`catalogue.to_vector`). t [s],
    command: (samples,), steps may differ. start: the robot's own state, not the marker's. Without a key nothing is
    drawn: neither `noise` nor the random effects act. session_time [s]: that of the first row. substeps is static.
    Pure: works under jit, vmap and grad; the derivative by a delay is one of its value and the commands' switches.

    parts, static: names of the effects that the program holds; of the others the vector is not read. The default, all
    of them, makes one program for every set; a program of few effects compiles and runs several times faster, and one
    without friction, play, lag and the like takes no substeps. laws: discovered ones, None for none.
    """
    pose = run_undisturbed(drive, dead_zone, vector, t, command, start, noise=noise, key=key, session_time=session_time,
                           substeps=substeps, parts=parts, laws=laws)  # fmt: skip
    return pose if key is None else disturb(pose, vector, t, noise=noise, key=key, parts=parts)


def run_undisturbed(
    drive,
    dead_zone,
    vector,
    t,
    command: Wheels,
    start: State,
    *,
    noise,
    key,
    session_time=0.0,
    substeps,
    parts,
    laws: Laws | None = None,
) -> Pose:
    """`run_full` before `disturb`: poses (samples,) as the camera would report them if it made no random error."""
    true = run_states(drive, dead_zone, vector, t, command, start, noise=noise, key=key, session_time=session_time,
                      substeps=substeps, parts=parts, laws=laws)[0].pose  # fmt: skip
    settings = with_laws(_settings(vector, parts), laws)
    return shifted(settings, seen(settings, true), true)


def run_states(
    drive,
    dead_zone,
    vector,
    t,
    command: Wheels,
    start: State,
    *,
    noise,
    key,
    session_time=0.0,
    substeps,
    parts,
    laws: Laws | None = None,
) -> tuple[State, Wheels]:
    """The robot's own states (samples,) of `run_full`, and by how much each wheel turns faster than the ground there,
    in the unit of commands. Without `noise` nothing slips at random."""
    settings = with_laws(_settings(vector, parts), laws)
    sent = _sent(settings, command, None if key is None else _keys(key))
    grid = _grid(settings, t, sent, session_time, substeps)
    push_aside = None
    if key is not None and noise is not None:
        drawn = slip(noise, draw_noise(key, len(t)), jnp.append(jnp.diff(t), 1.0))
        push_aside = Force(*(f[grid.row] for f in drawn))
    past = None
    if laws is not None:
        past = jax.tree.map(lambda leaf: leaf[grid.row], past_of(jnp.asarray(t), jnp.stack(command, axis=-1)))
    angles = _first_angles(laws, key)
    found = _scan(settings, drive, dead_zone, grid, push_aside, past, angles, start, session_time - t[0])
    return jax.tree.map(lambda column: column[grid.at_row], found)


def _first_angles(laws: Laws | None, key: Array | None) -> Array | None:
    """The angles (laws,) [rad] at which wheels begin that laws go by: drawn, or without a key 0; None without laws."""
    if laws is None or key is None:
        return None if laws is None else jnp.zeros(len(laws.per_way))
    return jax.random.uniform(jax.random.fold_in(key, 2), (len(laws.per_way),), maxval=2.0 * jnp.pi)


def disturb(pose: Pose, vector: Array, t: Array, *, noise: Noise | None, key: Array, parts: frozenset[str]) -> Pose:
    """The camera's random errors on poses (samples,): its noise, then those among the effects."""
    if noise is not None:
        pose = observe(pose, noise, draw_noise(key, len(t)), jnp.diff(t), draw_white(noise, key, len(t)))
    keys, settings = _keys(key), _settings(vector, parts)
    for effect, values in acting("frames", settings):
        pose = effect.act(pose, jnp.diff(t), effect.own_keys(keys), **values)
    return pose


def _settings(vector: Array, parts: frozenset[str]) -> Settings:
    return {name: values for name, values in by_name(vector).items() if name in parts}


def _keys(key: Array) -> Array:
    """Keys of the random effects, apart from that of the noise."""
    return jax.random.split(jax.random.fold_in(key, 1), KEYS)


def substeps_for(parts: frozenset[str]) -> int:
    """Substeps that give 1e-6 m over 200 samples, with corners 1e-4 m."""
    return SHARP_SUBSTEPS if parts & CORNERED else SUBSTEPS


def _sent(settings: Settings, command: Wheels, keys: Array | None) -> Wheels:
    """The commands (samples,) that enter the delay line."""
    sent = Wheels(*(jnp.asarray(u) for u in command))
    for effect, values in acting("command", settings):
        if effect.chance is None:
            sent = effect.act(sent, **values)
        elif keys is not None:
            sent = effect.act(sent, effect.own_keys(keys), **values)
    return sent


def _grid(settings: Settings, t: Array, sent: Wheels, session_time: Array, substeps: int) -> Grid:
    """The grid that these effects need."""
    arrivals = t if holds(settings, "arrival") else None
    for effect, values in acting("arrival", settings):
        arrivals = effect.act(arrivals, session_time - t[0], **values)
    changes = [effect.act.instant(**values) - session_time + t[0] for effect, values in acting("load", settings)]
    return make_grid(t, sent, substeps if _moves(settings) else 1, arrivals=arrivals, changes=changes)


def _moves(settings: Settings) -> bool:
    """Whether the push changes while a command is held, or the drive is not linear."""
    return bool(settings.keys() & MOVING) or DISCOVERED in settings


def _scan(settings, drive, dead_zone, grid: Grid, slips: Force | None, past: Past | None, angles, start, offset: Array):
    """True states (points,) at the points of the grid, and by how much each wheel then turns faster than the ground;
    `angles`: at which wheels begin that laws go by; `offset` takes times of the log to session times."""
    moving = _moves(settings)
    solve = solve_half if moving else hold
    solved = jax.tree.map(grid.spread, solve(drive, grid.step))
    length = grid.spread(grid.step)

    def interval(carry, now):
        state, memory, excess, angles = carry
        begin, h, target, shove, changed, solution, behind = now

        def speeds(pushed: Wheels) -> Wheels:
            midway = after_half(solution, Motion(state.v, state.w, state.theta), force(drive, pushed))
            return wheel_speeds(drive, midway.v, midway.w)

        pushed, memory = push(settings, dead_zone, memory, target, begin, h, speeds)
        if moving:
            midway = turned(settings, angles, 0.5 * h * state.v, 0.5 * h * state.w)
            here = Here(state.x, state.y, begin + 0.5 * h, pushed.mean, behind, midway)
            after, excess = move(settings, drive, state, excess, pushed, shove, changed, solution, h, here)
        else:
            pull = force(drive, pushed.mean)
            if shove is not None:
                pull = Force(pull.along + shove.along, pull.heading + shove.heading)
            after = advance(state, pull, solution)
        sine, cosine = sin_cos(0.5 * (state.theta + after.theta))
        way = (after.x - state.x) * cosine + (after.y - state.y) * sine
        angles = turned(settings, angles, way, after.theta - state.theta)
        return (after, memory, excess, angles), (state, together(excess))

    def together(excess: tuple[Wheels, ...]) -> Wheels:
        return jax.tree.map(lambda *each: sum(each), Wheels(like, like), *excess)

    like = jnp.zeros_like(grid.start, shape=())
    begin = State(*(jnp.asarray(s, like.dtype) for s in start))
    inputs = (grid.start + offset, length, grid.command, slips, grid.changed, solved, past)
    rolling = tuple(Wheels(like, like) for _ in acting("grip", settings))
    (last, _, excess, _), found = jax.lax.scan(interval, (begin, at_rest(settings, like), rolling, angles), inputs)
    return jax.tree.map(jnp.append, found, (last, together(excess)))

"""The nominal simulator: what it passes on, what it refuses, and that it maps, differentiates and compiles once."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from jaxident.array_types import AT_REST, State, Wheels
from jaxident.errors import InputError
from jaxident.log import join, make_log
from jaxident.robot.difference import to_difference
from jaxident.robot.drive import Physical
from jaxident.robot.excitation import EXCITATIONS
from jaxident.robot.model import Effect, Model
from jaxident.robot.noise import Noise, draw_noise, observe
from jaxident.robot.simulate import simulate

PERIOD, ROWS = 1 / 30, 60
DRIVE = Physical(jnp.array([2.0, 6.0]), jnp.array([[1.2, 1.1], [35.0, -33.0]]))
WIDTH = jnp.array([0.25, 0.2])
NOISE = Noise(position=1e-3, heading=1e-2, correlation_time=0.2, slip_along=0.05, slip_heading=0.5)
ROBOT = Model(PERIOD, DRIVE, WIDTH, NOISE)
PAPER_FORM = Model(PERIOD, to_difference(DRIVE, PERIOD), WIDTH)
EVEN = PERIOD * np.arange(ROWS)
UNEVEN = np.cumsum(np.random.default_rng(0).uniform(0.01, 0.06, ROWS))

program = jax.jit(lambda model, log, start, key: simulate(model, log, start=start, key=key))


def run(model, log, key=None, start=AT_REST):
    return program(model, log, State(*map(float, start)), key)


def drive_log(t=EVEN, seed=1):
    return make_log(t, *np.random.default_rng(seed).uniform(-1, 1, (2, len(t))))


def test_only_the_pose_is_written():
    log = drive_log(UNEVEN)._replace(run=np.full(ROWS, 7))
    made = run(ROBOT, log)
    for name in ("t", "u_r", "u_l", "run"):
        np.testing.assert_array_equal(getattr(made, name), getattr(log, name))


def integrate(log, start) -> np.ndarray:
    """Poses (3, rows) of ROBOT under a log's commands, by an eighth-order Runge-Kutta method with error control."""
    states = [np.array(start)]
    passed = [np.sign(u) * np.maximum(np.abs(u) - d, 0.0) for u, d in zip(log.command, WIDTH, strict=True)]
    pull = np.asarray(DRIVE.gain) @ passed
    for k, h in enumerate(np.diff(log.t)):

        def slope(_, s, pull=pull[:, k]):
            return [s[3] * np.cos(s[2]), s[3] * np.sin(s[2]), s[4], *(pull - np.asarray(DRIVE.rate) * s[3:])]

        states.append(solve_ivp(slope, (0, h), states[-1], method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1])
    return np.array(states).T[:3]


@pytest.mark.parametrize("t", [EVEN, UNEVEN], ids=["even", "uneven"])
def test_poses_are_those_of_the_fine_integration(t):
    start = State(0.5, -0.5, 2.0, 0.3, -1.0)
    log = drive_log(t)
    np.testing.assert_allclose(np.stack(run(ROBOT, log, start=start).pose), integrate(log, start), atol=1e-9)


@pytest.mark.parametrize("model", [ROBOT, PAPER_FORM], ids=["physical", "difference"])
def test_the_last_command_is_of_no_account(model):
    log = drive_log()
    emptied = log._replace(u_r=np.append(log.u_r[:-1], np.nan), u_l=np.append(log.u_l[:-1], np.nan))
    np.testing.assert_array_equal(np.stack(run(model, log).pose), np.stack(run(model, emptied).pose))


def test_start_moves_and_turns_the_whole_run():
    log, start = drive_log(), State(1.0, -2.0, 0.8, 0.0, 0.0)
    base, moved = run(ROBOT, log), run(ROBOT, log, start=start)
    turned = np.exp(0.8j) * (np.asarray(base.x) + 1j * np.asarray(base.y)) + (1 - 2j)
    np.testing.assert_allclose(np.asarray(moved.x) + 1j * np.asarray(moved.y), turned, atol=1e-13)
    np.testing.assert_allclose(moved.theta, base.theta + 0.8, atol=1e-13)


def test_a_single_row_is_the_start():
    made = simulate(ROBOT, drive_log(EVEN[:1]), start=State(1.0, 2.0, 3.0, 0.5, 0.5))
    np.testing.assert_array_equal(np.stack(made.pose), [[1.0], [2.0], [3.0]])


def test_noise_needs_a_law_and_a_key():
    log = drive_log()
    silent = np.stack(run(PAPER_FORM, log).pose)
    np.testing.assert_array_equal(np.stack(run(PAPER_FORM, log, jax.random.key(0)).pose), silent)
    np.testing.assert_array_equal(np.stack(run(dataclasses.replace(PAPER_FORM, noise=NOISE), log).pose), silent)


def test_camera_error_comes_on_top_of_the_slipping_robot():
    log, key = drive_log(UNEVEN), jax.random.key(5)
    perfect_camera = dataclasses.replace(ROBOT, noise=NOISE._replace(position=0.0, heading=0.0))
    truth = run(perfect_camera, log, key).pose
    expected = observe(truth, NOISE, draw_noise(key, ROWS), np.diff(UNEVEN))
    np.testing.assert_allclose(np.stack(run(ROBOT, log, key).pose), np.stack(expected), atol=1e-13)
    assert np.max(np.abs(truth.theta - np.asarray(run(ROBOT, log).theta))) > 1e-2


def test_refusals_name_the_cause():
    with pytest.raises(InputError, match="effect 'lag'"):
        simulate(Model(PERIOD, DRIVE, WIDTH, effects=(Effect("lag", {"delay": 0.1}),)), drive_log())
    with pytest.raises(InputError, match="2 runs"):
        simulate(ROBOT, join([drive_log(), drive_log(seed=2)]))
    with pytest.raises(InputError, match="uneven time steps"):
        simulate(PAPER_FORM, drive_log(UNEVEN))
    with pytest.raises(InputError, match=r"sample_period.*0\.0333.* 0\.02 s"):
        simulate(PAPER_FORM, drive_log(0.02 * np.arange(ROWS)))


over_seeds = jax.jit(jax.vmap(lambda log, key: simulate(ROBOT, log, key=key).pose, (None, 0)))


@pytest.mark.parametrize("t", [EVEN, UNEVEN], ids=["even", "uneven"])
def test_mapping_over_seeds_is_the_loop(t):
    keys, log = jax.random.split(jax.random.key(0), 3), drive_log(t)
    mapped = over_seeds(log, keys)
    for index, key in enumerate(keys):
        one = run(ROBOT, log, key).pose
        np.testing.assert_allclose(np.stack(mapped)[:, index], np.stack(one), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("model", [ROBOT, PAPER_FORM], ids=["physical", "difference"])
def test_mapping_over_excitations_is_the_loop(model):
    signals = [excite(jax.random.key(2), ROWS, 1.0, 5) for excite in EXCITATIONS.values()]
    stacked = Wheels(*(jnp.stack(wheel) for wheel in zip(*signals, strict=True)))
    mapped = jax.jit(jax.vmap(lambda u: simulate(model, make_log(EVEN, *u)).pose))(stacked)
    for index, signal in enumerate(signals):
        one = run(model, make_log(EVEN, *signal)).pose
        np.testing.assert_allclose(np.stack(mapped)[:, index], np.stack(one), rtol=1e-12, atol=1e-12)


def test_compiles_once_per_shape():
    """New parameters, times, commands, starts and keys meet the program that is there; a new length does not."""
    run(PAPER_FORM, drive_log())
    run(ROBOT, drive_log(), jax.random.key(0))
    compiled = program._cache_size()
    for seed in range(3):
        slower = Model(PERIOD, DRIVE._replace(rate=DRIVE.rate * (1 + 0.1 * seed)), WIDTH + 0.01 * seed, NOISE)
        run(slower, drive_log(UNEVEN, seed), jax.random.key(seed), State(0.0, 0.0, 0.1 * seed, 0.1, 0.0))
    assert program._cache_size() == compiled
    run(PAPER_FORM, drive_log(EVEN[:40]))
    assert program._cache_size() == compiled + 1


def test_commands_on_the_edge_of_the_dead_zone_have_finite_gradients():
    """Every number of the model, for commands at, and 1e-9 beside, the edge."""
    edge = np.resize(0.25 + 1e-9 * np.array([-1.0, 0.0, 1.0]), ROWS)

    def score(model):
        return jnp.sum(jnp.stack(simulate(model, make_log(EVEN, edge, -edge)).pose))

    slopes = jax.jit(jax.grad(score))(dataclasses.replace(PAPER_FORM, dead_zone=jnp.array([0.25, 0.25])))
    assert np.all(np.isfinite(np.concatenate([np.ravel(leaf) for leaf in jax.tree.leaves(slopes)])))
    assert np.all(np.asarray(slopes.dead_zone) != 0.0)

"""The recursion against batch least squares, against itself row by row, and where excitation stops."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support.recursion import DEAD_ZONE, PERIOD, ROBOT, record, started

from jaxident.array_types import Increment, Wheels
from jaxident.estimation.increments import recursive
from jaxident.estimation.increments.least_squares import LOWER, Equation, full_covariance, update
from jaxident.estimation.increments.observations import observe_log, tail
from jaxident.estimation.increments.recursive import Sample
from jaxident.estimation.increments.regressors import Memory, dot, empty_memory, key_terms, next_row
from jaxident.log import make_log
from jaxident.robot.difference import Difference
from jaxident.robot.excitation import multilevel
from jaxident.robot.model import Model
from jaxident.robot.simulate import simulate


def test_key_terms_by_hand():
    row = key_terms(0.5, Wheels(0.6, -0.1), Wheels(-0.4, 0.3), Wheels(0.25, 0.2))
    np.testing.assert_allclose(row, [0.5, 0.6, -1.0, -0.15, 0.0, 0.0, 0.1], atol=1e-15)


def test_forgetting_one_and_known_dead_zones_equal_batch_least_squares():
    log = record(noise=1e-5)
    first = observe_log(log)
    last = Increment(*(jnp.concatenate([jnp.zeros(1), c[:-1]]) for c in first.increment))
    rows = key_terms(last.length, first.command, first.command_before, Wheels(*DEAD_ZONE))
    matrix, target = np.stack(rows)[:, 2:].T, np.asarray(first.increment.length)[2:]
    cut = 100
    covariance = np.linalg.inv(matrix[:cut].T @ matrix[:cut])
    unknowns = covariance @ matrix[:cut].T @ target[:cut]
    equation = Equation(tuple(unknowns), tuple(covariance[i, j] for i, j in LOWER), (np.inf,) * 7)

    def body(equation, sample):
        return update(equation, tuple(sample[0]), sample[1], 1.0)[0], None

    equation, _ = jax.lax.scan(body, jax.tree.map(jnp.asarray, equation), (matrix[cut:], target[cut:]))
    batch = np.linalg.lstsq(matrix, target, rcond=None)[0]
    np.testing.assert_allclose(np.stack(equation.unknowns), batch, rtol=1e-8, atol=1e-8 * np.abs(batch).max())
    np.testing.assert_allclose(full_covariance(equation), np.linalg.inv(matrix.T @ matrix), rtol=1e-6, atol=1e-8)


def test_rows_hold_at_the_truth_where_poses_are_missing():
    """Over a gap the summed equation of the turn is exact; that of the length is, up to the Bezier curve."""
    log = record(samples=400, missing=0.4)
    unknowns = tuple(recursive._unknowns(ROBOT, row, Wheels(*DEAD_ZONE)) for row in range(2))

    def body(memory, sample):
        row, memory = next_row(memory, unknowns, Wheels(*DEAD_ZONE), sample)
        turn = sample.increment.turn - dot(row.turn, unknowns[1])
        return memory, (row.usable, turn, sample.increment.turn, sample.increment.length - dot(row.length, unknowns[0]))

    memory = jax.tree.map(jnp.asarray, empty_memory())
    _, (usable, turn, size, length) = jax.lax.scan(body, memory, observe_log(log))
    usable = np.asarray(usable) & (np.cumsum(usable) > 1)  # the first row leans on the mean increment of a gap
    assert np.count_nonzero(usable) > 150
    np.testing.assert_allclose(np.asarray(turn)[usable], 0.0, atol=1e-12)
    small = usable & (np.abs(size) < 0.3)
    assert np.median(np.abs(np.asarray(length)[small])) < 1e-7


def test_memory_without_gaps_is_the_general_one():
    log = record(samples=60)
    general = observe_log(log)
    plain = general._replace(seen=None, measured=None, first=None, inside=None)
    full, _ = recursive.run(recursive.start(ROBOT, DEAD_ZONE, general, 0.9, 1.0), tail(general, 30))
    short, _ = recursive.run(recursive.start(ROBOT, DEAD_ZONE, plain, 0.9, 1.0), tail(plain, 30))
    assert isinstance(short.memory, Memory)
    np.testing.assert_allclose(
        np.concatenate([np.ravel(x) for x in jax.tree.leaves(recursive.parameters(full))]),
        np.concatenate([np.ravel(x) for x in jax.tree.leaves(recursive.parameters(short))]),
        rtol=1e-9,
    )


@pytest.mark.parametrize("missing", [pytest.param(0.0, marks=pytest.mark.slow), 0.3])
def test_step_row_by_row_equals_the_scan(missing):
    log = record(samples=160, noise=1e-5, missing=missing)
    state = recursive.init(log.rows(0, 80), d_max=0.9)
    estimate, _ = recursive.run(recursive.unpack(state).estimate, tail(observe_log(log), 79))
    step = jax.jit(partial(recursive.step))  # compilations of its own to count
    for k in range(80, 160):
        state, info = step(state, Sample(log.u_r[k], log.u_l[k], log.x[k], log.y[k], log.theta[k]))
    assert step._cache_size() == 1
    assert max(leaf.nbytes for leaf in jax.tree.leaves((state, info))) < 512, "XLA runs it on one thread"
    for one, other in zip(
        jax.tree.leaves(recursive.parameters(recursive.unpack(state).estimate)),
        jax.tree.leaves(recursive.parameters(estimate)),
        strict=True,
    ):
        np.testing.assert_allclose(one, other, rtol=1e-9)


def test_forgetting_recovers_noise_free_data_from_a_wrong_start():
    """Without forgetting the rows switched by a wrong dead zone count for ever."""
    start = Difference(ROBOT.alpha * 0.999, ROBOT.delta * 1.01, ROBOT.epsilon * 0.99)
    estimate, observations = started(record(samples=2000), 200, start, forgetting=0.97)
    found, dead_zone = recursive.parameters(jax.jit(recursive.run_to_end)(estimate, observations))
    for one, true in zip((*found, dead_zone), (*ROBOT, DEAD_ZONE), strict=True):
        np.testing.assert_allclose(one, true, rtol=1e-3)


def test_covariance_stays_bounded_and_positive_when_excitation_stops():
    log = record(samples=300, noise=1e-5)
    estimate, _ = started(log, 200, forgetting=0.95)
    still = observe_log(make_log(*(jnp.zeros(20001) for _ in range(6))))
    after = jax.jit(recursive.run_to_end)(estimate, still)
    for equation in (after.length, after.turn):
        covariance = np.asarray(full_covariance(equation))
        assert np.all(np.diagonal(covariance) <= np.stack(equation.widest))
        scale = np.sqrt(np.diagonal(covariance))
        assert np.linalg.eigvalsh(covariance / np.outer(scale, scale)).min() > 0.0


def test_vmap_over_seeds_equals_a_loop():
    logs = [record(samples=120, seed=seed, noise=1e-4) for seed in range(3)]

    def last(log):
        estimate, observations = started(log, 60)
        return recursive.parameters(recursive.run_to_end(estimate, observations))

    together, alone = jax.jit(jax.vmap(last)), jax.jit(last)
    together = together(jax.tree.map(lambda *c: jnp.stack(c), *logs))
    for k, log in enumerate(logs):
        for one, many in zip(jax.tree.leaves(alone(log)), jax.tree.leaves(together), strict=True):
            np.testing.assert_allclose(many[k], one, rtol=1e-9)


@pytest.mark.slow
def test_forgetting_follows_a_gain_that_falls():
    samples = 3000
    command = multilevel(jax.random.key(3), samples, 1.0, 10)
    log = simulate(Model(PERIOD, ROBOT, DEAD_ZONE), make_log(PERIOD * np.arange(samples), *command))
    gain = jnp.linspace(1.0, 0.8, samples - 1)
    observations = observe_log(log)
    early = jax.tree.map(lambda c: c[:199], observations)

    def faded(last, now):
        new = ROBOT.alpha[1] * last + now
        return new, new

    turn = observations.increment.turn
    drive = turn - ROBOT.alpha[1] * jnp.concatenate([jnp.zeros(1), turn[:-1]])
    _, turn = jax.lax.scan(faded, 0.0, drive * gain)
    observations = observations._replace(increment=observations.increment._replace(turn=turn))
    errors = []
    for forgetting in (1.0, 0.98):
        first = recursive.start(ROBOT, DEAD_ZONE, early, 0.9, forgetting)
        last = jax.jit(recursive.run_to_end)(first, tail(observations, 199))
        errors.append(abs(float(last.turn.unknowns[1]) / (0.8 * 0.0341) - 1.0))
    assert errors[1] < 0.02 < errors[0]

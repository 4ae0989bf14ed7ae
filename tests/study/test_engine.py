"""A trial depends on nothing but its key and its cell: not on its chunk, nor on what else the study holds."""

import jax
import numpy as np
import pytest
from support.studies import ROBOT, SMALL

from jaxident.effects.apply import sized, with_effects
from jaxident.effects.catalogue import CATALOGUE
from jaxident.robot.excitation import staircase
from jaxident.study import engine, trial
from jaxident.study.dataset import FURTHER_AXES, study_arrays
from jaxident.study.engine import chunk_shape, chunks, pieces, run_chunk, run_one
from jaxident.study.sight import AT_REST, FOUND, NOT_FINITE, REASONS, Finding, Method
from jaxident.study.statistics import summarise


@pytest.fixture(scope="module")
def whole():
    return study_arrays(SMALL)


def test_chunks_cover_every_trial_once():
    for study in (SMALL, SMALL._replace(chunk=1000), SMALL._replace(samples=(60, 90), chunk=7, seeds=3)):
        count = np.zeros(study.shape, int)
        for piece in chunks(study):
            count[piece.cut] += 1
            assert np.prod(piece.shape) <= study.chunk
            assert piece.shape[:2] == (1, 1)
        np.testing.assert_array_equal(count, 1)
    assert chunk_shape(SMALL) == (1, 1, 1, 1, 1, 1, 4)
    assert chunk_shape(SMALL._replace(chunk=1000)) == (1, 1, 1, 1, 1, 2, 6)
    assert [piece.shape for piece in pieces((3,), (2,))] == [(2,), (1,)]


def test_named_axes_and_truth(whole):
    assert whole["estimate"].dims == (
        "excitation", "samples", "robot", "period", "amplitude", "noise", "seed", "estimator", "parameter",
    )  # fmt: skip
    assert whole["noise"].attrs["units"] == "m"
    assert np.all(whole["reason"] == FOUND)
    truth = whole["truth"].squeeze()
    np.testing.assert_array_equal(truth.isel(noise=0), truth.isel(noise=1))  # one robot per seed, at every level
    assert np.ptp(truth.sel(parameter="dead_zone_r").values) > 0.0
    assert np.ptp(truth.sel(parameter="alpha_1").values) == 0.0
    error = np.abs(whole["estimate"] - whole["truth"]).sel(parameter="alpha_2").squeeze()
    assert np.all(error.isel(noise=0) < 0.02)
    assert np.all(error.isel(noise=0) < error.isel(noise=1))


@pytest.mark.parametrize("number", [0, 5, 11])
def test_a_trial_alone_is_the_trial_in_the_study(whole, number):
    recording, outcome = run_one(SMALL, number)
    at = dict(zip(whole["truth"].dims, np.unravel_index(number, SMALL.shape), strict=False))
    for name in FURTHER_AXES:
        np.testing.assert_array_equal(getattr(outcome, name), whole[name].isel(at))
    noise = SMALL.noise[at["noise"]]
    assert 0.3 * noise < np.std(recording.measured.x - recording.exact.x) < 3.0 * noise
    np.testing.assert_allclose(recording.robot.dead_zone, whole["truth"].isel(at)[10:])


def test_chunks_of_any_size_give_the_same_trials(whole, monkeypatch):
    """Bit for bit where the block, the shape of the compiled program, is the same."""
    monkeypatch.setattr(engine, "BLOCK", 4)
    other = study_arrays(SMALL._replace(chunk=100))
    for name in other:
        np.testing.assert_array_equal(other[name], whole[name])


def test_one_core_and_all_cores_agree():
    piece = chunks(SMALL)[1]
    for one, other in zip(run_chunk(SMALL, piece, 1), run_chunk(SMALL, piece), strict=True):
        np.testing.assert_array_equal(one, other)


def test_noise_levels_share_their_random_numbers():
    low, high = (run_one(SMALL, number)[0] for number in (3, 9))
    np.testing.assert_array_equal(low.command.right, high.command.right)
    draws = [np.asarray(made.measured.theta - made.exact.theta) for made in (low, high)]
    np.testing.assert_allclose(draws[1], 100.0 * draws[0], rtol=1e-8, atol=1e-12)


def test_the_robot_is_driven_by_its_own_excitation():
    recording, _ = run_one(SMALL, 0)
    levels = np.asarray(staircase(jax.random.key(0), 60, 1.0, 3).right)
    np.testing.assert_allclose(recording.command.right, levels)  # the right wheel takes its levels in order


def test_failures_are_counted_and_not_averaged(monkeypatch):
    """Commands inside the dead zone move nothing; a method that breaks on every second trial leaves the others."""
    still = study_arrays(SMALL._replace(amplitude=(0.1,)))
    assert np.all(still["reason"] == AT_REST)
    assert np.all(np.isnan(still["estimate"]))
    summary = summarise(still)
    assert int(summary["failures"].sel(reason=REASONS[AT_REST]).sum()) == 12
    assert np.all(np.isnan(summary["rmse"]))


def test_what_is_not_finite_has_failed():
    from jaxident.study import estimators

    broken = Method(lambda sight, settings: Finding(np.full(12, np.inf), np.ones(12), 0), {})
    known = estimators.METHODS
    try:
        estimators.METHODS = {"broken": broken}
        found = estimators.estimate(estimators.Choice("broken", "broken"), None, True)
    finally:
        estimators.METHODS = known
    assert int(found.reason) == NOT_FINITE
    assert np.all(np.isnan(found.estimate))


def test_effects_act_on_their_robots_alone():
    """At no noise a robot without effects and one with a neutral effect are the nominal one; the others move apart."""
    names = ("motor_lag", "marker_offset")
    robots = [SMALL.robots[0]] + [
        SMALL.robots[0]._replace(
            name=f"{name} {size}", model=with_effects(ROBOT, [(name, sized(CATALOGUE[name], size))])
        )
        for name in names
        for size in (1e-12, 1.0)
    ]
    study = SMALL._replace(robots=tuple(robots))
    index = np.zeros((len(study.axes), len(robots)), int)
    index[study.axes.index("robot")] = np.arange(len(robots))
    cells = engine.cells(study, index)
    base, rows = jax.random.key(study.seed), study.samples[0]
    command = trial.commands(base, cells, "staircase", rows, study.hold)
    made = jax.jit(jax.vmap(lambda cell, u: trial.record(base, cell, u, study.effect_names)))(cells, command)
    alone = jax.jit(jax.vmap(lambda cell, u: trial.record(base, cell, u)))(cells, command)
    for kind in ("exact", "measured"):
        ours, nominal = (np.stack(getattr(each, kind), axis=-1) for each in (made, alone))
        for robot in (0, 1, 3):
            np.testing.assert_allclose(ours[robot], nominal[robot], rtol=1e-9, atol=1e-10)
        for robot in (2, 4):
            assert np.abs(ours[robot] - nominal[robot]).max() > 1e-3
    noise = (np.stack(each.measured, axis=-1) - np.stack(each.exact, axis=-1) for each in (made, alone))
    np.testing.assert_allclose(*noise, atol=1e-12)

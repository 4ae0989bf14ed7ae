"""The full simulator against the nominal one and against itself: neutral, mapped, differentiated, compiled once."""

import dataclasses
import itertools
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support.effect_robots import DRIVE, ROBOT, START, WIDTH, drive_log, full, full_program, poses, typical

import jaxident as ji
from jaxident.effects import CATALOGUE, NEUTRAL, ORDER, run_full, to_vector
from jaxident.log import join
from jaxident.robot.model import Effect
from jaxident.robot.noise import Noise
from jaxident.robot.simulate import simulate as nominal
from jaxident.study.synthetic import simulate_runs

SHORT = drive_log(81)
PLACE = {names: place for place, names in enumerate(ORDER)}
RATES = [names for names in ORDER if CATALOGUE[names[0]].smooth and not CATALOGUE[names[0]].random]
"""Parameters in which the simulation has a derivative; sizes such as that of the play have none at neutral."""


@pytest.mark.parametrize("even", [True, False], ids=["even", "uneven"])
@pytest.mark.parametrize("coupled", [True, pytest.param(False, marks=pytest.mark.slow)], ids=["coupled", "uncoupled"])
def test_full_is_nominal_at_neutral(even, coupled):
    drive = DRIVE if coupled else DRIVE._replace(coupling=None)
    log = drive_log(81, even)
    """On even steps, and on uneven ones within which the robot turns by less than 0.3 rad: the nominal rule for the
    position is 1e-9 m off after a step of one radian, that on substeps is not."""
    expected = poses(nominal(dataclasses.replace(ROBOT, dynamics=drive), log, start=START))
    found = np.asarray(full(jnp.asarray(NEUTRAL), log, drive=drive))
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())


def test_neutral_effects_draw_the_noise_of_the_nominal_simulator():
    noisy = dataclasses.replace(ROBOT, noise=Noise(1e-3, 1e-2, 0.2, 0.05, 0.5))
    neutral = dataclasses.replace(noisy, effects=(Effect("transport_delay", {"delay": 0.0}),))
    key = jax.random.key(3)
    expected, found = (poses(ji.simulate(model, SHORT, key=key)) for model in (noisy, neutral))
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", CATALOGUE)
def test_an_effect_moves_the_channels_of_its_row(name):
    """Movement from row to row along, sideways and in heading, in the frame of the reported heading."""
    entry = CATALOGUE[name]
    start = ji.State(0.4, 0.3, 0.5, 0.2, -1.0)
    key = jax.random.key(5)
    base = movement(full(jnp.asarray(NEUTRAL), SHORT, key, start))
    changed = movement(full(to_vector([Effect(name, entry.typical())]), SHORT, key, start))
    size = {channel: np.abs(changed[channel] - base[channel]).max() for channel in base}
    for channel in entry.channels:
        assert size[channel] > (1e-4 if channel == "heading" else 1e-6), channel
    if "heading" not in entry.channels and name not in ("slope", "turn_loss"):  # these reach it through the coupling
        assert size["heading"] < 1e-9
    if "lateral" not in entry.channels:
        assert size["lateral"] < 0.1 * max(size["along"], 0.01 * size["heading"])
    if "along" not in entry.channels:
        assert size["along"] < 0.1 * size["lateral"]


def movement(pose):
    x, y, theta = np.asarray(pose).T
    direction = theta[:-1] + 0.5 * np.diff(theta)
    sine, cosine = np.sin(direction), np.cos(direction)
    dx, dy = np.diff(x), np.diff(y)
    return {"along": cosine * dx + sine * dy, "lateral": cosine * dy - sine * dx, "heading": np.diff(theta)}


@pytest.mark.slow
def test_heading_is_untouched_by_along_effects_without_coupling():
    drive = DRIVE._replace(coupling=None)
    base = full(jnp.asarray(NEUTRAL), SHORT, drive=drive)
    for name in ("slope", "turn_loss"):
        moved = full(to_vector([Effect(name, CATALOGUE[name].typical())]), SHORT, drive=drive)
        np.testing.assert_allclose(moved[:, 2], base[:, 2], atol=1e-12)
        assert np.max(np.abs(moved[:, :2] - base[:, :2])) > 1e-4


@pytest.mark.slow
def test_all_pairs_compose_in_one_program():
    key = jax.random.key(0)
    full(jnp.asarray(NEUTRAL), SHORT, key)
    compiled = full_program._cache_size()
    vectors = [
        to_vector([Effect(name, CATALOGUE[name].typical()) for name in pair])
        for pair in itertools.combinations(CATALOGUE, 2)
    ]
    many = jax.jit(jax.vmap(lambda vector: full(vector, SHORT, key)))(jnp.stack(vectors))
    assert np.isfinite(many).all()
    for vector in vectors[::40]:
        full(vector, SHORT, key)
    assert full_program._cache_size() == compiled


@pytest.mark.slow  # in the usual tests a trial with effects is compared with the same one in a batch (study)
def test_mapping_is_the_loop():
    vectors = jnp.stack([to_vector([Effect(n, CATALOGUE[n].typical())]) for n in ("stiction", "motor_lag", "backlash")])
    keys = jax.random.split(jax.random.key(2), 3)
    mapped = jax.jit(jax.vmap(full, (0, None, 0)))(vectors, SHORT, keys)
    for index in range(3):
        one = full(vectors[index], SHORT, keys[index])
        np.testing.assert_allclose(mapped[index], one, rtol=1e-12, atol=1e-12)


@jax.jit
def score(vector, drive=DRIVE):
    weights = jnp.asarray(np.random.default_rng(3).normal(size=(81, 3)))
    return jnp.sum(weights * full(vector, SHORT, drive=drive))


forward, reverse = jax.jit(jax.jacfwd(score)), jax.jit(jax.grad(score))


def somewhere():
    """A point off neutral where all smooth effects act, none of them at a corner."""
    effects = [Effect(name, entry.typical()) for name, entry in CATALOGUE.items() if entry.smooth and not entry.random]
    vector = to_vector(effects)
    return vector.at[PLACE["transport_delay", "delay"]].set(0.05 + 1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("point", ["neutral", "off neutral"])
def test_forward_and_reverse_derivatives_agree(point):
    vector = jnp.asarray(NEUTRAL) if point == "neutral" else somewhere()
    one, other = np.asarray(forward(vector)), np.asarray(reverse(vector))
    assert np.isfinite(one).all()
    by_drive = jax.jit(jax.grad(score, 1))(vector, DRIVE)
    np.testing.assert_allclose(one, other, rtol=1e-8, atol=1e-9 * np.abs(one).max())
    assert np.isfinite(np.concatenate([np.ravel(leaf) for leaf in by_drive])).all()


@pytest.mark.slow
def test_derivatives_at_neutral_match_differences():
    """One-sided, of second order, where the parameter may not be negative, else central; steps of 1e-5."""
    vector, h = jnp.asarray(NEUTRAL), 1e-5
    along = jax.jit(lambda direction: jax.jvp(score, (vector,), (direction,))[1])  # compiles faster than all at once
    for names in RATES:
        place = PLACE[names]
        parameter = next(p for p in CATALOGUE[names[0]].parameters if p.name == names[1])
        up, twice, down = (float(score(vector.at[place].add(k * h))) for k in (1, 2, -1))
        sided = parameter.least == parameter.neutral
        slope = (4 * up - twice - 3 * float(score(vector))) / (2 * h) if sided else (up - down) / (2 * h)
        found = float(along(jnp.zeros_like(vector).at[place].set(1.0)))
        assert found == pytest.approx(slope, rel=2e-4, abs=2e-5), names


def test_effects_without_a_derivative_give_a_grid():
    for entry in CATALOGUE.values():
        assert entry.smooth != bool(entry.grid), entry.name
        assert entry.parameters[0].neutral not in (entry.grid or ())


def test_drifts_go_on_from_run_to_run():
    model = typical("gain_drift")
    runs = join([drive_log(81), drive_log(81)])
    made = simulate_runs(model, runs, key=jax.random.key(0)).runs()
    later = ji.simulate(model, drive_log(81), session_time=80 * ROBOT.sample_period)
    np.testing.assert_allclose(poses(made[0]), poses(ji.simulate(model, drive_log(81))), atol=1e-12)
    np.testing.assert_allclose(poses(made[1]), poses(later), atol=1e-12)
    assert np.abs(poses(made[1]) - poses(made[0])).max() > 1e-3


def test_the_last_command_may_be_missing():
    log = SHORT._replace(u_r=np.append(SHORT.u_r[:-1], np.nan), u_l=np.append(SHORT.u_l[:-1], np.nan))
    model = typical("transport_delay", "stiction")
    np.testing.assert_array_equal(poses(ji.simulate(model, log)), poses(ji.simulate(model, SHORT)))


def test_a_program_of_few_parts_is_the_whole_one():
    """The others at neutral; a delay alone takes no substeps, and its nominal rule for the position is coarser."""
    for names in (("transport_delay", "direction_gain"), ("payload_change", "stiction", "camera_scale"), ("slope",)):
        vector = to_vector([Effect(name, CATALOGUE[name].typical()) for name in names])
        part = jax.jit(partial(run_full, parts=frozenset(names)))(DRIVE, WIDTH, vector, SHORT.t, SHORT.command, START)
        np.testing.assert_allclose(np.stack(part, axis=1), full(vector, SHORT), rtol=1e-9, atol=1e-9)

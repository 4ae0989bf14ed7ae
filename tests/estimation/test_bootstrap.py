"""The bootstrap: its replicates are what the model would show, its blocks what they should be, its intervals right."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxident.array_types import Pose, Wheels
from jaxident.errors import InputError
from jaxident.estimation.bootstrap import bootstrap
from jaxident.estimation.identify import identify
from jaxident.estimation.poses.likelihood import innovations
from jaxident.estimation.poses.noise_law import NOISE_LAWS
from jaxident.estimation.poses.parameters import Robot, from_vector, to_vector
from jaxident.estimation.poses.runs import Runs
from jaxident.estimation.uncertainty.blocks import block_length, draw_blocks, long_run_variance
from jaxident.estimation.uncertainty.replicate import replicate_run
from jaxident.log import Log, make_log
from jaxident.robot.drive import Physical
from jaxident.robot.excitation import EXCITATIONS
from jaxident.robot.model import Model
from jaxident.robot.noise import Noise
from jaxident.robot.simulate import simulate

PERIOD = 1.0 / 30.0
DRIVE = Physical(np.array([0.541386, 7.817043]), np.array([[0.128988, 0.127287], [66.824208, -65.25288]]))
DEAD_ZONE = np.array([0.25, 0.2])
NOISE = Noise(1e-3, 1e-2, 0.3, 0.01, 0.1)
MEMORY = -PERIOD / np.log(0.9)


def logged(seed, noise, rows=240):
    command = EXCITATIONS["multilevel"](jax.random.key(seed), rows, hold=10)
    log = make_log(PERIOD * np.arange(rows), *(np.asarray(u) for u in command))
    made = simulate(Model(PERIOD, DRIVE, DEAD_ZONE, noise), log, key=jax.random.key(100 + seed))
    return Log(*(np.asarray(column) for column in made))


def widths(seed, noise):
    """Standard deviations of the eight parameters over those of the likelihood, which takes the camera for white."""
    log = logged(seed, noise)
    found = identify(log, noise_law="white")
    again = bootstrap(jax.random.key(seed), found, log, count=80)
    assert again.ok.mean() > 0.95
    return np.sqrt(np.diagonal(again.covariance) / np.diagonal(np.asarray(found.covariance)))[:8], again, found


@pytest.mark.parametrize(("name", "even"), [("white", True), ("ar1", True), ("slip-ar1", False)])
def test_replicates_have_the_innovations_that_they_are_made_of(name, even):
    law, rows, rng = NOISE_LAWS[name], 60, np.random.default_rng(0)
    command = EXCITATIONS["multilevel"](jax.random.key(0), rows, hold=10)
    seen = jnp.asarray(rng.random(rows) < 0.9)
    step = jnp.asarray(PERIOD) if even else jnp.asarray(PERIOD * rng.uniform(0.7, 1.3, rows))
    run = Runs(step, Wheels(*command), Pose(*jnp.zeros((3, rows))), seen)
    vector = to_vector(Robot(DRIVE, DEAD_ZONE, NOISE), law)
    drawn, start = jnp.asarray(rng.normal(size=(3, rows))), jnp.array([0.1, 0.2, 0.3, 0.1, -0.2])
    pose = replicate_run(from_vector(vector, law), start, run, drawn)
    again = innovations(vector, start, run._replace(pose=pose), law).normalised
    np.testing.assert_allclose(again, np.where(seen, drawn, 0.0), atol=1e-10)


def test_blocks_lie_within_runs_and_fill_the_rows_that_were_seen():
    rng = np.random.default_rng(1)
    seen = rng.random((3, 50)) < 0.8
    seen[1, 30:] = False
    place = np.where(seen, np.cumsum(seen).reshape(seen.shape) - 1.0, 0.0)
    runs = np.repeat(np.arange(3), seen.sum(axis=1))
    rows = jnp.asarray(np.stack([place] * 3, axis=1))
    found = np.asarray(draw_blocks(jax.random.key(2), rows, jnp.asarray(seen), jnp.asarray(6)))
    assert np.all(found[~np.repeat(seen[:, None], 3, axis=1)] == 0.0)
    back = np.round(found + place[seen].mean()).astype(int)
    for own, where in zip(back[:, 0], seen, strict=True):
        drawn = own[where]
        for first in range(0, len(drawn) - 5, 6):
            block = drawn[first : first + 6]
            assert np.all(np.diff(block) == 1)
            assert len(set(runs[block])) == 1


def test_block_length_and_long_run_variance_follow_the_memory():
    """AR(1) of 0.9: by hand (sqrt(6) 0.9 / 0.19)^(2/3) 10 = 51 of 1000 rows; long-run variance 19 less what a block of
    200 rows cuts, 2 * 0.9 / 0.01 / 200 = 0.9. Some 300 independent sums in three channels tell it
    to 8 %."""
    rng = np.random.default_rng(3)
    white = rng.normal(size=(20, 3, 1000))
    coloured = np.zeros_like(white)
    for k in range(1000):
        past = coloured[..., k - 1] if k else white[..., 0]
        coloured[..., k] = 0.9 * past + np.sqrt(0.19) * white[..., k]
    seen = np.ones((20, 1000), bool)
    assert block_length(white, seen) == 5
    assert 45 < block_length(coloured, seen) < 57
    variance = [np.mean(long_run_variance(jnp.asarray(z), jnp.asarray(seen), 200)) for z in (white, coloured)]
    assert variance[0] == pytest.approx(1.0, rel=0.3)
    assert variance[1] == pytest.approx(18.1, rel=0.3)


@pytest.mark.slow
def test_white_noise_gives_the_likelihoods_own_widths_and_coloured_noise_wider_ones():
    """80 replicates tell each of eight widths to 8 %, their root mean square better; blocks of 24 of 240 rows, after a
    fit of ten unknowns, to 20 %. AR(1) noise of 0.9 asks for two to four times wider intervals."""
    ratio, again, found = widths(0, Noise(1e-3, 1e-2))
    assert 0.8 < np.sqrt(np.mean(ratio**2)) < 1.25
    assert again.block < 24
    value = np.concatenate([found.model.physical.rate, np.ravel(found.model.physical.gain), found.model.dead_zone])
    low, high = again.interval[:8].T
    assert np.all((low < value) & (value < high))
    ratio, again, _ = widths(1, Noise(1e-3, 1e-2, MEMORY))
    assert again.block == 24
    assert np.sqrt(np.mean(ratio**2)) > 1.8


@pytest.mark.slow
def test_whole_runs_give_the_same_widths_where_the_law_is_right():
    """Thirty runs: their own spread is told to 13 %."""
    logs = [logged(seed, Noise(1e-3, 1e-2), 60) for seed in range(30)]
    found = identify(logs)
    again = bootstrap(jax.random.key(0), found, logs, resample="runs")
    ratio = np.sqrt(np.diagonal(again.covariance) / np.diagonal(np.asarray(found.covariance)))[:8]
    assert 0.75 < np.sqrt(np.mean(ratio**2)) < 1.3


def test_what_cannot_be_resampled_says_why():
    log = logged(2, Noise(1e-3, 1e-2))
    found = identify(log)
    for fit, settings, words in (
        (found._replace(fit=None), {}, "maximum likelihood"),
        (found, {"count": 10}, "10 replicates"),
        (found, {"resample": "rows"}, "resample 'rows'"),
        (found, {"resample": "runs"}, "1 runs"),
        (found, {"resample": "runs", "block": 5}, "block"),
        (found, {"block": 500}, "block 500"),
    ):
        with pytest.raises(InputError, match=words):
            bootstrap(jax.random.key(0), fit, log, **settings)

"""Runs as rectangles: padded rows change no estimate, and spare a compilation."""

from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support.diagonal_robot import DEAD_ZONE, DRIVE, PERIOD, logged

from jaxident.estimation.identify import identify
from jaxident.estimation.poses.curvature import Point, local_at_best_deviations
from jaxident.estimation.poses.maximum_likelihood import _regular, begin, fit_runs
from jaxident.estimation.poses.parameters import Law, Robot, to_vector
from jaxident.estimation.poses.prior import prior_of
from jaxident.estimation.poses.runs import MANY, SHORT, WINDOW, rows_used, stack_runs, with_room
from jaxident.estimation.poses.stepwise import _look
from jaxident.log import join, make_log
from jaxident.programs import FEW, roomy
from jaxident.robot.noise import Noise

NOISE = Noise(1e-3, 1e-2)


def blank(rows):
    """A log of a robot that stands: no program is compiled to make it."""
    still = np.zeros(rows)
    return make_log(PERIOD * np.arange(rows), still, still, still, still, still)


@pytest.mark.slow
@pytest.mark.parametrize(("law", "jitter"), [(Law(), 0.0), (Law(memory=True), 0.3)], ids=["even", "any"])
def test_room_changes_nothing_that_a_fit_is_made_of(law, jitter):
    """Beginning, prior, curvature and fit of five runs, all shorter than a window, with steps of one length or any."""
    count, noise = 5, NOISE._replace(correlation_time=0.1 if law.memory else None)
    runs = stack_runs(join([logged(k, noise, 90 + 15 * k, jitter) for k in range(count)]))
    more = with_room(runs)
    assert more.seen.shape == (6, WINDOW)
    robot = to_vector(Robot(DRIVE, DEAD_ZONE, NOISE._replace(correlation_time=0.1)), law)

    def found(own):
        point = Point(robot, jnp.zeros((len(own.seen), 5)))
        local = jax.jit(lambda own: (prior_of(own), local_at_best_deviations(point, own, law)))(own)
        whole = jax.tree.map(np.asarray, (begin(own, 0.9), *local))
        return jax.tree.map(lambda part: part[:count] if part.shape[:1] == (len(own.seen),) else part, whole)

    for a, b in zip(*map(jax.tree.leaves, map(found, (runs, more))), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9 * float(np.max(np.abs(b))))
    fit, other = (fit_runs(own, 0.9, law) for own in (runs, more))
    assert bool(fit.ok)
    assert bool(other.ok)
    assert float(other.log_likelihood) == pytest.approx(float(fit.log_likelihood), abs=1e-5)
    deviation = np.sqrt(np.diagonal(fit.covariance))
    apart = np.abs(other.covariance - fit.covariance)
    assert np.all(apart < 1e-3 * np.outer(deviation, deviation))
    pair = [np.concatenate([one.robot.drive.rate, one.robot.dead_zone]) for one in (fit, other)]
    np.testing.assert_allclose(*pair, rtol=1e-5)


def test_logs_of_many_lengths_share_a_program():
    compiled = None
    for rows in (310, 395, 322):
        found = identify(logged(3, NOISE, rows))
        assert found.fit.innovations.normalised.shape == (1, 3, rows)
        assert compiled in (None, _look._cache_size())
        compiled = _look._cache_size()


def test_logs_of_five_and_six_runs_share_a_shape():
    logs = ([110, 195, 122, 50, 133], [195, 110, 122, 150, 133, 170])
    each = [with_room(stack_runs(join([blank(rows) for rows in own]))) for own in logs]
    assert each[0].seen.shape == each[1].seen.shape == (6, WINDOW)
    assert not each[0].seen[5].any()


@pytest.mark.slow  # its programs take 20 s to compile
def test_what_a_fit_tells_is_of_the_logs_own_runs_and_rows():
    rows = [110, 195, 122, 50, 133]
    found = identify([logged(k, NOISE, own) for k, own in enumerate(rows)], noise_law="white")
    assert found.fit.innovations.normalised.shape == (5, 3, 195)
    assert found.fit.starts.shape == (5, 5)


@pytest.mark.parametrize(("poses", "enough"), [(13, True), (11, False)])
def test_the_start_of_a_run_without_a_pose_is_no_unknown(poses, enough):
    """Of each pose three numbers, for ten unknowns of the robot and five starts: 39 are enough, 33 are not."""
    runs = with_room(stack_runs(join([blank(rows) for rows in (3, 3, 3, 2, 2)])))
    runs.seen[0, : 13 - poses] = False
    point = Point(jnp.zeros(10), jnp.zeros((len(runs.seen), 5)))
    search = SimpleNamespace(point=point, local=SimpleNamespace(value=jnp.zeros(())))
    assert bool(_regular(search, jnp.eye(10), runs, jnp.zeros(10, bool))) == enough


def test_many_short_runs_get_fewer_rows_than_whole_windows():
    for rows, expected in ((40, 50), (50, 50), (176, 200)):
        runs = stack_runs(join([blank(rows)] * (MANY + 1)))
        padded = with_room(runs)
        assert padded.seen.shape == (roomy(MANY + 1, (MANY + 1) * expected // SHORT), expected)
        assert int(padded.seen.sum()) == int(runs.seen.sum())
        assert rows_used(padded) == rows


def test_room_is_whole_windows_half_of_short_logs_and_an_eighth_of_long_ones_at_most():
    for rows in (20, WINDOW, WINDOW + 1, 3000, 3400, 22_200, 1_000_003):
        runs = stack_runs(blank(20))
        runs = jax.tree.map(lambda leaf, rows=rows: np.resize(leaf, (1, rows)) if np.ndim(leaf) else leaf, runs)
        length = with_room(runs).seen.shape[1]
        assert length % WINDOW == 0
        assert rows <= length < (1.125 if rows > FEW * WINDOW else 1.5) * (rows + WINDOW)
        assert rows_used(with_room(runs)) == rows
        assert with_room(runs).step == pytest.approx(PERIOD)

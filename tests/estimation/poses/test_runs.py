"""Runs as rectangles: padded rows change no estimate, and spare a compilation."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support.diagonal_robot import DEAD_ZONE, DRIVE, PERIOD, logged

from jaxident.estimation.identify import identify
from jaxident.estimation.poses.curvature import Point, local_at_best_deviations
from jaxident.estimation.poses.maximum_likelihood import begin, fit_from
from jaxident.estimation.poses.parameters import Law, Robot, to_vector
from jaxident.estimation.poses.prior import prior_of
from jaxident.estimation.poses.runs import MANY, WINDOW, pad_rows, rows_used, stack_runs
from jaxident.log import join
from jaxident.robot.noise import Noise

NOISE = Noise(1e-3, 1e-2)


@pytest.mark.slow
@pytest.mark.parametrize(("law", "jitter"), [(Law(), 0.0), (Law(memory=True), 0.3)], ids=["even", "any"])
def test_padded_rows_change_nothing_that_a_fit_is_made_of(law, jitter):
    """Beginning, prior and curvature of two runs, both shorter than a window, with steps of one length or any."""
    runs = stack_runs(join([logged(1, NOISE, 90, jitter), logged(2, NOISE, 150, jitter)]))
    point = Point(to_vector(Robot(DRIVE, DEAD_ZONE, NOISE._replace(correlation_time=0.1)), law), jnp.zeros((2, 5)))
    local = jax.jit(lambda own: (prior_of(own), local_at_best_deviations(point, own, law)))
    both = [(begin(own, 0.9), *local(own)) for own in (runs, pad_rows(runs))]
    for a, b in zip(*map(jax.tree.leaves, both), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9 * float(np.max(np.abs(b))))


def test_logs_of_many_lengths_share_a_program():
    compiled = None
    for rows in (310, 395, 322):
        found = identify(logged(3, NOISE, rows))
        assert found.fit.innovations.normalised.shape == (1, 3, rows)
        assert compiled in (None, fit_from._cache_size())
        compiled = fit_from._cache_size()


def test_many_short_runs_are_padded_by_less_than_an_eighth_of_a_window():
    for rows, expected in ((40, 50), (50, 50), (176, 200)):
        runs = stack_runs(join([logged(k, rows=rows) for k in range(MANY + 1)]))
        padded = pad_rows(runs)
        assert padded.seen.shape == (MANY + 1, expected)
        assert int(padded.seen.sum()) == int(runs.seen.sum())
        assert rows_used(padded) == rows


def test_padding_is_whole_windows_and_an_eighth_at_most():
    for rows in (20, WINDOW, WINDOW + 1, 3000, 3400, 22_200, 1_000_003):
        runs = stack_runs(logged(0, rows=20))
        runs = jax.tree.map(lambda leaf, rows=rows: np.resize(leaf, (1, rows)) if np.ndim(leaf) else leaf, runs)
        length = pad_rows(runs).seen.shape[1]
        assert length % WINDOW == 0
        assert rows <= length < max(rows + WINDOW, 1.125 * rows)
        assert rows_used(pad_rows(runs)) == rows
        assert pad_rows(runs).step == pytest.approx(PERIOD)

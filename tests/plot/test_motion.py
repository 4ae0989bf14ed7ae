"""The driven path and prediction errors as pictures."""

import numpy as np
from matplotlib.collections import LineCollection

from jaxident import plot
from jaxident.estimation.predict import Prediction
from jaxident.log import make_log


def prediction_from(starts) -> Prediction:
    """Three rows of straight prediction from each (run, start)."""
    keys = np.repeat(np.array(starts, int).reshape(-1, 2), 3, axis=0)
    step = np.tile([1, 2, 3], len(starts))
    x = keys[:, 1] + 0.1 * step
    return Prediction(keys[:, 0], keys[:, 1], step, x, x, 0.0 * x, 0.0 * x, *(0.0 * x,) * 3)


def curves(ax):
    return [artist for artist in ax.collections if isinstance(artist, LineCollection)]


def test_path_shows_the_poses_that_were_seen_with_equal_scales(log):
    _, ax = plot.figure()
    assert plot.path(log, ax=ax) is ax
    assert len(ax.lines[0].get_xdata()) == 56
    assert ax.get_aspect() == 1.0
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$x$ [m]", "$y$ [m]")


def test_path_draws_one_curve_for_each_run_and_start(two_runs):
    ax = plot.path(two_runs, prediction_from([(0, 20), (0, 40), (1, 40)]))
    (drawn,) = curves(ax)
    assert [len(segment) for segment in drawn.get_segments()] == [3, 3, 3]


def test_path_takes_an_empty_prediction_and_a_camera_that_saw_nothing(log):
    assert curves(plot.path(log, prediction_from([]))) == []
    blind = make_log(log.t, log.u_r, log.u_l)
    assert plot.path(blind).lines[0].get_xdata().size == 0


def test_a_long_path_does_not_fill_a_vector_file(tmp_path):
    angle = np.linspace(0.0, 300.0, 60_000)
    long = make_log(angle, angle, angle, angle * np.cos(angle), angle * np.sin(angle), angle)
    target = tmp_path / "path.svg"
    plot.save(plot.path(long).figure, target)
    assert target.stat().st_size < 500_000  # a megabyte and more with every point as text


def test_prediction_error_shows_quantiles_of_the_size_where_there_are_any():
    step_time = np.array([0.1, 0.2, 0.3])
    position = 1e-3 * np.array([[1.0, -2.0, np.nan], [3.0, 4.0, np.nan], [5.0, np.nan, np.nan]])
    _, axes = plot.figure(1, 2)
    assert plot.prediction_error(step_time, position, position, axes=axes) is axes
    median = axes[0].lines[0]
    np.testing.assert_allclose(median.get_xdata(), [0.1, 0.2])
    np.testing.assert_allclose(median.get_ydata(), [3.0, 3.0])
    assert [ax.get_ylabel() for ax in axes] == ["position error [mm]", "heading error [mrad]"]


def test_prediction_error_takes_no_predictions():
    axes = plot.prediction_error(np.array([0.1, 0.2]), np.empty((0, 2)), np.empty((0, 2)))
    assert [len(ax.lines) for ax in axes] == [0, 0]


def test_stretches_begin_at_the_first_prediction_where_the_camera_saw_nothing():
    measured = np.array([[[np.nan, np.nan], [1.1, 2.0], [1.2, 2.0]]])
    path = np.array([[[1.0, 2.0], [1.1, 2.1], [1.2, 2.2]]])
    ax = plot.stretches(measured, {"nominal model": path}, titles=["run 1"])
    seen, line = ax.lines[0].get_xydata(), ax.lines[1].get_xydata()
    np.testing.assert_allclose(seen[1:], [[100.0, 0.0], [200.0, 0.0]])
    np.testing.assert_allclose(line, [[0.0, 0.0], [100.0, 100.0], [200.0, 200.0]])
    assert ax.get_title(loc="left") == "run 1"

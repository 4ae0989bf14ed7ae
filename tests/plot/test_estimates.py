"""Estimated parameters as pictures."""

import numpy as np
import pytest

from jaxident import plot
from jaxident.plot.names import written

NAMES = ("alpha_1", "delta_21", "epsilon_12", "dead_zone_l")


@pytest.mark.parametrize(
    ("name", "label", "scale"),
    [
        ("alpha_2", r"$\alpha_{2}$ [–]", 1.0),
        ("delta_12", r"$\delta_{12}$ [mm/unit]", 1e3),
        ("epsilon_21", r"$\epsilon_{21}$ [mrad/unit]", 1e3),
        ("dead_zone_r", "$D_{r}$ [unit]", 1.0),
        ("lag_time", "lag time", 1.0),
        ("mass", "mass", 1.0),
        ("alpha", "alpha", 1.0),
    ],
)
def test_parameters_are_written_with_symbol_and_unit(name, label, scale):
    assert written(name).label == label
    assert written(name).scale == scale


def history(samples=40):
    t = np.arange(float(samples))
    truth = np.array([0.98, 0.034, 7e-5, 0.2])
    values = truth * (1.0 + 1.0 / (1.0 + t[:, None]))
    values[5] = np.nan
    deviations = np.where(t[:, None] < 3, 1e6, 0.1) * truth
    return t, values, deviations, truth


def test_convergence_draws_every_parameter_in_its_unit():
    t, values, deviations, truth = history()
    _, axes = plot.figure(2, 2)
    assert plot.convergence(t, values, deviations, names=NAMES, truth=truth, axes=axes) is axes
    estimate, true = axes[0, 1].lines
    np.testing.assert_allclose(estimate.get_ydata(), 1e3 * values[:, 1])
    np.testing.assert_allclose(true.get_ydata(), 34.0)
    assert axes[0, 1].get_ylabel() == r"$\delta_{21}$ [mrad/unit]"
    assert axes[1, 0].get_xlabel() == axes[1, 1].get_xlabel() == "time [s]"


def test_a_wide_first_guess_does_not_flatten_the_rest():
    t, values, deviations, truth = history()
    axes = plot.convergence(t, values, deviations, names=NAMES)
    low, high = axes[0, 0].get_ylim()
    assert low < truth[0] < high
    assert high - low < 2.0 * truth[0]


def test_an_odd_number_of_parameters_leaves_no_empty_frame():
    t, values, deviations, _ = history()
    axes = plot.convergence(t, values[:, :3], deviations[:, :3], names=NAMES[:3])
    assert [ax.get_visible() for ax in axes.ravel()] == [True, True, True, False]


def test_tracking_shows_truth_estimate_and_band():
    t, values, deviations, _ = history()
    _, ax = plot.figure()
    assert plot.tracking(t, 0.2, values[:, 3], deviations[:, 3], label="dead_zone_l", ax=ax) is ax
    estimate, true = ax.lines
    np.testing.assert_array_equal(estimate.get_ydata(), values[:, 3])
    np.testing.assert_array_equal(true.get_ydata(), 0.2)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("time [s]", "$D_{l}$ [unit]")


def test_tracking_takes_an_unknown_truth_and_an_estimate_that_never_was():
    nothing = np.full(5, np.nan)
    ax = plot.tracking(np.arange(5.0), None, nothing, nothing, label="alpha_1")
    assert len(ax.lines) == 1


def test_error_against_noise_shows_the_root_mean_square_and_counts_failures():
    noise = np.array([1e-4, 1e-3])
    found = np.array([[1.3, 0.6, np.nan], [np.nan, np.nan, np.nan]])
    _, ax = plot.figure()
    drawn = plot.error_against_noise(noise, {"paper": found}, truth=1.0, label="alpha_1", ax=ax, bound=1e3 * noise)
    assert drawn is ax
    square = next(line for line in ax.lines if line.get_label() == "paper (4 of 6 failed)")
    np.testing.assert_allclose(square.get_ydata(), [np.sqrt(0.125), np.nan])
    np.testing.assert_allclose(square.get_xdata(), [0.1, 1.0])
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("camera noise in position [mm]", r"error of $\alpha_{1}$ [–]")
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")


def test_error_against_noise_has_room_for_no_noise():
    found = 1.0 + 0.1 * np.eye(3)
    ax = plot.error_against_noise([0.0, 2e-3, 5e-3], {"a": found, "b": found}, truth=1.0, label="alpha_1")
    ax.figure.canvas.draw()
    left, right = ax.get_xlim()
    assert left < 0.0
    assert right > 5.0
    assert [tick.get_text() for tick in ax.get_xticklabels()] == ["0", "2", "5"]

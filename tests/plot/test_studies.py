"""Pictures of studies: what is drawn is what was given."""

import numpy as np
from matplotlib import pyplot

from jaxident import plot
from jaxident.plot.studies import Curve


def test_error_curves_show_error_band_bias_and_bound():
    noise = [1e-6, 1e-5, 1e-4]
    curve = Curve(*(np.array([1.0, 2.0, 3.0]) * k for k in (1e-3, 1e-4, -5e-4, 1e-4)))
    _, ax = pyplot.subplots()
    made = plot.error_curves(noise, {"batch": curve, "other": curve}, label="alpha_1", ax=ax, bound=[1e-4, 1e-4, 1e-4])
    assert made is ax
    np.testing.assert_allclose(ax.lines[0].get_ydata(), curve.rmse)
    np.testing.assert_allclose(ax.lines[-1].get_ydata(), 1e-4)
    assert len(ax.collections) >= 2


def test_all_failed_draws_an_empty_curve():
    nothing = Curve(*(np.full(2, np.nan) for _ in range(4)))
    plot.error_curves([0.0, 1e-3], {"batch": nothing}, label="dead_zone_r")


def test_heat_map_writes_its_values():
    ax = plot.heat_map([[0.5, 1234.0], [np.nan, 3.0]], rows=["a", "b"], columns=["1", "2"], label="error [%]")
    assert [text.get_text() for text in ax.texts] == ["0.5", "1234", "3"]
    plot.heat_map([[np.nan]], rows=["a"], columns=["1"], label="nothing")


def test_histogram_keeps_outliers_and_leaves_failures_out():
    errors = np.concatenate([np.linspace(-1.0, 1.0, 998), [50.0, np.nan]])
    ax = plot.error_histogram({"batch": errors}, label="alpha_1", bound=0.5)
    low, high = ax.get_xlim()
    assert -1.2 < low < -0.9
    assert 0.9 < high < 1.2
    plot.error_histogram({"batch": np.full(3, np.nan)}, label="alpha_1")


def test_estimate_errors_are_in_per_cent():
    ax = plot.estimate_errors({"batch": ([1.1, 2.0], [0.1, np.nan])}, truth=[1.0, 2.0], names=["alpha_1", "alpha_2"])
    np.testing.assert_allclose(ax.lines[0].get_ydata(), [10.0, 0.0], atol=1e-9)

"""Pictures of what a fit leaves."""

import numpy as np

from jaxident import plot


def test_residuals_and_their_lines():
    values = np.arange(30.0).reshape(3, 10)
    values[1, 4] = np.nan
    axes = plot.residuals(np.arange(10.0), values)
    for ax, row in zip(axes, values, strict=True):
        np.testing.assert_array_equal(ax.lines[0].get_ydata(), row)
        assert {line.get_ydata()[0] for line in ax.lines[1:]} == {-2.0, 2.0}


def test_correlation_has_a_band_that_shrinks_with_the_rows():
    values = 0.1 * np.arange(12.0).reshape(3, 4)
    ax = plot.correlation(values, 100)
    np.testing.assert_array_equal(ax.lines[0].get_xdata(), [1, 2, 3, 4])
    np.testing.assert_allclose(ax.lines[2].get_ydata(), values[2])
    assert ax.patches[0].get_height() == 2 * 2.58 / 10

"""Pictures of discovered laws: what is drawn lies where the law has it."""

import numpy as np
import pytest

import jaxident as ji
from jaxident.robot.model import Discovered

AT, SECOND = np.linspace(-1.0, 1.0, 5), np.linspace(0.0, 3.0, 4)


def surface(deviation: float | None = None) -> Discovered:
    """One that grows along x and stays as it is along y, but for a corner."""
    value = np.repeat(AT[:, None], 4, axis=1)
    value[0, 3] = 2.0
    spread = None if deviation is None else np.full(value.shape, deviation)
    return Discovered("acceleration along", "v", "x", AT, value, spread, "y", SECOND)


def test_colours_of_a_map_are_the_values_where_they_are():
    ax = ji.plot.discovered(surface())
    (mesh,) = [artist for artist in ax.collections if hasattr(artist, "get_coordinates")]
    x, y = np.moveaxis(mesh.get_coordinates(), -1, 0)
    drawn = mesh.get_array().reshape(x.shape)
    for place, value in (((-1.0, 3.0), 2.0), ((-1.0, 0.0), -1.0), ((1.0, 3.0), 1.0), ((0.5, 1.0), 0.5)):
        near = np.hypot(x - place[0], y - place[1]).argmin()
        assert drawn.ravel()[near] == pytest.approx(value)
    assert ax.get_xlim()[0] < x.min() + 1e-9
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("position x [m]", "position y [m]")


def test_knots_of_a_map_stand_where_they_are_and_are_hollow_where_nothing_is_known():
    counts = np.arange(20)
    ax = ji.plot.discovered(surface(0.3), counts)
    dots = ax.collections[-1]
    np.testing.assert_allclose(np.asarray(dots.get_offsets())[7], [AT[1], SECOND[3]])
    assert np.argmax(dots.get_sizes()) == 19
    hollow = np.asarray(dots.get_facecolors())[:, 3] == 0.0
    np.testing.assert_array_equal(hollow, np.abs(np.ravel(surface().value)) <= 0.6)


def test_a_curve_has_its_band_and_bars():
    law = Discovered("acceleration along", "1", "v", AT, AT**2, np.full(5, 0.1))
    ax = ji.plot.discovered(law, [1, 2, 3, 2, 1])
    (line,) = [line for line in ax.lines if len(line.get_xdata()) == 5]
    np.testing.assert_allclose(line.get_ydata(), AT**2)
    assert len(ax.patches) == 5

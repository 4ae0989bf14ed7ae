"""Pictures of a diagnosis: what is drawn is what was given."""

import numpy as np
from matplotlib import pyplot
from matplotlib.patches import Rectangle

from jaxident import plot


def test_gap_levels_show_models_floor_and_interval():
    _, ax = pyplot.subplots()
    levels = {"nominal": [40.0, 30.0], "corrected": [1.2, 1.3]}
    intervals = {"nominal": [(30.0, 50.0), (25.0, 35.0)], "corrected": [(1.0, 1.5), (1.1, 1.4)]}
    made = plot.gap_levels(
        levels, [1.0, 1.1], rows=("all", "along"), intervals=intervals, floor_interval=(0.8, 1.2), ax=ax
    )
    assert made is ax
    assert ax.get_xscale() == "log"
    assert [label.get_text() for label in ax.get_yticklabels()] == ["all", "along"]
    points = {bar.get_label(): bar.lines[0].get_xdata() for bar in ax.containers}
    np.testing.assert_allclose(points["nominal"], [40.0, 30.0])
    ends = ax.containers[0].lines[2][0].get_segments()[0][:, 0]
    np.testing.assert_allclose(ends, (30.0, 50.0))
    assert ax.get_xlim()[0] < 0.8


def test_gap_map_writes_ranges_and_frames_what_stands_out():
    table = {"speed": (np.array([0.0, 0.1, 250.4]), np.array([-1.0, 30.0])), "x": (np.array([-1.0, 1.0]), [3.0])}
    ax = plot.gap_map(table, marked={("speed", 1)}, label="excess")
    assert [text.get_text() for text in ax.texts] == ["0 … 0.1", "0.1 … 250.4", "−1 … 1"]
    frames = [patch for patch in ax.patches if isinstance(patch, Rectangle)]
    assert [frame.get_x() + 0.5 * frame.get_width() for frame in frames] == [1.0]
    assert np.ma.getmaskarray(ax.images[0].get_array())[1, 1]
    nothing = plot.gap_map({"speed": (np.array([0.0, 1.0, 2.0]), np.array([-1.0, -2.0]))}, label="excess")
    nothing.figure.draw_without_rendering()


def test_gap_map_writes_no_digits_that_tell_nothing():
    table = {"turn rate squared": (np.array([2.2e-6, 2.1, 9.1, 80.4]), np.ones(3))}
    ax = plot.gap_map(table, label="excess")
    assert [text.get_text() for text in ax.texts] == ["0 … 2", "2 … 9", "9 … 80"]


def test_edges_that_no_digit_tells_apart_are_written_alike():
    table = {"x": (np.array([1.0, np.nextafter(1.0, 2.0), 2.0]), np.ones(2))}
    ax = plot.gap_map(table, label="excess")
    assert [text.get_text() for text in ax.texts] == ["1 … 1", "1 … 2"]


def test_ranking_is_logarithmic_only_where_gains_span_decades():
    needed, notes = {"delay": 13.0, "lag": 13.0}, {"delay": "99 %", "lag": "1 %"}
    ax = plot.ranking({"delay": 400.0, "lag": 0.0}, needed, notes=notes, groups={"delay": "selected"})
    assert ax.get_xscale() == "log"
    assert [text.get_text() for text in ax.texts] == ["99 %", "1 %"]
    assert all(ax.get_xlim()[0] <= text.xy[0] <= ax.get_xlim()[1] for text in ax.texts)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["needed", "selected", "others"]
    assert plot.ranking({"delay": 40.0, "lag": 35.0}, needed).get_xscale() == "linear"


def test_shrinks_are_in_per_cent_with_all_groups():
    values, intervals = {"delay": 0.9, "scale": 0.01}, {"delay": (0.8, 0.95), "scale": (-0.02, 0.03)}
    ax = plot.shrinks(values, intervals, groups={"delay": "corrected model", "scale": "placebo"})
    assert {bar.get_label(): list(bar.lines[0].get_xdata()) for bar in ax.containers} == {
        "corrected model": [90.0],
        "placebo": [1.0],
    }
    low, high = ax.get_xlim()
    assert low < 0.0
    assert high > 100.0


def test_the_waterfall_adds_up_to_all():
    shares = {"camera": 0.1, "delay": 0.85, "marker": -0.05, "rest": 0.1}
    ax = plot.waterfall(shares, {name: (s - 0.02, s + 0.02) for name, s in shares.items()}, notes={"delay": "8 mm"},
                        noise=["camera"])  # fmt: skip
    bars = sorted(ax.patches, key=lambda bar: bar.get_y())
    np.testing.assert_allclose([bar.get_width() for bar in bars], [10.0, 85.0, -5.0, 10.0])
    np.testing.assert_allclose([bar.get_x() for bar in bars], [0.0, 10.0, 95.0, 90.0])
    assert [text.get_text() for text in ax.texts if text.get_text()] == ["8 mm"]
    assert len({tuple(bar.get_facecolor()) for bar in bars}) == 3

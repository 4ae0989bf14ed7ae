"""The signature of an effect as a row of panels."""

import numpy as np

from jaxident import plot


def test_each_channel_that_moves_is_drawn_over_its_own_size():
    channels = ("along", "lateral", "heading")
    departure = dict(zip(channels, np.outer([2.0, 0.0, 500.0], np.sin(np.arange(30.0))), strict=True))
    regressors = {label: dict.fromkeys(channels, np.arange(30.0)) for label in ("time [s]", "speed")}
    _, axes = plot.figure(1, 2)
    assert plot.effect_signature("motor_lag", departure, regressors, axes=axes) is axes
    for ax, label in zip(axes, regressors, strict=True):
        assert ax.get_xlabel() == label
        assert [line.get_label().split(",")[0] for line in ax.lines] == ["along", "heading"]
        assert all(np.abs(line.get_ydata()).max() == 1.0 for line in ax.lines)
    assert axes[0].get_title(loc="left") == "motor lag"


def test_the_legend_lies_inside_the_picture():
    channels = ("along", "lateral", "heading")
    departure = dict.fromkeys(channels, np.sin(np.arange(30.0)))
    made, axes = plot.figure(1, 5, size=(13.0, 1.9))
    regressors = {f"number {k}": dict.fromkeys(channels, np.arange(30.0)) for k in range(5)}
    plot.effect_signature("motor_lag", departure, regressors, axes=axes)
    made.canvas.draw()
    legend, panel = axes[-1].get_legend().get_window_extent(), axes[-1].get_window_extent()
    assert panel.y1 <= legend.y0
    assert legend.y1 <= made.bbox.y1

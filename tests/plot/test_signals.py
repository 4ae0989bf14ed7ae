"""Commands, dead zones and increments as pictures."""

import numpy as np
import pytest

from jaxident import plot
from jaxident.array_types import Increment


def curve(ax, label):
    return next(line for line in ax.lines if line.get_label() == label)


def test_dead_zone_has_its_corners_at_plus_and_minus_the_width():
    _, ax = plot.figure()
    assert plot.dead_zone([0.25, 0.2], ax=ax, label=["right", "left"]) is ax
    u, m = curve(ax, "right").get_data()
    np.testing.assert_allclose(u, [-1.0, -0.25, 0.25, 1.0])
    np.testing.assert_allclose(m, [-0.75, 0.0, 0.0, 0.75])
    assert ax.get_xlabel() == "command $u$ [unit]"


def test_dead_zone_takes_one_width_and_one_that_is_missing():
    ax = plot.dead_zone(0.3)
    assert curve(ax, "D = 0.3").get_xdata()[1] == -0.3
    assert not np.isfinite(curve(plot.dead_zone(np.nan, label="none"), "none").get_ydata()).any()


def test_a_label_too_many_is_an_error():
    with pytest.raises(ValueError, match="zip"):
        plot.dead_zone(0.3, label=["right", "left"])


def test_commands_are_steps_held_until_the_next_row(log):
    _, ax = plot.figure()
    assert plot.commands(log, ax=ax, dead_zone=(0.25, 0.2)) is ax
    line = curve(ax, "right wheel")
    assert line.get_drawstyle() == "steps-post"
    np.testing.assert_array_equal(line.get_ydata(), log.u_r)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("time [s]", "command $u$ [unit]")
    bands = [patch for patch in ax.patches if "dead zone" in patch.get_label()]
    assert [band.get_height() for band in bands] == pytest.approx([0.5, 0.4])


def test_commands_of_several_runs_follow_one_another(two_runs):
    ax = plot.commands(two_runs)
    assert ax.get_xlabel() == "session time [s]"
    ends = sorted({float(line.get_xdata()[-1]) for line in ax.lines})
    assert ends == pytest.approx([5.9, 11.8])


def test_increments_are_drawn_in_millimetres_and_milliradians(increment):
    t = np.arange(50.0)
    model = Increment(*(0.9 * signal for signal in increment))
    _, (ax, strip) = plot.figure(2, 1, share_x=True)
    assert plot.increments(t, increment, model, ax=ax, residual_ax=strip, channel="turn") is ax
    np.testing.assert_allclose(curve(ax, "measured").get_ydata(), 1e3 * increment.turn)
    np.testing.assert_allclose(strip.lines[0].get_ydata(), 100.0 * increment.turn, atol=1e-12)
    assert (ax.get_ylabel(), strip.get_ylabel()) == ("turn per sample [mrad]", "residual [mrad]")
    assert (ax.get_xlabel(), strip.get_xlabel()) == ("", "time [s]")
    assert plot.increments(t, increment, model).get_ylabel() == "path length per sample [mm]"


def test_wheel_speeds_stand_between_the_command_and_the_motion():
    t, one = np.arange(10.0), np.ones((2, 10))
    _, axes = plot.figure(3, 1)
    plot.wheel_speeds((t, one), (t, 2.0 * one), (t, 3.0 * one),
                      modelled={"nominal model": (t[5:], 4.0 * one[:, 5:])}, axes=axes)  # fmt: skip
    assert [line.get_label() for line in axes[1].lines] == ["robot (poses)", "wheels", "nominal model"]
    np.testing.assert_array_equal(curve(axes[0], "wheels").get_ydata(), 2.0 * one[0])
    np.testing.assert_array_equal(curve(axes[2], "left").get_ydata(), 3.0 * one[1])
    assert [ax.get_ylabel() for ax in axes] == ["speed [m/s]", "turn rate [rad/s]", "command [unit]"]

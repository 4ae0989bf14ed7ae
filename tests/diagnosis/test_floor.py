"""The floor by replay against its exact mean, and the spread that windows in common leave it."""

import numpy as np
import pytest
from support.arcs import along_arcs

from jaxident.diagnosis.extent.floor import REPLAYS, floor_of
from jaxident.diagnosis.extent.gap import early_inverse, ends_of
from jaxident.diagnosis.motion.responses import answer_to_start, respond
from jaxident.diagnosis.noise.doubt import Draws
from jaxident.diagnosis.noise.law import Law, variances_of

ROWS, COUNT, BURN = 40, 12, 10
VECTOR = np.log([4.0, 5.0])
SLIPPING = Law(5e-4, 4e-3, (0.03, 0.4), 0.2)
REMEMBERING = Law(5e-4, 4e-3, coloured=(1e-3, 5e-3), coloured_time=0.3)


def draws(law, doubt, times=(0.2,)):
    """As many as replays, in turns of these memories, the variances of doubtful size."""
    sizes = np.sqrt(variances_of(law))[:, None]
    unit = np.random.default_rng(7).normal(size=(len(sizes), REPLAYS))
    slip_time = None if law.slip is None else np.resize(times, REPLAYS)
    return Draws(sizes * np.exp(0.5 * np.sqrt(doubt) * unit), slip_time, law.coloured_time)


def floor(law, stride, doubt=0.0, times=(0.2,)):
    windows, nothing = along_arcs(ROWS, COUNT, stride), np.zeros((COUNT, 3 * ROWS))
    responses = respond(np.exp(VECTOR), nothing, windows)
    ends = ends_of(answer_to_start(np.exp(VECTOR), nothing, windows), early_inverse(law, windows, responses, BURN))
    return floor_of(nothing, windows, law, draws(law, doubt, times), responses, ends)


@pytest.mark.parametrize("law", [Law(5e-4, 4e-3), SLIPPING, REMEMBERING])
def test_replays_have_the_exact_mean(law):
    found = floor(law, ROWS)
    assert np.mean(found.replays) == pytest.approx(found.value, abs=4.0 * np.std(found.replays) / REPLAYS**0.5)
    assert found.value == pytest.approx(np.mean(found.channels))


def test_a_camera_alone_leaves_its_own_variance_and_that_of_the_start():
    assert 1.0 < floor(Law(5e-4, 4e-3), ROWS).value < 30.0


def test_a_window_without_poses_to_start_from_stays_finite():
    windows, nothing, law = along_arcs(ROWS, COUNT), np.zeros((COUNT, 3 * ROWS)), Law(5e-4, 4e-3)
    windows = windows._replace(seen=windows.seen & ((np.arange(ROWS) >= BURN)[:, None] | (np.arange(COUNT) > 0)))
    inverse = early_inverse(law, windows, respond(np.exp(VECTOR), nothing, windows), BURN)
    early = ends_of(answer_to_start(np.exp(VECTOR), nothing, windows), inverse).early
    assert np.all(early[0] == 0.0)
    assert np.all(np.isfinite(early))
    assert np.all(np.any(early[1:] != 0.0, axis=(1, 2)))


def test_laws_without_their_slip_keep_all_else():
    drawn = draws(Law(5e-4, 4e-3, (0.03, 0.4), 0.2, (1e-3, 5e-3), 0.3), 0.5)
    found = drawn.without_slip()
    np.testing.assert_array_equal(found.deviations, drawn.deviations[[0, 1, 4, 5]])
    assert found[1:] == (None, 0.3)
    steady = draws(REMEMBERING, 0.5)
    assert steady.without_slip() is steady


def test_windows_in_common_tell_less():
    """Twelve times the same rows on other arcs, or twelve stretches of their own: sampled more widely, seen by slip."""
    apart, together = (np.std(floor(SLIPPING, stride).replays) for stride in (ROWS, 1))
    assert together > 2.0 * apart


def test_a_doubtful_law_widens_the_floor():
    sure, doubtful = (np.std(floor(SLIPPING, ROWS, doubt).replays) for doubt in (0.0, 0.5))
    assert doubtful > 1.3 * sure


def test_slip_of_longer_memory_leaves_more_at_the_end_of_a_window():
    short, long, either = (floor(SLIPPING, ROWS, 0.0, times).replays for times in ((0.2,), (0.4,), (0.2, 0.4)))
    assert np.mean(long) > 1.2 * np.mean(short)
    assert np.mean(either) == pytest.approx(0.5 * (np.mean(short) + np.mean(long)), rel=0.1)
    assert np.std(either) > np.std(short)

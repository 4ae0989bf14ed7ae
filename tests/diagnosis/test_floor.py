"""The floor by replay against its exact mean, and the spread that windows in common leave it."""

import numpy as np
import pytest
from support.arcs import along_arcs

from jaxident.diagnosis.extent.floor import REPLAYS, floor_of
from jaxident.diagnosis.extent.gap import early_inverse, ends_of
from jaxident.diagnosis.motion.responses import respond
from jaxident.diagnosis.noise import Law

ROWS, COUNT, BURN = 40, 12, 10
VECTOR = np.log([4.0, 5.0])
SLIPPING = Law(5e-4, 4e-3, (0.03, 0.4), 0.2)
REMEMBERING = Law(5e-4, 4e-3, coloured=(1e-3, 5e-3), coloured_time=0.3)


def floor(law, stride, doubt=0.0):
    windows, nothing = along_arcs(ROWS, COUNT, stride), np.zeros((COUNT, 3 * ROWS))
    responses = respond(np.exp(VECTOR), nothing, windows)
    ends = ends_of(VECTOR, nothing, windows, early_inverse(law, windows, responses, BURN))
    variances = 2 + 2 * (law.slip is not None) + 2 * (law.coloured is not None)
    return floor_of(nothing, windows, law, doubt * np.eye(variances), responses, ends)


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
    early = ends_of(VECTOR, nothing, windows, inverse).early
    assert np.all(early[0] == 0.0)
    assert np.all(np.isfinite(early))
    assert np.all(np.any(early[1:] != 0.0, axis=(1, 2)))


def test_windows_in_common_tell_less():
    """Twelve times the same rows on other arcs, or twelve stretches of their own: sampled more widely, seen by slip."""
    apart, together = (np.std(floor(SLIPPING, stride).replays) for stride in (ROWS, 1))
    assert together > 2.0 * apart


def test_a_doubtful_law_widens_the_floor():
    sure, doubtful = (np.std(floor(SLIPPING, ROWS, doubt).replays) for doubt in (0.0, 0.5))
    assert doubtful > 1.3 * sure

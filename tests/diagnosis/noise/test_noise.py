"""Sizes of camera noise and slip from residuals drawn with known ones."""

import numpy as np
import pytest
from support.arcs import along_arcs

from jaxident.diagnosis.motion.responses import answer_to_start, respond
from jaxident.diagnosis.noise.law import (
    Law,
    covariance,
    first_law,
    inverse_of_lower,
    slip_parts,
    white_whitener,
    whitener_of,
)
from jaxident.diagnosis.noise.likelihood import sample
from jaxident.diagnosis.noise.sizing import size_noise, size_one, steady_gain
from jaxident.diagnosis.noise.variance_uncertainty import MEMORIES, doubt_of, draw_laws, sizes_by_memory

ROWS, COUNT = 45, 60
RATES = np.array([4.0, 5.0])


@pytest.fixture(scope="module")
def made():
    """Windows along made-up arcs, answers about them."""
    windows = along_arcs(ROWS, COUNT)
    nothing = np.zeros((COUNT, 3 * ROWS))
    return windows, respond(RATES, nothing, windows), answer_to_start(RATES, nothing, windows)


def sized(law, made, seed):
    """The law found from residuals drawn under another, start states left where a fit would leave them anywhere."""
    rng = np.random.default_rng(seed)
    noise = rng.normal(size=(COUNT, 3 * ROWS, 1))
    return sized_on(law, made, noise, (made[2] @ (0.01 * rng.normal(size=(COUNT, 5, 1))))[..., 0])


def sized_on(law, made, unit, rest):
    """The law found from draws of unit size under another law, and a rest (windows, numbers)."""
    windows, responses, starts = made
    noise = (np.linalg.cholesky(covariance(law, windows, responses)) @ unit)[..., 0]
    measured = windows._replace(pose=windows.pose + noise.reshape(COUNT, ROWS, 3).transpose(1, 0, 2))
    return size_noise(noise + rest, starts, measured, responses)


def test_whitener_whitens(made):
    windows, responses, _ = made
    law = Law(5e-4, 4e-3, (0.02, 0.2), 0.2)
    white = whitener_of(law, windows, responses)
    unit = white @ covariance(law, windows, responses) @ white.transpose(0, 2, 1)
    np.testing.assert_allclose(unit, np.broadcast_to(np.eye(3 * ROWS), unit.shape), atol=1e-8)


def test_white_errors_are_as_large_as_those_of_a_law_whose_memory_took_all(made):
    windows, responses, _ = made
    law = Law(3e-4, 1e-7, coloured=(4e-4, 1e-2), coloured_time=0.5)
    size = np.sqrt(np.diagonal(covariance(law, windows, responses), axis1=1, axis2=2))
    scale = np.diagonal(white_whitener(law, windows), axis1=1, axis2=2)
    np.testing.assert_allclose(scale * size, 1.0, rtol=1e-6)


def test_white_noise_stays_white(made):
    law = Law(5e-4, 4e-3)
    found = sized(law, made, 2)
    assert found.slip is None
    assert found.coloured is None
    # about 2000 positions and 1000 headings: standard errors of 1.6 and 2.2 %, start states aside
    assert found.position == pytest.approx(law.position, rel=0.08)
    assert found.heading == pytest.approx(law.heading, rel=0.1)


def test_noise_is_sized_where_poses_come_every_other_row(made):
    """The rows that fewer are sized from must be those with a pose, whatever the rhythm; one window has none at all."""
    windows, responses, starts = made
    windows = windows._replace(seen=windows.seen & (np.arange(ROWS) % 2 == 1)[:, None] & (np.arange(COUNT) > 0))
    law, mask = Law(5e-4, 4e-3), np.repeat(windows.seen.T, 3, axis=1)
    noise = np.random.default_rng(5).normal(size=(COUNT, ROWS, 3)) * [law.position, law.position, law.heading]
    found = size_noise(noise.reshape(COUNT, -1) * mask, starts * mask[:, :, None], windows, responses)
    assert found.slip is None
    assert found.position == pytest.approx(law.position, rel=0.08)
    assert found.heading == pytest.approx(law.heading, rel=0.1)


def test_slip_is_found_and_sized(made):
    law = Law(5e-4, 4e-3, (0.03, 0.4), 0.2)
    found = sized(law, made, 3)
    assert found.slip is not None
    assert found.slip_time == 0.2
    np.testing.assert_allclose(found.slip, law.slip, rtol=0.3)
    assert found.coloured is None


def test_slip_without_any_camera_error_leaves_a_law_that_whitens(made):
    windows, responses, starts = made
    law = Law(1e-9, 1e-9, (0.1, 0.4), 0.8)
    unit = np.random.default_rng(7).normal(size=(COUNT, 3 * ROWS, 1))
    residual = (np.linalg.cholesky(covariance(law, windows, responses)) @ unit)[..., 0]
    given = sample(residual, starts, windows, responses)
    found = size_one(given, Law(5e-4, 4e-3), 0.8, None).law
    white = whitener_of(found, windows, responses)
    whitened = white @ covariance(found, windows, responses) @ white.transpose(0, 2, 1)
    np.testing.assert_allclose(whitened, np.broadcast_to(np.eye(3 * ROWS), whitened.shape), atol=1e-4)


def test_camera_memory_is_not_taken_for_slip(made):
    law = Law(3e-4, 3e-3, coloured=(1e-3, 1e-2), coloured_time=0.5)
    found = sized(law, made, 4)
    assert found.coloured is not None
    np.testing.assert_allclose(found.coloured, law.coloured, rtol=0.4)


@pytest.mark.parametrize("draws", [2, pytest.param(6, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("share", "size", "claimed"), [(1.0, 1.0, True), (0.08, 4.0, False)])
def test_a_memory_is_the_cameras_where_most_windows_show_it(made, share, size, claimed, draws):
    """Some draws: errors with a memory in all windows, and larger ones in five of sixty, as where wheels slide."""
    windows, responses, starts = made
    kinds = (Law(5e-4, 4e-3), Law(5e-4, 4e-3, coloured=(1e-3 * size, 8e-3 * size), coloured_time=0.5))
    white, slow = (np.linalg.cholesky(covariance(law, windows, responses)) for law in kinds)
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        factor = np.where((rng.permutation(COUNT) < share * COUNT)[:, None, None], slow, white)
        noise = (factor @ rng.normal(size=(COUNT, 3 * ROWS, 1)))[..., 0]
        measured = windows._replace(pose=windows.pose + noise.reshape(COUNT, ROWS, 3).transpose(1, 0, 2))
        law = size_noise(noise, starts, measured, responses)
        assert law.coloured is not None
        assert (steady_gain(noise, starts, measured, responses, law) > 0.0) == claimed


def test_wheels_that_slide_sideways_at_random_are_no_memory_of_the_camera(made):
    """Four draws, the memory in all windows: what tells it from a camera's is its direction."""
    windows, responses, starts = made
    (sideways,) = slip_parts((responses.left,), 0.2, windows)
    slip = Law(5e-4, 4e-3, slip=(0.03, 0.35), slip_time=0.2)
    factor = np.linalg.cholesky(covariance(slip, windows, responses) + 0.01**2 * sideways)
    for seed in range(4):
        noise = (factor @ np.random.default_rng(seed).normal(size=(COUNT, 3 * ROWS, 1)))[..., 0]
        measured = windows._replace(pose=windows.pose + noise.reshape(COUNT, ROWS, 3).transpose(1, 0, 2))
        law = size_noise(noise, starts, measured, responses)
        assert law.coloured is not None
        assert steady_gain(noise, starts, measured, responses, law) == 0.0


def test_a_rest_of_strong_slip_is_no_camera_memory(made):
    """Short slides sideways, of which slip knows nothing, beside slip that explains a hundred times as much."""
    responses, rng = made[1], np.random.default_rng(4)
    noise = rng.normal(size=(COUNT, 3 * ROWS, 1))
    slides = np.zeros((COUNT, ROWS, 1))
    for own in slides:
        own[rng.integers(0, ROWS - 6) :][:6] = 0.003 * rng.choice([-1, 1])
    found = sized_on(Law(5e-4, 4e-3, (0.2, 2.0), 0.05), made, noise, (responses.left @ slides)[..., 0])
    assert found.slip is not None
    assert found.coloured is None


def test_doubt_is_the_spread_of_the_sizes(made):
    """24 draws, four variances each: their logarithms miss by as much as said, standard error of the ratio 7 %."""
    windows, responses, starts = made
    law = Law(5e-4, 4e-3, (0.03, 0.4), 0.2)
    factor = np.linalg.cholesky(covariance(law, windows, responses))
    apart = []
    for seed in range(24):
        residual = (factor @ np.random.default_rng(seed).normal(size=(COUNT, 3 * ROWS, 1)))[..., 0]
        given = sample(residual, starts, windows, responses)
        found = size_one(given, law, 0.2, None).law
        doubt = doubt_of(found, given)
        sizes = [np.log(np.square([one.position, one.heading, *one.slip])) for one in (found, law)]
        apart.append((sizes[0] - sizes[1]) / np.sqrt(np.diagonal(doubt)))
    assert 0.75 < np.sqrt(np.mean(np.square(apart))) < 1.25


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_drawn_memories_lie_about_the_true_one(made, seed):
    """A memory half-way between two of the grid: draws are of its neighbours or close; deviations as they were."""
    windows, responses, starts = made
    memory = np.sqrt(MEMORIES[5] * MEMORIES[6])
    law = Law(5e-4, 4e-3, (0.06, 0.8), memory)
    factor = np.linalg.cholesky(covariance(law, windows, responses))
    residual = (factor @ np.random.default_rng(seed).normal(size=(COUNT, 3 * ROWS, 1)))[..., 0]
    given = sample(residual, starts, windows, responses)
    sizes = sizes_by_memory(law, given)
    assert [sized.law.slip_time for sized in sizes] == list(MEMORIES)
    draws = draw_laws(sizes, given, 400, seed=1)
    assert draws.deviations.shape == (4, 400)
    apart = np.abs(np.log(draws.slip_time / memory))
    assert np.median(apart) < np.log(1.3)
    assert np.mean(apart < np.log(2.0)) > 0.95
    np.testing.assert_allclose(np.median(draws.deviations, axis=1), [5e-4, 4e-3, 0.06, 0.8], rtol=0.35)


def test_a_law_without_slip_has_no_memory_to_draw(made):
    windows, responses, starts = made
    given = sample(np.zeros((COUNT, 3 * ROWS)), starts, windows, responses)
    draws = draw_laws(sizes_by_memory(Law(5e-4, 4e-3), given), given, 50)
    assert draws.slip_time is None
    assert draws.deviations.shape == (2, 50)


def test_fourth_differences_size_the_camera(made):
    windows, _, _ = made
    rng = np.random.default_rng(5)
    noisy = windows.pose + rng.normal(size=windows.pose.shape) * [5e-4, 5e-4, 4e-3]
    found = first_law(windows._replace(pose=noisy))
    assert found.position == pytest.approx(5e-4, rel=0.1)
    assert found.heading == pytest.approx(4e-3, rel=0.1)


def test_fourth_differences_size_the_camera_where_poses_come_every_other_row(made):
    """Logs of events have a command or a pose in each row: no five rows in succession have one."""
    windows, _, _ = made
    rng = np.random.default_rng(5)
    noisy = windows.pose + rng.normal(size=windows.pose.shape) * [5e-4, 5e-4, 4e-3]
    seen = np.broadcast_to((np.arange(ROWS) % 2 == 1)[:, None], windows.seen.shape)
    found = first_law(windows._replace(pose=np.where(seen[..., None], noisy, np.nan), seen=seen))
    assert found.position == pytest.approx(5e-4, rel=0.15)
    assert found.heading == pytest.approx(4e-3, rel=0.15)


@pytest.mark.parametrize("rows", [1, 20, 57, 150])
def test_lower_triangular_matrices_are_inverted_by_halves(rows):
    lower = np.tril(np.random.default_rng(0).normal(size=(3, rows, rows))) / rows + 2.0 * np.eye(rows)
    np.testing.assert_allclose(inverse_of_lower(lower), np.linalg.inv(lower), atol=1e-12)

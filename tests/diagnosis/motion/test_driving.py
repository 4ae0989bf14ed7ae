"""Many vectors at once against one after the other, and loops that are left out against all loops."""

import jax
import numpy as np
import pytest
from support.small_robot import VECTOR, windows_of

from jaxident.diagnosis.motion import linear
from jaxident.diagnosis.motion.driving import AT_ONCE, FEW_WINDOWS, _pushed, pushes_of
from jaxident.diagnosis.motion.linear import follow
from jaxident.diagnosis.motion.paths import push_of, residuals, rolled
from jaxident.diagnosis.motion.rims import rim_speeds
from jaxident.diagnosis.motion.windows import obeying_laws, take, uncut, with_room
from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.coordinates import PLACES, from_catalogue
from jaxident.effects.fast_input import OPTIONAL
from jaxident.effects.law_arrays import IDLE, laws_of

OTHERS = ("turn_loss", "slope", "transport_delay", "mass_offset")
_push, _residuals, _rolled = jax.jit(push_of), jax.jit(residuals), jax.jit(rolled)


@pytest.fixture(scope="module")
def windows():
    """Those of the small robot with room, as most tests of the diagnosis have them: they share its programs."""
    return jax.tree.map(jax.numpy.asarray, with_room(windows_of(VECTOR)))


def vector_with(name) -> np.ndarray:
    """The small robot with a typical effect."""
    vector = VECTOR.copy()
    for key, value in from_catalogue(name, CATALOGUE[name].typical(), vector[:2]).items():
        vector[PLACES[name, key]] = value
    return vector


def starts_of(count, windows) -> np.ndarray:
    return 0.1 * np.random.default_rng(count).normal(size=(count, 5, len(windows.run)))


MANY = pytest.param(2, 7, marks=pytest.mark.slow, id="many windows")  # its programs take 14 s to compile


@pytest.mark.parametrize(("count", "copies"), [(1, 1), (AT_ONCE, 1), (AT_ONCE + 1, 1), (2 * AT_ONCE - 1, 1), MANY])
def test_vectors_side_by_side_are_those_one_after_the_other(windows, count, copies):
    """Seven copies of the windows are so many that a call takes one vector."""
    windows = take(windows, np.tile(np.arange(len(windows.run)), copies))
    assert (len(windows.run) > FEW_WINDOWS) == (copies > 1)
    names = (OTHERS * 2)[:count]
    vectors, starts = np.stack([vector_with(name) for name in names]), starts_of(count, windows)
    found, rims = follow(vectors, starts, windows), rim_speeds(vectors, starts, windows)
    assert len(found) == len(rims) == count
    for k, vector in enumerate(vectors):
        push = _push(vector, windows)
        alone = np.asarray(_residuals(vector, starts[k], push, windows)).transpose(1, 0, 2).reshape(len(found[k]), -1)
        np.testing.assert_allclose(found[k], alone, atol=1e-9)
        speeds = np.concatenate([np.asarray(part).T for part in _rolled(vector, starts[k], push, windows)], axis=1)
        np.testing.assert_allclose(rims[k], speeds, atol=1e-9)


@pytest.mark.parametrize("name", [*OPTIONAL, "turn_loss"])
def test_an_effect_that_no_vector_has_is_left_out_and_changes_nothing(windows, name):
    vectors = np.stack([VECTOR, vector_with(name)])
    for vector, found in zip(vectors, pushes_of(vectors, windows), strict=True):
        whole = _push(vector, windows)  # leaves nothing out; a delay of 0 reads JUST_BEFORE
        size = [np.abs(part).max() for part in whole]
        for part, other, largest in zip(found, whole, size, strict=True):
            np.testing.assert_allclose(part, other, atol=2e-8 * max(largest, 1.0))
    plain, moved = (np.asarray(push.mean) for push in pushes_of(vectors, windows))
    assert np.any(plain != moved) == (name in OPTIONAL)


def test_vectors_that_drive_alike_share_their_pushes(windows):
    """Another rate changes the push of wheels that coast alone."""
    coasts = vector_with("backlash")
    coasts[PLACES["backlash", "coasting"]] = 1.0
    vectors = np.stack([VECTOR, VECTOR, coasts, coasts])
    vectors[[1, 3], 0] += 0.1
    plain, faster, coasting, other = pushes_of(vectors, windows)
    assert plain is faster
    assert np.any(np.asarray(coasting.mean != other.mean))


def test_logs_of_other_lengths_run_through_the_same_programs(windows):
    compiled = []
    for count in (24, 17, 20):
        few = take(windows, np.arange(count))
        few = few._replace(t=few.t[: 350 - count], command=few.command[: 350 - count])
        assert follow(VECTOR[None], starts_of(1, few), few).shape[1] == count
        compiled.append((linear._residuals._cache_size(), _pushed._cache_size()))
    assert len(set(compiled)) == 1


def test_windows_of_a_plan_get_room_beside_laws():
    """Five inputs take the room of six; each has the angles of its wheels."""
    windows = with_room(obeying_laws(uncut(np.zeros((5, 300, 2)), 0.05), laws_of([IDLE])))
    assert windows.laws.phase.shape[1] == len(windows.run) == 6

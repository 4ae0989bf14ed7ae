"""The way from a reported pose back to the robot's, also through a lens that bends the picture much."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

import jaxident as ji
from jaxident.effects.coordinates import by_effect, vector_of
from jaxident.estimation.ahead.camera_pose import missed_by, seen_by, shown_as

LENS = ji.Effect("lens_distortion", {"strength": 0.45, "centre_x": -0.2, "centre_y": 0.0})
TILT = ji.Effect("camera_tilt", {"along_x": 0.05, "along_y": 0.1})
MARKER = ji.Effect("marker_offset", {"ahead": 0.03, "left": -0.02})


def settings(*effects):
    return by_effect(vector_of(dataclasses.replace(ji.load_model("published"), effects=effects)))


def poses(count: int = 100):
    """Poses (3, count) in half a room."""
    low, high = np.array([[0.0, -0.75, -np.pi], [0.6, 0.75, np.pi]])[..., None]
    return jnp.asarray(np.random.default_rng(3).uniform(low, high, (3, count)))


@pytest.mark.parametrize("effects", [(), (MARKER,), (LENS,), (LENS, TILT), (LENS, TILT, MARKER)])
def test_the_pose_that_is_reported_so_is_found(effects):
    own, true = settings(*effects), poses()
    np.testing.assert_allclose(missed_by(true, shown_as(own, seen_by(own, true)[0])), 0.0, atol=1e-9)


def test_the_lens_of_these_tests_bends_much():
    own, true = settings(LENS), poses()
    assert float(jnp.max(jnp.hypot(*(seen_by(own, true)[0] - true)[:2]))) > 0.25


def test_what_no_pose_is_reported_as_stays_finite():
    """A picture that a lens folds: no robot is seen at its edge."""
    own = settings(ji.Effect("lens_distortion", {"strength": -0.5, "centre_x": 0.0, "centre_y": 0.0}))
    assert np.all(np.isfinite(shown_as(own, 3.0 * poses())))


def test_headings_are_missed_the_short_way_round():
    np.testing.assert_allclose(
        missed_by(jnp.array([[0.0], [0.0], [3.1]]), jnp.array([[0.0], [0.0], [-3.1]]))[2], 6.2 - 2 * np.pi
    )

"""The follower of windows against the full simulator, which integrates with other steps and another rule."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxident.array_types import AT_REST
from jaxident.diagnosis.motion.paths import first_angles, push_of, residuals, track
from jaxident.diagnosis.motion.windows import cut
from jaxident.diagnosis.preparation.translate import abreast_of_marker
from jaxident.effects.catalogue import CATALOGUE, to_vector
from jaxident.effects.coordinates import (
    COORDINATES,
    ON_SPEEDS,
    PLACES,
    SIZE,
    by_effect,
    free_places,
    from_catalogue,
    neutral_vector,
    nominal_vector,
)
from jaxident.effects.fast_input import PUSHING
from jaxident.effects.fast_motion import report
from jaxident.effects.full import SHARP_SUBSTEPS, run_full, run_states
from jaxident.effects.law_arrays import laws_of
from jaxident.log import make_log
from jaxident.robot.drive import Physical
from jaxident.robot.model import Discovered, Effect

STEP, ROWS = 0.03, 200
DRIVE = Physical(np.array([4.0, 5.0]), np.array([[1.2, 1.1], [9.0, -8.5]]), np.array([0.02, -1.0]))
DEAD_ZONE = np.array([0.1, 0.12])
TOLERANCE = {
    "stiction": 0.1,
    "traction_limit": 0.02,
    "transport_delay": 0.02,
    "motor_lag": 0.02,
    "payload_change": 0.02,
}
"""Largest error as a part of what the effect does; 0.01 for the others."""


@pytest.fixture(scope="module")
def log():
    rng = np.random.default_rng(4)
    u = np.repeat(rng.uniform(-1.0, 1.0, (ROWS // 10, 2)), 10, axis=0)
    t = np.arange(ROWS) * STEP
    return make_log(t, u[:, 0], u[:, 1], 0.0 * t, 0.0 * t, 0.0 * t)


PUSH, TRACK = jax.jit(push_of), jax.jit(track)
REPORT = jax.jit(lambda vector, pose: report(by_effect(vector), *pose))
STILL = np.zeros((5, 1))


@pytest.fixture(scope="module")
def follow(log):
    windows = cut(log, ROWS)
    return lambda vector: np.stack(
        [np.asarray(part)[:, 0] for part in REPORT(vector, TRACK(vector, STILL, windows).pose)]
    )


def nominal() -> np.ndarray:
    return neutral_vector(nominal_vector(DRIVE, DEAD_ZONE))


@jax.jit
def all_effects(vector, log, drive, start):
    """Poses (3, rows) by the full simulator in the program that holds all effects, on fine substeps."""
    return jnp.stack(run_full(drive, DEAD_ZONE, vector, log.t, log.command, start, substeps=SHARP_SUBSTEPS))


def simulated(log, effects=(), drive=DRIVE, start=AT_REST) -> np.ndarray:
    return np.asarray(all_effects(to_vector(effects), log, drive, start))


def test_without_effects_it_is_the_nominal_robot(log, follow):
    # coupling is held over a substep here and exact there
    np.testing.assert_allclose(follow(nominal()), simulated(log), atol=3e-4)


FORMS = [
    ("backlash", {"coasting": 1.0}),
    ("input_quantisation", {"towards_zero": 1.0}),
    ("input_saturation", {"soft": 1.0}),
    ("input_rate_limit", {"falling_ratio": 2.5}),
    ("motor_lag", {"second_order": 1.0}),
    ("gain_drift", {"growth": 0.5}),
    ("dead_zone_drift", {"growth": -0.5}),
    ("lens_distortion", {"edge": 0.8}),
    ("traction_limit", {"dry": 1.0}),
    ("traction_limit", {"dry": 1.0, "spin": 0.03}),
]
CASES = [(name, {}) for name in COORDINATES] + FORMS


@pytest.mark.parametrize(("name", "form"), CASES)
def test_every_effect_is_that_of_the_full_simulator(log, follow, name, form):
    typical = CATALOGUE[name].typical() | ({"instant": 2.0} if name == "payload_change" else {}) | form
    vector = nominal()
    for key, value in from_catalogue(name, typical, vector[:2]).items():
        vector[PLACES[name, key]] = value
    wanted = simulated(log, (Effect(name, typical),)) - simulated(log)
    found = follow(vector) - follow(nominal())
    scale = np.abs(wanted).max(axis=1).max()
    assert scale > 1e-3
    assert np.abs(found - wanted).max() < TOLERANCE.get(name, 0.01) * scale


def test_windows_start_where_they_are_told(log):
    """Cut in two, each half from the state that the whole has there, the path is the whole's."""
    whole, halves = cut(log, ROWS), cut(log, ROWS // 2)
    vector = nominal()
    states = np.stack([np.asarray(part)[:, 0] for part in TRACK(vector, STILL, whole)])
    starts = states[:, [0, ROWS // 2]]
    parts = np.stack(TRACK(vector, starts, halves))
    np.testing.assert_allclose(np.concatenate(parts.transpose(2, 0, 1), axis=1), states, atol=1e-10)


def test_unseen_poses_leave_no_residual(log):
    hidden = log._replace(x=np.where(np.arange(ROWS) == 7, np.nan, log.x))
    windows = cut(hidden, ROWS)
    found = np.asarray(jax.jit(residuals)(nominal(), STILL, PUSH(nominal(), windows), windows))
    assert np.all(found[7] == 0.0)
    assert np.all(np.isfinite(found))
    assert np.any(found[8] != 0.0)
    assert len(nominal()) == SIZE


@pytest.mark.parametrize("name", COORDINATES)
def test_effects_that_share_pushes_leave_them_as_they_are(log, name):
    windows, vector = cut(log, ROWS), nominal()
    typical = CATALOGUE[name].typical() | ({"instant": 2.0} if name == "payload_change" else {})
    for key, value in from_catalogue(name, typical, vector[:2]).items():
        vector[PLACES[name, key]] = value
    same = jax.tree.map(np.array_equal, PUSH(nominal(), windows), PUSH(vector, windows))
    assert all(same) == (name not in PUSHING)


def beside(drive: Physical, left: float) -> Physical:
    """The drive as seen from a point to the left of the axle's middle: v - b w in place of v."""
    (r1, r2), (c1, c2) = drive.rate, drive.coupling
    seen = np.array([[1.0, -left], [0.0, 1.0]])
    decay = seen @ np.array([[r1, -c1], [-c2, r2]]) @ np.linalg.inv(seen)
    return Physical(np.diagonal(decay), seen @ drive.gain, -np.array([decay[0, 1], decay[1, 0]]))


@pytest.mark.parametrize(("name", "form"), CASES)
def test_how_far_left_a_marker_is_nothing_tells_but_effects_on_speeds(log, name, form):
    """A robot whose marker lies to the left, and another one whose marker does not, from the same reported pose."""
    typical = CATALOGUE[name].typical() | ({"instant": 2.0} if name == "payload_change" else {}) | form
    others = () if name == "marker_offset" else (Effect(name, typical),)
    left = 0.05

    def poses(drive, y, aside):
        effects = (*others, Effect("marker_offset", {"ahead": 0.03, "left": aside}))
        return simulated(log, effects, drive, AT_REST._replace(y=y))

    apart = np.abs(poses(DRIVE, 0.0, left) - poses(beside(DRIVE, left), left, 0.0)).max()
    assert (apart > 1e-4) == (name in ON_SPEEDS or form == {"coasting": 1.0})
    assert (PLACES["marker_offset", "left"] in free_places(("marker_offset", name))) == (name in ON_SPEEDS)


def test_a_robot_abreast_of_its_marker_is_the_one_that_is_seen_from_there():
    vector, wanted = nominal(), neutral_vector(nominal_vector(beside(DRIVE, 0.05), DEAD_ZONE))
    vector[PLACES["marker_offset", "left"]] = 0.05
    np.testing.assert_allclose(abreast_of_marker(vector), wanted, atol=1e-12)


def test_windows_go_on_at_the_angle_that_the_wheel_has_turned_to(log):
    """A law of a wheel, in windows that begin far within the run: its angle there follows from the way before."""
    at = np.linspace(-np.pi, np.pi, 9)
    law = Discovered("push of the right wheel", "1", "own angle", at, 0.2 * np.cos(at), period=0.15, half_track=0.13)
    laws = laws_of((law,))
    states, _ = run_states(DRIVE, DEAD_ZONE, to_vector(()), log.t, log.command, AT_REST, noise=None, key=None,
                           substeps=SHARP_SUBSTEPS, parts=frozenset(), laws=laws)  # fmt: skip
    driven = log._replace(x=np.asarray(states.x), y=np.asarray(states.y), theta=np.asarray(states.theta))
    windows = cut(driven, 25)
    starts = np.stack([np.asarray(part)[windows.row] for part in states])
    begun = jax.jit(first_angles)(windows._replace(laws=laws))
    assert np.ptp(np.asarray(begun)[0]) > 2.0 * np.pi
    push, left_by = PUSH(nominal(), windows), jax.jit(residuals)
    left = [
        float(jnp.abs(left_by(nominal(), starts, push, windows._replace(laws=each))).max())
        for each in (laws, laws._replace(phase=laws.phase + 0.5), None)
    ]
    assert left[0] < 0.03 * left[2]
    assert left[0] < 0.1 * left[1]

"""The Bezier length against a polyline of the curve and against true arcs; its corners; the way back by `follow`."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxident.array_types import AT_REST, Increment, Pose
from jaxident.robot.excitation import multilevel
from jaxident.robot.path_length import bezier_over_chord, follow, increment_between, path_length
from jaxident.robot.simulate import run_physical

BESIDE = 1e-9
between = jax.jit(increment_between)
lengths = jax.jit(path_length)


def moved_along(direction, chord, theta, turn):
    """Start and end pose: a chord in a direction, headings before and after."""
    start = Pose(0.4, -0.7, theta)
    return start, Pose(start.x + chord * np.cos(direction), start.y + chord * np.sin(direction), theta + turn)


def polyline(start: Pose, end: Pose, points: int = 100_000) -> float:
    """Signed length of the paper's curve, as that of a polyline through points of it."""
    p0, p3 = np.array([start.x, start.y]), np.array([end.x, end.y])
    heading_0, heading_1 = (np.array([np.cos(pose.theta), np.sin(pose.theta)]) for pose in (start, end))
    sign = 1.0 if (p3 - p0) @ heading_0 >= 0 else -1.0
    third = sign * np.linalg.norm(p3 - p0) / 3
    p1, p2 = p0 + third * heading_0, p3 - third * heading_1
    s = np.linspace(0, 1, points)[:, None]
    curve = (1 - s) ** 3 * p0 + 3 * (1 - s) ** 2 * s * p1 + 3 * (1 - s) * s**2 * p2 + s**3 * p3
    return sign * np.sum(np.hypot(*np.diff(curve, axis=0).T))


@pytest.mark.parametrize("seed", range(12))
def test_length_is_that_of_a_polyline(seed):
    """Centimetres of chord up to 0.15 rad off the mean heading, turns to 0.5 rad, both ways; what remains
    is the error of the four-node rule."""
    rng = np.random.default_rng(seed)
    theta, turn = rng.uniform(-np.pi, np.pi), rng.uniform(-0.5, 0.5)
    backwards = np.pi * (seed % 2)
    start, end = moved_along(
        theta + turn / 2 + rng.uniform(-0.15, 0.15) + backwards, rng.uniform(0.001, 0.03), theta, turn
    )
    increment = between(start, end)
    assert float(increment.length) == pytest.approx(polyline(start, end), rel=1e-5)
    assert float(increment.turn) == pytest.approx(turn, abs=1e-14)
    assert np.sign(increment.length) == (-1.0 if backwards else 1.0)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("turn", [-0.5, -0.1, 0.0, 1e-6, 0.3, 0.5])
def test_true_arc(sign, turn):
    """A centimetre of arc. The curve errs by 4.2e-3 turn^4 of the length: 4 nm at 0.1 rad, 2.6 um at 0.5 rad."""
    arc, theta = sign * 0.01, 2.0
    chord = arc * np.sinc(turn / 2 / np.pi)
    start, end = moved_along(theta + turn / 2, chord, theta, turn)
    assert float(between(start, end).length) == pytest.approx(arc, abs=4.3e-3 * turn**4 * abs(arc) + 1e-14)


def test_published_robot_keeps_to_half_a_micrometre(published):
    """On its own excitation the length between exact poses is within 5e-7 m of the path run."""
    u = multilevel(jax.random.key(0), 1000)
    fine = jax.tree.map(lambda signal: jnp.append(jnp.repeat(signal[:-1], 4), 0.0), u)
    states = jax.jit(run_physical)(published, fine, jnp.asarray(0.25), AT_REST)
    speed = np.asarray(states.v)  # Simpson's rule over the four parts of each sample
    parts = np.stack([speed[k : len(speed) - 4 + k : 4] for k in range(5)])
    weights = np.array([1, 4, 2, 4, 1]) / 12
    increment = lengths(Pose(*(column[::4] for column in states.pose)))
    assert np.max(np.abs(increment.turn)) > 0.3
    np.testing.assert_allclose(increment.length, weights @ parts, atol=5e-7)


def test_direction_is_the_projection_on_the_first_heading():
    for angle, expected in ((0.0, 1), (1.5, 1), (-1.5, 1), (1.65, -1), (np.pi, -1), (-1.65, -1)):
        assert np.sign(between(*moved_along(0.3 + angle, 0.01, 0.3, 0.2)).length) == expected


def test_heading_across_half_a_turn():
    """Wrapped or not, the same motion, and a gradient of one."""
    start, end = moved_along(np.pi - 0.05, 0.01, np.pi - 0.1, 0.3)
    wrapped = end._replace(theta=end.theta - 2 * np.pi)
    for one, other in zip(between(start, end), between(start, wrapped), strict=True):
        assert float(one) == pytest.approx(float(other), abs=1e-14)
    slope = jax.jit(jax.grad(lambda theta: increment_between(start, wrapped._replace(theta=theta)).turn))
    assert float(slope(wrapped.theta)) == 1.0


def length_of(numbers):
    return increment_between(Pose(*numbers[:3]), Pose(*numbers[3:])).length


gradient = jax.jit(jax.vmap(jax.value_and_grad(length_of)))


@pytest.mark.parametrize("turn", [0.0, 1e-9, 0.3, -0.5, 1.5, np.pi, -np.pi])
def test_zero_chord_has_finite_values_and_gradients(turn):
    """Standing still and turning on the spot; also chords whose square underflows."""
    chords = np.array([0.0, 1e-300, 1e-170, -1e-170, 1e-160, 1e-20])
    cases = np.array(
        [[0.0, 0.0, 0.7, c * np.cos(0.7 + turn / 2), c * np.sin(0.7 + turn / 2), 0.7 + turn] for c in chords]
    )
    value, slopes = gradient(cases)
    assert np.all(np.abs(value) <= 2 * np.abs(chords))
    assert np.all(np.isfinite(slopes))


@pytest.mark.parametrize("turn", [0.0, 0.1, -0.5, 1.5])
def test_zero_chord_is_smooth_along_the_heading(turn):
    """Value and derivative 1e-9 m behind, at, and 1e-9 m before the start: through zero without a step."""
    direction = 0.7 + turn / 2
    chord = BESIDE * np.array([-1.0, 0.0, 1.0])
    cases = np.array([[0.0, 0.0, 0.7, c * np.cos(direction), c * np.sin(direction), 0.7 + turn] for c in chord])
    value, slopes = gradient(cases)
    ratio = float(jax.jit(bezier_over_chord)(turn))
    np.testing.assert_allclose(value, ratio * chord, rtol=1e-12)
    onwards = slopes[:, 3] * np.cos(direction) + slopes[:, 4] * np.sin(direction)
    np.testing.assert_allclose(onwards, ratio, rtol=1e-12)
    np.testing.assert_allclose(slopes[:, (2, 5)], 0.0, atol=2 * BESIDE)


def test_turning_on_the_spot_is_all_turn():
    poses = Pose(jnp.full(4, 1.0), jnp.full(4, 2.0), jnp.array([0.0, 0.4, 0.9, -3.0]))
    increment = lengths(poses)
    np.testing.assert_array_equal(increment.length, 0.0)
    np.testing.assert_allclose(increment.turn, [0.4, 0.5, 2 * np.pi - 3.9], atol=1e-15)


def test_a_missing_pose_is_missing_on_both_sides():
    column = jnp.array([0.0, 0.1, jnp.nan, 0.3, 0.4])
    increment = lengths(Pose(column, 0 * column, 0 * column))
    np.testing.assert_array_equal(np.isnan(increment.length), [False, True, True, False])
    np.testing.assert_array_equal(np.isnan(increment.turn), [False, True, True, False])


def test_follow_is_the_way_back():
    rng = np.random.default_rng(5)
    increments = Increment(rng.uniform(-0.02, 0.02, 300), rng.uniform(-0.9, 0.9, 300))
    poses = jax.jit(follow)(Pose(1.0, -2.0, 3.0), increments)
    back = lengths(poses)
    assert (float(poses.x[0]), float(poses.y[0]), float(poses.theta[0])) == (1.0, -2.0, 3.0)
    np.testing.assert_allclose(back.length, increments.length, atol=1e-14)
    np.testing.assert_allclose(back.turn, increments.turn, atol=1e-13)
    pair = between(Pose(*(c[:-1] for c in poses)), Pose(*(c[1:] for c in poses)))
    for one, other in zip(pair, back, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-14)

"""The likelihood around a point: shortcuts against the plain sums, deviations against a search for their optimum."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support.diagonal_robot import DEAD_ZONE, DRIVE, PERIOD, logged

from jaxident.estimation.poses.curvature import (
    Point,
    _general_sums,
    _white_sums,
    local_at,
    local_at_best_deviations,
)
from jaxident.estimation.poses.noise_law import NOISE_LAWS
from jaxident.estimation.poses.parameters import Law, Robot, bounds, names, to_vector
from jaxident.estimation.poses.runs import stack_runs, with_wheels
from jaxident.log import join, make_log
from jaxident.robot.noise import Noise
from jaxident.robot.wheel_sensor import WheelSensor

D_MAX = 0.9


def with_speeds(log):
    """The log with noise for wheel speeds."""
    right, left = np.random.default_rng(1).normal(0.0, 2.0, (2, len(log.t)))
    return log._replace(wheel_r=right, wheel_l=left)


def example(law):
    """Two runs of different length, and a point that is not their best."""
    log = join([with_speeds(logged(seed, Noise(1e-3, 1e-2), rows)) for seed, rows in ((6, 60), (7, 40))])
    runs = with_wheels(stack_runs(log), log) if law.wheels else stack_runs(log)
    robot = Robot(DRIVE, DEAD_ZONE, Noise(4e-3, 2e-2, 0.1, 0.01, 0.1), WheelSensor(0.1, 0.5, 0.3))
    return Point(to_vector(robot, law), 0.01 * jnp.ones((2, 5))), jax.tree.map(jnp.asarray, runs)


ALL_LAWS = [*NOISE_LAWS.values(), Law(wheels=True), Law(slip=True, wheels=True)]
QUICK_LAWS = (ALL_LAWS[0],)


@pytest.mark.parametrize(
    "law", [pytest.param(law, marks=[pytest.mark.slow] * (law not in QUICK_LAWS)) for law in ALL_LAWS]
)
def test_best_deviations_are_where_the_slope_by_them_is_zero(law):
    point, runs = example(law)
    best, local = jax.jit(partial(local_at_best_deviations, law=law))(point, runs)
    there = jax.jit(partial(local_at, law=law))(best, runs)
    for a, b in zip(jax.tree.leaves(local), jax.tree.leaves(there), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9 * float(np.max(np.abs(b))))
    moving = [
        name for name in names(law) if name == "wheel_noise" or (name in ("position", "heading") and not law.slip)
    ]
    places = [names(law).index(name) for name in moving]
    others = np.delete(np.arange(len(point.shared)), places)
    np.testing.assert_array_equal(best.shared[others], point.shared[others])
    np.testing.assert_allclose(there.gradient.shared[np.array(places, int)], 0.0, atol=1e-8)


def test_white_shortcut_is_the_general_curvature():
    point, runs = example(Law())
    run = jax.tree.map(lambda leaf: leaf[0] if jnp.ndim(leaf) else leaf, runs)
    unknowns = jnp.concatenate([point.shared, point.starts[0]])
    both = [jax.jit(partial(part, law=Law()))(unknowns, run) for part in (_white_sums, _general_sums)]
    for a, b in zip(*map(jax.tree.leaves, both), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9 * np.max(np.abs(b)))


@pytest.mark.parametrize(
    "law", [pytest.param(law, marks=[pytest.mark.slow] * (name in ("ar1", "slip"))) for name, law in NOISE_LAWS.items()]
)
def test_derivatives_are_finite_at_corners(law):
    """At rest, on a dead zone's edge, at both ends of the bounds, and with no pose at all."""
    log = make_log(PERIOD * np.arange(30), np.full(30, 0.25), np.full(30, -0.2), *np.zeros((3, 30)))
    runs = jax.tree.map(jnp.asarray, stack_runs(log))
    vector = to_vector(Robot(DRIVE, DEAD_ZONE, Noise(1e-3, 1e-2, 0.1, 0.01, 0.1)), law)
    low, high = bounds(law, jnp.asarray(D_MAX))
    local = jax.jit(lambda v, r: local_at(Point(v, jnp.zeros((1, 5))), r, law))
    for point in (vector, jnp.where(jnp.isfinite(low), low, 0.0), jnp.where(jnp.isfinite(high), high, 0.0)):
        for seen in (runs.seen, jnp.zeros_like(runs.seen)):
            found = local(point, runs._replace(seen=seen))
            assert all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(found))

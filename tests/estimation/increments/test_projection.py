"""What is linear solved for in closed form, against NumPy's least squares one pair of dead zones at a time."""

import jax
import jax.numpy as jnp
import numpy as np
from support.records import random_log

from jaxident.estimation.increments.input_forms import one_step, usable
from jaxident.estimation.increments.observations import observe_log
from jaxident.estimation.increments.projection import inputs_of, profile, project, triangle
from jaxident.log import Log

WIDTHS = (0.0, 0.1, 0.3), (0.05, 0.2)


def observations():
    return jax.jit(observe_log)(Log(*(jnp.asarray(column) for column in random_log(3, 120)[0])))


def columns_of(seen, rights, lefts):
    use = np.flatnonzero(usable(seen))
    commands = [*seen.command, *seen.command_before]
    widths = (rights, lefts, rights, lefts)
    passed = [np.sign(u) * np.maximum(np.abs(u) - w, 0.0) for u, w in zip(commands, widths, strict=True)]
    return use, np.stack(passed, axis=1)[use]


def test_every_pair_of_dead_zones_is_the_least_squares_fit():
    seen = observations()
    increments = jnp.stack(seen.increment)
    rights, lefts = (jnp.array(widths) for widths in WIDTHS)
    look = jax.jit(lambda *at: profile(one_step(seen), inputs_of(seen), increments, *at))
    squares, poles = look(jnp.zeros(4), rights, lefts)
    for i, right in enumerate(WIDTHS[0]):
        for j, left in enumerate(WIDTHS[1]):
            use, passed = columns_of(seen, right, left)
            for channel, y in enumerate(np.asarray(increments)):
                table = np.column_stack([y[use - 1], passed])
                weights = np.linalg.lstsq(table, y[use])[0]
                np.testing.assert_allclose(poles[channel, i, j], weights[0], rtol=1e-7)
                expected = np.sum((y[use] - table @ weights) ** 2)
                np.testing.assert_allclose(squares[channel, i, j], expected, rtol=1e-7)


def test_slopes_of_the_residual_are_its_differences():
    """Products with the residual are half the gradient of its squares: exact, Kaufman's form drops nothing there."""
    seen = observations()
    found = jax.jit(lambda p: project(one_step(seen), seen, p))

    def squares(point):
        return np.sum(np.asarray(found(point).residual) ** 2, axis=1)

    point = np.array([0.13, 0.21, 0.9, 0.7])
    products = np.asarray(found(point).products)
    np.testing.assert_allclose(products[:, 3, 3], squares(point), rtol=1e-10)
    for k in range(4):
        step = 1e-6 * np.eye(4)[k]
        slope = (squares(point + step) - squares(point - step)) / 4e-6
        own = products[:, k, 3] if k < 2 else np.where(np.arange(2) == k - 2, products[:, 2, 3], 0.0)
        np.testing.assert_allclose(own, slope, rtol=1e-4, atol=1e-6 * np.max(np.abs(products[:, :3, 3])))


def test_a_triangle_stands_for_its_signals():
    signals = np.random.default_rng(0).normal(size=(4, 30))
    signals[2] = 0.0
    found = np.asarray(triangle(jnp.asarray(signals @ signals.T)))
    np.testing.assert_allclose(found.T @ found, signals @ signals.T, atol=1e-12)
    np.testing.assert_array_equal(np.tril(found, -1), 0.0)

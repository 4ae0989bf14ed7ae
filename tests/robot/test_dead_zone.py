"""The dead zone against PAPER (10), and its values and gradients at the edge."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxident.array_types import Wheels
from jaxident.robot.dead_zone import dead_zone, effective_command


def test_is_the_piecewise_function_of_the_paper():
    for u in np.linspace(-1, 1, 41):
        expected = u - 0.25 if u > 0.25 else u + 0.25 if u < -0.25 else 0.0
        assert float(dead_zone(u, 0.25)) == pytest.approx(expected, abs=1e-16)


def test_each_wheel_has_its_own_width():
    passed = effective_command(Wheels(jnp.array([0.5, -0.5]), jnp.array([0.5, -0.5])), jnp.array([0.25, 0.1]))
    np.testing.assert_allclose(passed.right, [0.25, -0.25])
    np.testing.assert_allclose(passed.left, [0.4, -0.4])


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_edge_is_continuous_with_finite_gradients(sign):
    """Inside and on the edge the gradient is 0; outside it is 1 to the command and -sign(u) to the width."""
    edge = sign * (0.25 + 1e-9 * jnp.array([-1.0, 0.0, 1.0]))
    value, (to_u, to_width) = jax.vmap(jax.value_and_grad(dead_zone, argnums=(0, 1)), (0, None))(edge, 0.25)
    np.testing.assert_allclose(value, [0.0, 0.0, sign * 1e-9], atol=1e-16)
    np.testing.assert_array_equal(to_u, [0.0, 0.0, 1.0])
    np.testing.assert_array_equal(to_width, [0.0, 0.0, -sign])


def test_zero_width_passes_everything():
    u = jnp.linspace(-1, 1, 5)
    np.testing.assert_array_equal(dead_zone(u, 0.0), u)
    assert np.all(np.isfinite(jax.vmap(jax.grad(dead_zone, argnums=1), (0, None))(u, 0.0)))

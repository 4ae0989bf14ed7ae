"""Arithmetic against NumPy in extended precision, and its gradients at the corners and 1e-7 beside them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

from jaxident.numerics import (
    GAUSS_NODES,
    GAUSS_WEIGHTS,
    add_pairs,
    float64_switch,
    hold_integrals,
    in_blocks,
    require_float64,
    safe_divide,
    safe_norm,
    sin_cos,
    wrap,
)

BESIDE = 1e-7


def gradient_near(function, corner):
    """Derivative just left of, at and just right of a corner."""
    return np.asarray(jax.jit(jax.vmap(jax.grad(function)))(corner + BESIDE * jnp.array([-1.0, 0.0, 1.0])))


@pytest.mark.parametrize("span", [1.0, 100.0, 1e5])
def test_sin_cos_is_accurate(span):
    corners = np.pi / 4 * np.arange(-8, 9)
    angle = np.concatenate([np.random.default_rng(0).uniform(-span, span, 100_000), corners[np.abs(corners) <= span]])
    sine, cosine = map(np.asarray, jax.jit(sin_cos)(angle))
    exact = angle.astype(np.longdouble)
    np.testing.assert_allclose(sine, np.sin(exact).astype(float), rtol=0.0, atol=3e-16)
    np.testing.assert_allclose(cosine, np.cos(exact).astype(float), rtol=0.0, atol=3e-16)


def test_sin_cos_has_the_textbook_gradient_where_its_branches_meet():
    angle = (jnp.pi / 4 * jnp.arange(-9, 10)[:, None] + BESIDE * jnp.array([-1.0, 0.0, 1.0])).ravel()
    sine, cosine = jax.jit(lambda a: jax.jvp(sin_cos, (a,), (jnp.ones_like(a),))[1])(angle)
    np.testing.assert_allclose(sine, np.cos(angle), atol=1e-15)
    np.testing.assert_allclose(cosine, -np.sin(angle), atol=1e-15)


@pytest.mark.parametrize("shape", [(), (20,)])
def test_sums_and_derivatives_of_pairs(shape):
    terms = jnp.asarray(np.random.default_rng(0).normal(size=(2, 4, *shape)))

    def mixed(terms):
        x, y = add_pairs(list(terms[0]), list(terms[1]))
        return jnp.sum(x * x + 3.0 * y)

    np.testing.assert_allclose(jnp.stack(jax.jit(add_pairs)(*map(list, terms))), terms.sum(axis=1), rtol=1e-15)
    gradient = jax.grad(mixed)(terms)
    np.testing.assert_allclose(gradient[0], jnp.broadcast_to(2.0 * terms[0].sum(axis=0), (4, *shape)), rtol=1e-15)
    np.testing.assert_allclose(gradient[1], 3.0)
    np.testing.assert_allclose(jax.jacfwd(mixed)(terms), gradient, rtol=1e-15)


def hold_reference(rate: float, time: float) -> tuple[float, float, float]:
    """Decay and integrals in extended precision: power series near zero, closed forms away from it."""
    z, time = -np.longdouble(rate) * np.longdouble(time), np.longdouble(time)
    if abs(z) < 3.0:
        factorial = np.cumprod(np.concatenate([[1], np.arange(1, 60)]).astype(np.longdouble))
        powers = z ** np.arange(50)
        first, second = np.sum(powers / factorial[1:51]), np.sum(powers / factorial[2:52])
    else:
        first = np.expm1(z) / z
        second = (first - 1) / z
    return np.exp(z), time * first, time**2 * second


def test_hold_integrals_keep_full_precision():
    products = [0.0, 1e-300, 1e-12, 1e-5, 0.1, 0.4999999, 0.5, 0.5000001, 1.0, 3.0, 20.0, 300.0]
    cases = [(sign * p / t, t) for p in products for t in (1e-6, 1 / 30, 2.0) for sign in (1, -1) if sign * p > -20]
    rate, time = map(np.array, zip(*cases, strict=True))
    references = np.array([hold_reference(*case) for case in cases]).T
    for ours, reference in zip(hold_integrals(rate, time), references, strict=True):
        error = np.abs(np.asarray(ours) / reference - 1)
        assert np.all(error <= 1e-15 * (1 + np.abs(rate * time)))  # exp multiplies the rounding of its argument by it


@pytest.mark.parametrize("rate", [0.0, 0.3, 4.0])
def test_hold_integrals_are_integrals(rate):
    time = 0.7
    decay, once, twice = hold_integrals(rate, time)
    assert float(decay) == pytest.approx(np.exp(-rate * time), rel=1e-15)
    assert float(once) == pytest.approx(quad(lambda s: np.exp(-rate * s), 0, time)[0], rel=1e-13)
    assert float(twice) == pytest.approx(quad(lambda s: (time - s) * np.exp(-rate * s), 0, time)[0], rel=1e-13)


@pytest.mark.parametrize("which", [0, 1, 2])
@pytest.mark.parametrize("corner", [-0.5, 0.0, 0.5])
def test_hold_integrals_are_smooth_in_the_rate(which, corner):
    """At rate zero and across the switch from series to closed form, first and second derivative."""

    def response(rate):
        return hold_integrals(rate, 1.0)[which]

    def reference(rate, power):  # d/drate of exp(-rate s), under the integral sign
        kernel = ((-1.0) ** power, lambda s: 1.0, lambda s: 1.0 - s)[which]
        if which == 0:
            return kernel * np.exp(-rate)
        return quad(lambda s: kernel(s) * (-s) ** power * np.exp(-rate * s), 0, 1)[0]

    for power, function in ((1, response), (2, jax.grad(response))):
        slopes = gradient_near(function, corner)
        assert np.all(np.isfinite(slopes))
        np.testing.assert_allclose(slopes, reference(corner, power), rtol=2 * BESIDE)


def test_gauss_rule_is_exact_to_degree_seven():
    for degree in range(8):
        moment = sum(w * p**degree for p, w in zip(GAUSS_NODES, GAUSS_WEIGHTS, strict=True))
        assert moment == pytest.approx(1 / (degree + 1), rel=1e-15)


def test_wrap_moves_by_whole_turns_into_half_a_turn():
    angle = np.random.default_rng(1).uniform(-50, 50, 1000)
    wrapped = np.asarray(wrap(angle))
    turns = (angle - wrapped) / (2 * np.pi)
    assert np.all(np.abs(wrapped) <= np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-14)
    np.testing.assert_array_equal(gradient_near(wrap, jnp.pi), 1.0)


def test_safe_divide():
    assert float(safe_divide(6.0, jnp.asarray(-2.0), 9.0)) == -3.0
    assert float(safe_divide(6.0, jnp.asarray(0.0), 9.0)) == 9.0
    value, slopes = jax.value_and_grad(safe_divide, argnums=(0, 1, 2))(6.0, 0.0, 9.0)
    assert (float(value), *map(float, slopes)) == (9.0, 0.0, 0.0, 1.0)
    assert np.all(np.isfinite(gradient_near(lambda d: safe_divide(1.0, d, 0.0), 0.0)))


def test_safe_norm():
    x, y = np.random.default_rng(2).normal(size=(2, 100))
    np.testing.assert_allclose(safe_norm(x, y), np.hypot(x, y), rtol=1e-15)
    np.testing.assert_allclose(gradient_near(lambda x: safe_norm(x, 0.0), 0.0), [-1.0, 0.0, 1.0], rtol=1e-15)


def test_double_precision_is_asked_for_by_name():
    require_float64("fit")
    with float64_switch(False), pytest.raises(RuntimeError, match=r"fit needs .*start_jax\(\)"):
        require_float64("fit")


def test_blocks_of_trials_give_what_all_at_once_give():
    """Also where the last block is not full, an argument is shared by all trials, and maps are nested."""

    def one(signals, weight):
        return {"sum": signals["a"] @ weight, "mean": jnp.mean(signals["b"])}

    key_a, key_b = jax.random.split(jax.random.key(0))
    signals = {"a": jax.random.normal(key_a, (2, 23, 5)), "b": jax.random.normal(key_b, (2, 23, 4))}
    weight = jnp.arange(5.0)

    def run(function):
        return jax.jit(jax.vmap(jax.vmap(function, in_axes=(0, None)), in_axes=(0, None)))(signals, weight)

    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-14), run(in_blocks(one, 10)), run(one))
    first = jax.tree.map(lambda leaf: leaf[0], signals)
    few = jax.vmap(in_blocks(one, 30), in_axes=(0, None))(first, weight)
    np.testing.assert_allclose(few["sum"], first["a"] @ weight, rtol=1e-14)

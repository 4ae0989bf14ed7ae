"""Blocks in parallel against a plain loop."""

import threading

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.numerics import float64_switch
from jaxident.parallel import at_most, in_parallel


def test_blocks_in_parallel_are_the_loop_in_order():
    blocks = [(jnp.arange(5.0) + k, jnp.full(5, k)) for k in range(20)]
    function = jax.jit(lambda a, b: {"sum": a + b, "product": a * b})
    for found, block in zip(in_parallel(function, blocks), blocks, strict=True):
        np.testing.assert_array_equal(found["sum"], block[0] + block[1])
        np.testing.assert_array_equal(found["product"], block[0] * block[1])
    assert function._cache_size() == 1


def test_a_function_that_is_not_compiled_yet_is_compiled_once():
    function = jax.jit(lambda a: jnp.sort(a) * 2.0)
    found = in_parallel(function, [(jnp.arange(3.0) - k,) for k in range(9)], 4, ahead=False)
    assert function._cache_size() == 1
    np.testing.assert_array_equal(found, [2.0 * (np.arange(3.0) - k) for k in range(9)])


def test_beside_other_processes_no_more_threads_are_started():
    def threads():
        return set(in_parallel(lambda _: threading.get_ident(), [(k,) for k in range(8)]))

    with at_most(1):
        assert threads() == {threading.get_ident()}
        with at_most(2):
            assert threading.get_ident() not in threads()
        assert threads() == {threading.get_ident()}
    with at_most(None):
        assert threads()


def test_threads_compute_in_the_precision_of_their_caller():
    """A switch for a block of code holds for one thread only; without it threads would have that of the program."""
    blocks = [(np.full(3, 1.0 / 3.0 + k),) for k in range(4)]
    for double in (False, True):
        with float64_switch(double):
            found = in_parallel(jax.jit(lambda a: a * 2.0), blocks, 2)
        assert {str(each.dtype) for each in found} == {"float64" if double else "float32"}

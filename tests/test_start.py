"""The set-up of JAX, each in a process of its own: it counts only before the first computation."""

import os
import platform
import subprocess
import sys

import pytest

PROGRAM = """
import os, jax, jaxident as ji
ji.start_jax()
import jax.numpy as jnp

def body(carry, x):
    shared = jnp.sin(carry[0]) * x
    return (shared + carry[1], shared * carry[0]), None

text = jax.jit(lambda a, x: jax.lax.scan(body, (a, a), x)).lower(jnp.ones(8), jnp.ones((5, 8))).compile().as_text()
print(jnp.ones(1).dtype, any(" = (f64[8]" in line and " fusion(" in line for line in text.splitlines()))
print(jax.config.jax_compilation_cache_dir)
print(os.environ["XLA_FLAGS"])
"""

REPEATED = """
import resource, jax, jaxident as ji
ji.start_jax(cache=False)
import jax.numpy as jnp

three = jax.jit(lambda a: (a + 1.0, a + 2.0, a + 3.0))
array = jnp.ones((2000, 512))
faults = []
for _ in range(20):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    jax.block_until_ready(three(array))
    faults.append(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
print(min(faults))
"""


def outcome(**variables: str) -> list[str]:
    environment = {k: v for k, v in os.environ.items() if k not in ("XLA_FLAGS", "JAXIDENT_CACHE")} | variables
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True, check=True, timeout=120
    )
    return run.stdout.splitlines()


def test_double_precision_shared_kernels_and_a_cache(tmp_path):
    precision, cache, _ = outcome(JAXIDENT_CACHE=str(tmp_path / "cache"))
    assert precision == "float64 True"
    assert cache == str(tmp_path / "cache")
    assert (tmp_path / "cache").is_dir()


def test_an_empty_cache_variable_turns_the_cache_off():
    assert outcome(JAXIDENT_CACHE="")[1] == "None"


def test_flags_of_the_user_are_kept():
    kept = outcome(JAXIDENT_CACHE="", XLA_FLAGS="--xla_cpu_enable_fast_math=false")[2]
    assert kept.startswith("--xla_cpu_enable_fast_math=false --xla_backend_extra_options=")
    own = "--xla_backend_extra_options=xla_cpu_disable_slp_vectorizer --xla_gpu_autotune_level=4"
    assert outcome(JAXIDENT_CACHE="", XLA_FLAGS=own)[2] == own


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="the setting is glibc's")
def test_memory_of_large_results_is_used_again():
    """At last: a thread that takes memory for the first time has to fetch it."""
    run = subprocess.run([sys.executable, "-c", REPEATED], capture_output=True, text=True, check=True, timeout=120)
    assert int(run.stdout) < 1000  # of the 6000 pages of three results

"""JAX set up as the program does; paths of the material that lies beside the project, where it does."""

import os
import pathlib
from collections.abc import Iterator

import jax
import pytest

from jaxident.start import start_jax

start_jax(cache="JAXIDENT_CACHE" in os.environ)  # as the program does; a folder given for it is fresh and the run's own

SHARED = pathlib.Path(__file__).resolve().parents[2] / "shared"

MAPS = pathlib.Path("/proc/self/maps")
MANY = 20_000
"""Memory maps from which compiled programs are let go: each takes several, and Linux allows a process 65530. At 50778
maps the tests of one process were nine tenths through; beyond the limit the process dies."""


@pytest.fixture(autouse=True, scope="module")
def few_compiled_programs() -> Iterator[None]:
    """Lets go of the compiled programs of earlier test files before they are too many."""
    yield
    if MAPS.exists() and MAPS.read_bytes().count(b"\n") > MANY:
        jax.clear_caches()


@pytest.fixture
def shared() -> pathlib.Path:
    """The folder of real logs beside the project; the test is skipped where it is missing."""
    if not SHARED.is_dir():
        pytest.skip("the folder shared/ does not lie beside the project")
    return SHARED

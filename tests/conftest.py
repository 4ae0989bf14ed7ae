"""JAX set up as the program does; paths of the material that lies beside the project, where it does."""

import os
import pathlib

import pytest

from jaxident.start import start_jax

start_jax(cache="JAXIDENT_CACHE" in os.environ)  # as the program does; a folder given for it is fresh and the run's own

SHARED = pathlib.Path(__file__).resolve().parents[2] / "shared"


@pytest.fixture
def shared() -> pathlib.Path:
    """The folder of real logs beside the project; the test is skipped where it is missing."""
    if not SHARED.is_dir():
        pytest.skip("the folder shared/ does not lie beside the project")
    return SHARED

"""Double precision for every test; paths of the material that lies beside the project, where it does."""

import pathlib

import jax
import pytest

jax.config.update("jax_enable_x64", True)

SHARED = pathlib.Path(__file__).resolve().parents[2] / "shared"


@pytest.fixture
def shared() -> pathlib.Path:
    """The folder of real logs beside the project; the test is skipped where it is missing."""
    if not SHARED.is_dir():
        pytest.skip("the folder shared/ does not lie beside the project")
    return SHARED

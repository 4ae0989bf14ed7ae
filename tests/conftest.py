"""JAX set up as the program does; paths of the material that lies beside the project, where it does."""

import os
import pathlib
import tempfile
from collections.abc import Iterator

# Two workers share two cores. With two threads of linear algebra each, the tests of the diagnosis's noise, account and
# fits took 132 s of processor time, with one 106 s (one run each). The command line sets it, too, before NumPy comes.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import jax
import pytest

if "JAXIDENT_CHECK_SHAPES" in os.environ:  # types and shapes of every call; before any module of these is imported
    from jaxtyping import install_import_hook

    install_import_hook(["jaxident.numerics", "jaxident.robot", "jaxident.estimation"], "beartype.beartype")

from jaxident.start import start_jax

if (
    "JAXIDENT_CACHE" not in os.environ
):  # both workers of a run, and the programs that they start, share what is compiled
    FRESH = tempfile.TemporaryDirectory(prefix="jaxident-tests-")
    os.environ["JAXIDENT_CACHE"] = FRESH.name
start_jax()

SHARED = pathlib.Path(__file__).resolve().parents[2] / "shared"

QUICK = (
    "test_layers.py",
    "test_numerics.py",
    "robot/test_drive.py",
    "robot/test_path_length.py",
    "effects/test_records.py",
    "estimation/increments/test_projection.py",
    "estimation/poses/test_filter.py",
    "estimation/suspicions/test_suspicions.py",
    "study/test_engine.py",
    "diagnosis/test_end_to_end.py",
    "files/test_logs.py",
    "files/test_models.py",
    "export/test_targets.py",
    "plot/test_look.py",
    "report/test_diagnosis.py",
    "cli/test_export.py",
)
"""Test files of the quick tier, at least one for each folder of the package, one whole diagnosis among them."""

MAPS = pathlib.Path("/proc/self/maps")
MANY = 20_000
"""Memory maps from which compiled programs are let go: each takes several, and Linux allows a process 65530. At 50778
maps the tests of one process were nine tenths through; beyond the limit the process dies."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Gives the tests of the QUICK files the marker `quick`, apart from slow ones."""
    files = {pathlib.Path(__file__).parent / name for name in QUICK}
    assert all(file.is_file() for file in files), "QUICK names a file that is not there"
    for item in items:
        if item.path in files and not item.get_closest_marker("slow"):
            item.add_marker("quick")


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

"""Small signals to draw, and no windows."""

import matplotlib
import numpy as np
import pytest
from matplotlib import pyplot

from jaxident.array_types import Increment
from jaxident.log import Log, join, make_log


@pytest.fixture(autouse=True)
def off_screen():
    """No window opens, no figure stays open, and no picture changes the user's settings."""
    matplotlib.use("agg")
    before = matplotlib.rcParams.copy()
    yield
    assert matplotlib.rcParams == before
    pyplot.close("all")


@pytest.fixture
def log() -> Log:
    """One run of 60 rows in which the camera missed some poses."""
    t = 0.1 * np.arange(60.0)
    x, y = np.cos(t), 0.5 * np.sin(t)
    x[10:14] = y[10:14] = np.nan
    return make_log(t, np.sin(t), np.cos(3.0 * t), x, y, t + np.pi / 2.0)


@pytest.fixture
def two_runs(log) -> Log:
    """Two runs that both start at zero."""
    return join([log, log])


@pytest.fixture
def increment() -> Increment:
    """50 increments, one of them missing."""
    length = 1e-3 * np.sin(np.arange(50.0))
    length[7] = np.nan
    return Increment(length, 10.0 * length)

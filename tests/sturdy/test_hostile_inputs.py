"""Thousands of hostile inputs: whatever is read, only the program's own errors come out, soon, and no file is left.

2,000 inputs in the quick tier; 100,000 in the slow one, or as many as JAXIDENT_FUZZ says.
"""

import contextlib
import datetime
import os
import resource
import warnings
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis.strategies import SearchStrategy
from support import hostile
from support.program import jaxident

from jaxident.errors import InputError, WorkError
from jaxident.files.logs import read_log, write_log
from jaxident.files.models import load_model, model_to_dict, save_model
from jaxident.files.streams import merge, read_commands, read_poses
from jaxident.files.studies import read_study
from jaxident.study.dataset import describe

QUICK, SLOW = 2_000, int(os.environ.get("JAXIDENT_FUZZ", "100000"))
SHARES = {"logs": 0.4, "models": 0.25, "studies": 0.2, "streams": 0.1, "options": 0.05}
LONGEST = datetime.timedelta(seconds=5)
MOST_MEMORY = 1 << 20
"""Kilobytes by which the process may grow."""

tiers = pytest.mark.parametrize("total", [QUICK, pytest.param(SLOW, marks=pytest.mark.slow)])


def survive(kind: str, total: int, inputs: SearchStrategy, feed: Callable[[Any], None]) -> None:
    """Feed that kind's share of inputs; errors other than the program's own come out, and so do slow inputs."""
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    @settings(
        max_examples=round(SHARES[kind] * total), deadline=LONGEST, derandomize=total == QUICK, database=None,
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @given(inputs)
    def each(one):
        with warnings.catch_warnings(), contextlib.suppress(InputError, WorkError):
            warnings.simplefilter("ignore", UserWarning)  # the program's own; NumPy's are errors
            feed(one)

    each()
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - memory < MOST_MEMORY


@pytest.fixture
def put(tmp_path):
    """Writes bytes to a file of a name, and gives its path."""

    def write(name: str, content: bytes):
        path = tmp_path / name
        path.write_bytes(content)
        return path

    return write


@tiers
def test_logs(total, put, tmp_path):
    """What is read can be written, and is read again as it was."""

    def feed(content):
        log = read_log(put("log.csv", content))
        write_log(log, tmp_path / "again.csv")
        again = read_log(tmp_path / "again.csv")
        assert len(again.t) == len(log.t)

    survive("logs", total, hostile.logs(), feed)
    assert set(os.listdir(tmp_path)) <= {"log.csv", "again.csv"}


@tiers
def test_models(total, put, tmp_path):
    """What is loaded can be saved, and is loaded again as it was."""
    load_model("published")  # compiles what loading needs

    def feed(content):
        model = load_model(put("model.json", content))
        save_model(model, tmp_path / "again.json")
        assert model_to_dict(load_model(tmp_path / "again.json")) == model_to_dict(model)

    survive("models", total, hostile.models(), feed)
    assert set(os.listdir(tmp_path)) <= {"model.json", "again.json"}


@tiers
def test_studies(total, put, tmp_path):
    survive("studies", total, hostile.studies(), lambda content: describe(read_study(put("study.toml", content))))
    assert os.listdir(tmp_path) == ["study.toml"]


@tiers
def test_streams(total, put, tmp_path):
    """What is merged can be written; how many rows that may be is the program's own bound."""

    def feed(given):
        commands, poses, chosen = given
        read = read_commands(put("commands.csv", commands)), read_poses(put("poses.csv", poses))
        log = merge(*read, **chosen)
        if len(log.t) < 1000:
            write_log(log, tmp_path / "log.csv")

    survive("streams", total, hostile.streams(), feed)
    assert set(os.listdir(tmp_path)) <= {"commands.csv", "poses.csv", "log.csv"}


@tiers
def test_options(total, tmp_path):
    """Every wrong command line ends with a line and a code of the contract; nothing is left in or above its folder."""
    (tmp_path / "here").mkdir()

    def feed(words):
        ended = jaxident(*words, cwd=tmp_path / "here")
        assert ended.returncode in (0, 2), (words, ended)
        assert "JAXIDENT_TRACEBACK" not in ended.stderr
        assert "\x1b" not in ended.stderr
        assert os.listdir(tmp_path) == ["here"]
        assert os.listdir(tmp_path / "here") in ([], ["out"])

    survive("options", total, hostile.options(), feed)

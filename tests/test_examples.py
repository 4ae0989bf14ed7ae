"""The examples in the docstrings of public names run, and print what they say."""

import doctest
import importlib
import inspect

import pytest

import jaxident as ji
from jaxident import _HOMES

FINDER = doctest.DocTestFinder(recurse=False)
SESSION = importlib.import_module("jaxident.entry")
ONLINE = ("jaxident.estimation.increments.recursive", "jaxident.estimation.online.joint_filter")
SLOW = (
    *ONLINE,
    "jaxident.entry",
    "identify",
    "predict",
    "diagnose",
    "bootstrap",
    "plan",
    "cramer_rao",
    "study",
    "summarise",
    "naming",
)
"""They compile an estimator, 10 s and more each."""


def examples():
    """The docstrings with examples: of the session, the online estimators, public names, and functions that a package
    stands for."""
    called = importlib.import_module("jaxident.files.sweeps").study
    exporting = importlib.import_module("jaxident.export.export").export
    public = [inspect.unwrap(found) for found in (getattr(ji, name) for name in _HOMES) if callable(found)]
    found = [
        test
        for thing in (SESSION, *map(importlib.import_module, ONLINE), called, exporting, *public)
        for test in FINDER.find(thing, globs={})
        if test.examples
    ]
    return {test.name: test for test in found}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in examples()]
)
def test_an_example_prints_what_it_says(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    told = []
    failed, tried = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(examples()[name], out=told.append)
    assert tried
    assert not failed, "".join(told)


def test_the_main_functions_have_an_example():
    named = {name.rpartition(".")[2] for name in examples()}
    session = " ".join(example.source for example in examples()["jaxident.entry"].examples)
    main = ("read_log", "write_log", "Log", "identify", "predict", "simulate", "diagnose", "load_model", "save_model",
            "study", "cramer_rao", "path_length")  # fmt: skip
    assert [name for name in main if name not in named and f"ji.{name}(" not in session] == []

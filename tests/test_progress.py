"""The sign of life: on a terminal or in a notebook, after a while, and gone at the end."""

import io
import sys
import time

from jaxident import progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_shows_what_is_being_done_and_wipes_it_away(monkeypatch):
    monkeypatch.setattr(progress, "DELAY", 0.05)
    stream = Terminal()
    with progress.working("identifying", stream):
        time.sleep(0.3)
    text = stream.getvalue()
    assert "identifying" in text
    assert text.rstrip(" ").endswith("\r")


def test_short_work_shows_nothing():
    stream = Terminal()
    with progress.working("identifying", stream):
        pass
    assert stream.getvalue() == ""


def test_nothing_is_shown_without_a_terminal(monkeypatch):
    monkeypatch.setattr(progress, "DELAY", 0.0)
    stream = io.StringIO()
    with progress.working("identifying", stream):
        time.sleep(0.1)
    assert stream.getvalue() == ""


class Kernel:
    """What IPython tells in the kernel of a notebook."""

    config = ("IPKernelApp",)

    @classmethod
    def get_ipython(cls):
        return cls()


def test_a_notebook_shows_what_functions_do(monkeypatch, capsys):
    monkeypatch.setattr(progress, "DELAY", 0.05)
    with progress.working("diagnosing", progress.UNSEEN):
        time.sleep(0.2)
    assert capsys.readouterr().err == ""
    assert not progress.in_notebook()
    monkeypatch.setitem(sys.modules, "IPython", Kernel)
    assert progress.in_notebook()
    with progress.working("diagnosing", progress.UNSEEN):
        time.sleep(0.2)
    assert "diagnosing" in capsys.readouterr().err


def test_a_study_counts_its_trials_in_a_notebook(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "IPython", Kernel)
    with progress.counting("trials", progress.UNSEEN) as bar:
        bar.begin(8, 4)
        bar.advance(4)
    assert "4/8" in capsys.readouterr().err

"""The sign of life: on a terminal, after a while, and gone at the end."""

import io
import time

from jaxident.cli import progress


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

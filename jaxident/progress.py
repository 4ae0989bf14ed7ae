"""A sign of life on work that takes longer than two seconds: what is being done, and for how long."""

import io
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple, TextIO

DELAY = 2.0
"""Seconds before anything shows."""
UNSEEN = io.StringIO()
"""Where functions of the package send their bars: no terminal, so that a bar shows in a notebook alone."""


def in_notebook() -> bool:
    """Whether this process is the kernel of a notebook."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return shell is not None and "IPKernelApp" in shell.config


@contextmanager
def working(what: str, stream: TextIO | None = None) -> Iterator[None]:
    """Show `what` and the time that passes while the block runs; in a notebook or on a terminal only, wiped away at the
    end.

    Most of the work is one compiled program, which cannot say how far it is.
    """
    stream = sys.stderr if stream is None else stream
    if not _seen(stream):
        yield
        return
    done = threading.Event()

    def show() -> None:
        if done.wait(DELAY):
            return
        with _bar(stream, desc=what, bar_format="{desc} ... {elapsed}", initial=int(DELAY)) as bar:
            while not done.wait(0.5):
                bar.refresh()

    shower = threading.Thread(target=show, daemon=True)
    shower.start()
    try:
        yield
    finally:
        done.set()
        shower.join()


class Counter(NamedTuple):
    """begin(total, done) opens the bar, advance(count) moves it."""

    begin: Callable[[int, int], None]
    advance: Callable[[int], None]


@contextmanager
def counting(unit: str, stream: TextIO | None = None) -> Iterator[Counter]:
    """A bar with rate and time left while the block runs; in a notebook or on a terminal only, wiped away at the
    end."""
    stream = sys.stderr if stream is None else stream
    bars: list[Any] = []

    def begin(total: int, done: int) -> None:
        if _seen(stream):
            bars.append(_bar(stream, total=total, initial=done, unit=f" {unit}"))

    def advance(count: int) -> None:
        for bar in bars:
            bar.update(count)

    try:
        yield Counter(begin, advance)
    finally:
        for bar in bars:
            bar.close()


def _seen(stream: TextIO) -> bool:
    return stream.isatty() or in_notebook()


def _bar(stream: TextIO, **settings: Any) -> Any:
    """A bar that a notebook shows below its cell, a terminal on its last line."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # where a notebook has no widgets, text does
        from tqdm.auto import tqdm

        return tqdm(file=stream if stream.isatty() else sys.stderr, leave=False, **settings)

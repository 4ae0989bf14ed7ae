"""A sign of life on work that takes longer than two seconds: what is being done, and for how long."""

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple, TextIO

from tqdm import tqdm

DELAY = 2.0
"""Seconds before anything shows."""


@contextmanager
def working(what: str, stream: TextIO | None = None) -> Iterator[None]:
    """Show `what` and the time that passes while the block runs; on a terminal only, wiped away at the end.

    Most of the work is one compiled program, which cannot say how far it is.
    """
    stream = sys.stderr if stream is None else stream
    if not stream.isatty():
        yield
        return
    done = threading.Event()

    def show() -> None:
        if done.wait(DELAY):
            return
        with tqdm(desc=what, bar_format="{desc} ... {elapsed}", file=stream, leave=False, initial=int(DELAY)) as bar:
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
    """A bar with rate and time left while the block runs; on a terminal only, wiped away at the end."""
    stream = sys.stderr if stream is None else stream
    bars: list[tqdm] = []

    def begin(total: int, done: int) -> None:
        hidden = not stream.isatty()
        bars.append(tqdm(total=total, initial=done, unit=f" {unit}", file=stream, leave=False, disable=hidden))

    def advance(count: int) -> None:
        for bar in bars:
            bar.update(count)

    try:
        yield Counter(begin, advance)
    finally:
        for bar in bars:
            bar.close()

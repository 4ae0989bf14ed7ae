"""A sign of life on work that takes longer than two seconds: what is being done, and for how long."""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TextIO

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

"""Many trials at once: blocks of trials that fit the cache, on all cores of this machine."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import jax


def in_parallel(function: Callable[..., Any], blocks: Sequence[tuple[Any, ...]], cores: int | None = None) -> list[Any]:
    """The results of a compiled function on blocks of arguments, all of one shape, in their order.

    One thread per core (`cores`: how many, all by default) takes the next block when it is done with one. The program
    is compiled once and releases Python while it runs; no data pass between the blocks, so that none waits for
    another.
    """
    with ThreadPoolExecutor(cores or os.cpu_count()) as threads:
        return list(threads.map(lambda block: jax.block_until_ready(function(*block)), blocks))

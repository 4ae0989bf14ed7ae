"""Blocks of work that fit the cache, side by side on all cores of this machine."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import jax


def in_parallel(
    function: Callable[..., Any], blocks: Sequence[tuple[Any, ...]], cores: int | None = None, *, ahead: bool = True
) -> list[Any]:
    """The results of a compiled function on blocks of arguments, all of one shape, in their order.

    One thread per core (`cores`: how many, all by default) takes the next block when it is done with one. The program
    is compiled once and releases Python while it runs; no data pass between the blocks, so that none waits for
    another: results are the same to the bit with any number of threads. `ahead`: whether the function is compiled
    already. If not, the first block runs alone: threads that come first would each compile it.
    """

    def run(block: tuple[Any, ...]) -> Any:
        return jax.block_until_ready(function(*block))

    alone = 0 if ahead else 1
    first, others = [run(block) for block in blocks[:alone]], blocks[alone:]
    if len(others) < 2:  # threads would only cost
        return first + [run(block) for block in others]
    with ThreadPoolExecutor(cores or os.cpu_count()) as threads:
        return first + list(threads.map(run, others))

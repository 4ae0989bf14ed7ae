"""Blocks of work that fit the cache of a CPU, side by side on all its cores, or the memory of a card."""

import contextlib
import contextvars
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import jax

from jaxident.numerics import float64_switch

SMALLEST_CARD = 2 << 30
"""Bytes of a card that does not tell its memory: no card that is sold for such work has less."""
_most_cores: contextvars.ContextVar[int | None] = contextvars.ContextVar("most_cores", default=None)


@contextlib.contextmanager
def at_most(cores: int | None) -> Iterator[None]:
    """Within it `in_parallel` takes so many cores by default: one in a process beside others that fill the machine;
    None for all."""
    before = _most_cores.set(cores)
    try:
        yield
    finally:
        _most_cores.reset(before)


def in_parallel(
    function: Callable[..., Any], blocks: Sequence[tuple[Any, ...]], cores: int | None = None, *, ahead: bool = True
) -> list[Any]:
    """The results of a compiled function on blocks of arguments, all of one shape, in their order.

    One thread per core (`cores`: how many, by default all, or what `at_most` says) takes the next block when it is
    done with one. The program is compiled once and releases Python while it runs; no data pass between the blocks, so
    that none waits for another: results are the same to the bit with any number of threads. `ahead`: whether the
    function is compiled already. If not, the first block runs alone: threads that come first would each compile it. A
    graphics card takes one block at a time, for each may fill its memory (`trials_at_once`).
    """
    if cores is None:
        cores = _most_cores.get() or (os.cpu_count() if card_memory() is None else 1)
    precise = as_precise(function)

    def run(block: tuple[Any, ...]) -> Any:
        return jax.block_until_ready(precise(*block))

    alone = 0 if ahead else 1
    first, others = [run(block) for block in blocks[:alone]], blocks[alone:]
    if len(others) < 2 or cores == 1:  # threads would only cost
        return first + [run(block) for block in others]
    with ThreadPoolExecutor(cores) as threads:
        return first + list(threads.map(run, others))


def as_precise(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function for other threads, in the precision that this one has: JAX switches each thread by itself."""
    double = bool(jax.config.jax_enable_x64)  # type: ignore[attr-defined]

    def call(*args: Any) -> Any:
        with float64_switch(double):
            return function(*args)

    return call


def card_memory() -> int | None:
    """Bytes that JAX may use on the smallest graphics card of this process; None where it computes on a CPU."""
    if jax.default_backend() == "cpu":
        return None
    told = [device.memory_stats() or {} for device in jax.local_devices()]
    return min(stats.get("bytes_limit", SMALLEST_CARD) for stats in told)


def trials_at_once(on_cpu: int, bytes_each: float) -> int:
    """Trials of a block on one device: `on_cpu` of them, which fit the cache, or as many as half of a card's memory
    holds; `bytes_each`: what one needs there."""
    memory = card_memory()
    return on_cpu if memory is None else max(on_cpu, int(0.5 * memory / bytes_each))

"""A study's chunks as tasks of Dask distributed, on this machine or many; extra `cluster`.

Only this process writes: workers return arrays, and need neither the study's folder nor a shared disk.
"""

import contextlib
import gc
import itertools
import logging
import re
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from typing import Any

from jaxident.errors import InputError, WorkError
from jaxident.start import start_jax
from jaxident.study.dataset import versions
from jaxident.study.design import Study
from jaxident.study.engine import chunks, run_chunk
from jaxident.study.trial import Outcome

AHEAD = 2
"""Chunks that each worker has in hand: the next one waits there while one is computed."""

LOOPBACK = "127.0.0.1"
RETRIES = 3
PATIENCE = "20s"


@contextlib.contextmanager
def connected(scheduler: str) -> Iterator[Any]:
    """A Dask client: of a scheduler's address, or of `local:N`, N processes of one thread each on this machine, bound
    to its loopback. InputError where Dask is missing, the text is neither, or nobody answers."""
    local = re.fullmatch(r"local:([1-9]\d*)", scheduler)
    if scheduler.startswith("local") and not local:
        raise InputError(f"--scheduler {scheduler}: local:N with N processes from 1 on, as local:2")
    try:
        import distributed
    except ImportError:
        raise InputError("--scheduler needs Dask: install jaxident with the extra `cluster`") from None
    with contextlib.ExitStack() as stack:
        if local:
            scheduler = stack.enter_context(_local_cluster(int(local[1])))
        client, failure = None, ""
        try:
            client = distributed.Client(scheduler, timeout=PATIENCE, set_as_default=False)
        except (OSError, ValueError) as error:
            failure = str(error)
        if client is None:
            gc.collect()  # else Python may collect, and so close, the failed client while another one starts: both wait
            raise InputError(f"--scheduler {scheduler}: nobody answers there: {failure}")
        yield stack.enter_context(client)


@contextlib.contextmanager
def _local_cluster(count: int) -> Iterator[str]:
    """The address of a scheduler with so many workers of one thread, all on the loopback.

    Every part of Dask has a small web server, also where its dashboard is off, and `LocalCluster` opens those of the
    workers (with Dask 2024.8 the scheduler's too) to the whole network. Here they stand on the loopback, with no pages.
    """
    import dask
    import distributed

    own = {"host": LOOPBACK, "dashboard": False, "dashboard_address": f"{LOOPBACK}:0"}
    worker = {"cls": distributed.Nanny, "options": {**own, "nthreads": 1, "silence_logs": logging.CRITICAL}}
    pages = dask.config.set({"distributed.scheduler.http.routes": [], "distributed.worker.http.routes": []})
    cluster = distributed.SpecCluster(
        workers=dict.fromkeys(range(count), worker),
        scheduler={"cls": distributed.Scheduler, "options": own},
        silence_logs=logging.CRITICAL,
    )
    with pages, cluster:
        yield cluster.scheduler_address


def run_on(client: Any, study: Study, numbers: Sequence[int]) -> Iterator[tuple[int, Outcome]]:
    """The chunks of these numbers, in the order in which they are done; a worker that dies is replaced by others.

    Every task carries the study, about 1 kB: one that only workers held would be lost with the last of them.
    WorkError where a chunk takes down every worker that tries it, where workers have other versions, or where the
    scheduler is gone.
    """
    from distributed import as_completed

    waiting = iter(numbers)
    ours = versions()
    workers = max(1, len(client.scheduler_info(n_workers=-1)["workers"]))

    def submit(count: int) -> list[Any]:
        batch = itertools.islice(waiting, count)
        return [client.submit(_task, study, number, ours, pure=False, retries=RETRIES) for number in batch]

    running = as_completed(submit(AHEAD * workers), loop=client.loop)
    for future in running:
        number, outcome = _result(future)
        running.update(submit(1))
        future.release()
        yield number, outcome


def _result(future: Any) -> tuple[int, Outcome]:
    """What a task gave back."""
    from distributed import KilledWorker

    try:
        return future.result()
    except KilledWorker as error:
        raise WorkError(f"a chunk ended {RETRIES} workers or more: {error}") from None
    except (OSError, CancelledError) as error:
        told = "with one that answers the study goes on where it stopped"
        raise WorkError(f"the scheduler is gone ({type(error).__name__}); {told}") from None


def _task(study: Study, number: int, expected: dict[str, str]) -> tuple[int, Outcome]:
    """One chunk, on a worker's own single thread."""
    start_jax()
    if versions() != expected:
        found = ", ".join(f"{k} {v}" for k, v in versions().items() if expected.get(k) != v)
        raise WorkError(f"a worker has {found} where this process has another version; install the same everywhere")
    return number, run_chunk(study, chunks(study)[number], cores=1)

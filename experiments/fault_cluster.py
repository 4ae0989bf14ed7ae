"""Workers and schedulers of Dask that die or stand still while `sweep` uses them."""

import importlib.util
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import xarray

from experiments.fault_cases import ENVIRONMENT, STUDY, run, start
from experiments.fault_damage import _same
from experiments.fault_places import one_line

LOCAL = ["--host", "127.0.0.1", "--no-dashboard"]
SERVER = [sys.executable, "-m", "distributed.cli.dask_scheduler", *LOCAL, "--port", "0"]
WORKER = [sys.executable, "-m", "distributed.cli.dask_worker", *LOCAL, "--nthreads", "1"]
PATIENCE = 240.0
"""Seconds after which a sweep that does not end has failed."""


def cluster_faults(folder: pathlib.Path) -> Iterator[tuple]:
    """A row for each fault; none where Dask is not installed."""
    if importlib.util.find_spec("distributed") is None:
        yield "Dask", "not installed here", 0, 0, "not tried"
        return
    place = folder / "cluster"
    place.mkdir()
    (place / "study.toml").write_text(STUDY.replace("100", "400"))
    run(("sweep", "study.toml", "--out", "whole"), place)
    with xarray.open_zarr(place / "whole" / "trials.zarr") as opened:
        whole = opened.load()
    for name, fault in FAULTS.items():
        yield _one(name, fault, place, whole)


def _one(name: str, fault: Callable, place: pathlib.Path, whole: xarray.Dataset) -> tuple:
    """The fault when a quarter of the chunks is there; then the sweep ends whole, or with one line and is resumed."""
    shutil.rmtree(place / "s", ignore_errors=True)
    server = subprocess.Popen(SERVER, stderr=subprocess.PIPE, text=True)
    address = next(found[0] for line in server.stderr if (found := re.search(r"tcp://127\.0\.0\.1:\d+", line)))
    workers = [_worker(address) for _ in range(2)]
    running = start(("sweep", "study.toml", "--out", "s", "--scheduler", address), place)
    try:
        while running.poll() is None and len(list((place / "s").rglob(".chunks/*.json"))) < 3:
            time.sleep(0.05)
        before = len(list((place / "s").rglob(".chunks/*.json")))
        fault(server, workers, address)
        try:
            _, err = running.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            running.kill()
            return name, "sweep", 1, 0, f"does not end within {PATIENCE:g} s"
    finally:
        for one in (*workers, server):
            one.send_signal(signal.SIGCONT)
            one.kill()
            one.wait()
    code = running.returncode
    kept = len(list((place / "s").rglob(".chunks/*.json"))) >= before
    told = f"code {code}: {err.strip().splitlines()[-1][:200] if err.strip() else ''}"
    good = kept and (code == 0 or one_line(err))
    if code:
        resumed, _, err = run(("sweep", "study.toml", "--out", "s"), place)
        told += f"; resumed with code {resumed}"
        good = good and resumed == 0
    good = good and _same(place / "s" / "trials.zarr", whole)
    return name, "sweep", 1, int(good), told


def _worker(address: str) -> subprocess.Popen:
    return subprocess.Popen([*WORKER, address], stderr=subprocess.DEVNULL, env=ENVIRONMENT)


def _worker_killed(server, workers, address) -> None:
    workers[0].kill()


def _all_workers_killed(server, workers, address) -> None:
    for worker in workers:
        worker.kill()
    workers.append(_worker(address))


def _scheduler_killed(server, workers, address) -> None:
    server.kill()


def _scheduler_stalls(server, workers, address) -> None:
    """Nothing goes through for ten seconds, as in a network that is parted."""
    server.send_signal(signal.SIGSTOP)
    time.sleep(10.0)
    server.send_signal(signal.SIGCONT)


FAULTS = {
    "one of two workers killed": _worker_killed,
    "both workers killed, another comes": _all_workers_killed,
    "scheduler killed": _scheduler_killed,
    "scheduler stands still for 10 s": _scheduler_stalls,
}

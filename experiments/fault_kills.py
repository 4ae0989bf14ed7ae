"""SIGKILL and SIGTERM, at random moments and while a file is being written."""

import pathlib
import random
import signal
import subprocess
import time
from typing import NamedTuple

from experiments.fault_cases import Case, copied, left_over, run, start, wrong

FRESH = 2.1
"""Seconds after which the program takes a hidden file for a left-over."""
LAST_MOMENT = 0.004
"""Seconds from the first sight of a hidden file to the kill, at most."""


class Killed(NamedTuple):
    """How one try ended: the exit code, hidden files left, hidden files after the next call, what was wrong."""

    code: int
    left: int
    left_after: int
    wrong: list[str]


def kill_once(case: Case, base: pathlib.Path, place: pathlib.Path, whole, seconds: float, deadly, aimed: bool,
              moments: random.Random) -> Killed:  # fmt: skip
    """Run, kill, look, and call the program once more in the same folder."""
    folder = copied(base, place, case, old=moments.random() < 0.5)
    running = start(case.words, folder, stderr=subprocess.DEVNULL)
    if aimed:
        _wait_for_a_part(running, {folder / pathlib.Path(name).parent for name in case.outputs}, moments)
    else:
        time.sleep(moments.uniform(0.0, seconds))
    running.send_signal(deadly)
    printed, _ = running.communicate()
    faults = wrong(folder, base, case, whole, printed)
    parts = left_over(folder)
    if parts:
        time.sleep(FRESH)
        for where in {part.parent for part in parts}:
            run(("effects", "--json", str(where / "after.json")), folder)
    return Killed(running.returncode, len(parts), len(left_over(folder)), faults)


def _wait_for_a_part(running: subprocess.Popen, folders: set[pathlib.Path], moments: random.Random) -> None:
    """Until one of the files, at random which, is being written, or the program has ended."""
    skipped = moments.randrange(3)
    seen: set[str] = set()
    while running.poll() is None:
        parts = {part.name for folder in folders for part in folder.glob(".*.part")}
        if parts - seen and len(seen | parts) > skipped:
            time.sleep(moments.uniform(0.0, LAST_MOMENT))
            return
        seen |= parts
        time.sleep(2e-4)


def kills(case: Case, base: pathlib.Path, place: pathlib.Path, whole, seconds: float, tries: int, seed: int):
    """So many tries, half of them aimed at a file, half of them by SIGTERM; yields (signal's name, Killed)."""
    moments = random.Random(f"{seed} {case.name}")
    for number in range(tries):
        deadly = (signal.SIGKILL, signal.SIGTERM)[number % 2]
        aimed = number // 2 % 2 == 0
        yield deadly.name, kill_once(case, base, place, whole, seconds, deadly, aimed, moments)

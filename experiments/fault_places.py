"""Places that cannot be written: a disk that is full, a folder without permission, a clock that was set back."""

import contextlib
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator

from experiments.fault_cases import ENVIRONMENT, OLD, Case, contents, copied, left_over, run, wrong

FREE = (0, 1, 3)
"""Kilobytes that are left on the disk, in units of 4."""
NO_OVERRIDE = ("setpriv", "--bounding-set=-dac_override,-dac_read_search", "--inh-caps=-dac_override,-dac_read_search")
"""Takes from root what lets it write where it has no permission: then it is as any other user."""


@contextlib.contextmanager
def small_disk(place: pathlib.Path, base: pathlib.Path, size: int) -> Iterator[bool]:
    """A tmpfs that holds the inputs and so many bytes more; False where none can be mounted."""
    place.mkdir(exist_ok=True)
    files = [path.stat().st_size for path in base.rglob("*") if path.is_file()]
    blocks = sum(-(-count // 4096) for count in files) + 1
    words = ["mount", "-t", "tmpfs", "-o", f"size={blocks * 4096 + size}", "tmpfs", str(place)]
    mounted = subprocess.run(words, capture_output=True, check=False)
    try:
        yield mounted.returncode == 0
    finally:
        if mounted.returncode == 0:
            subprocess.run(["umount", str(place)], check=True)
        shutil.rmtree(place, ignore_errors=True)


def full_disks(case: Case, base: pathlib.Path, place: pathlib.Path, whole) -> Iterator[tuple]:
    """One row: the command with less and less room. It has to end with code 1 and one line, or to be done."""
    tried = survived = full = 0
    told: set[str] = set()
    kind = "full disk"
    for free in FREE[: 1 if case.slow else None]:
        with small_disk(place, base, free * 4096) as mounted:
            folder = place / "here" if mounted else copied(base, place / "here", case, old=False)
            if mounted:
                shutil.copytree(base, folder, copy_function=shutil.copyfile)
                code, printed, err = run(case.words, folder)
            else:
                kind = "limit to the size of files"
                code, printed, err = run(case.words, folder, preexec_fn=lambda limit=free * 4096: _limit(limit))
            faults = wrong(folder, base, case, whole, printed) + [f"{p.name} stays" for p in left_over(folder)]
            if code not in (0, 1) or (code and not one_line(err)):
                faults.append(f"code {code}: {err.strip()[-200:]}")
            if code == 0 and contents(folder, case) != whole:
                faults.append("done, and not all is there")
        tried, survived, full = tried + 1, survived + (not faults), full + (code == 1)
        told |= set(faults)
    yield kind, case.name, tried, survived, "; ".join(sorted(told)) or f"{full} ended with code 1, the others had room"


def _limit(size: int) -> None:
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


def one_line(err: str) -> bool:
    """Whether the last message is the program's own."""
    lines = err.strip().splitlines()
    return bool(lines) and lines[-1].startswith("jaxident: ") and "JAXIDENT_TRACEBACK" not in err


def locked_folders(case: Case, base: pathlib.Path, place: pathlib.Path) -> Iterator[tuple]:
    """One row: folders, and then files, without permission to write. It has to end with code 2, soon, and one line."""
    tried = survived = 0
    told: set[str] = set()
    for old in (False, True):
        folder = copied(base, place, case, old)
        inside = {(folder / name).parent for name in case.outputs}
        for one in inside:
            one.mkdir(exist_ok=True)
        for path in [*((folder / name) for name in case.outputs if old), *inside]:
            path.chmod(0o444 if path.is_file() else 0o555)
        words = [*NO_OVERRIDE, sys.executable, "-m", "jaxident", *case.words]
        ended = subprocess.run(words, cwd=folder, capture_output=True, text=True, env=ENVIRONMENT, check=False)
        refused = ended.returncode == 2 and one_line(ended.stderr)
        faults = [] if refused else [f"code {ended.returncode}: {ended.stderr}"]
        if any(content != OLD for content in contents(folder, case).values()) or left_over(folder):
            faults.append("something was written")
        for one in inside:
            one.chmod(0o755)
        tried, survived = tried + 1, survived + (not faults)
        told |= set(faults)
    yield "no permission", case.name, tried, survived, "; ".join(sorted(told))


def clock_set_back(base: pathlib.Path, place: pathlib.Path) -> Iterator[tuple]:
    """One row: what a killed writer left before the clock was set back by a day is removed all the same."""
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    left = place / f".{16 * 'a'}.part"
    left.write_bytes(b"half")
    os.utime(left, (time.time() + 86400.0,) * 2)
    code, _, err = run(("effects", "--json", "e.json"), place)
    good = code == 0 and not left.exists()
    yield "clock set back by a day", "left-over", 1, int(good), "" if good else f"{code} {err}: the left-over stays"

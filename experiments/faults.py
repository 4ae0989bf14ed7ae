"""What a fault leaves behind: is anything lost that was reported as written, is any file half-written?

    python -m experiments.faults [--tries 12] [--slow-tries 4] [--only kills disk folders damage cluster]

Each command that writes is run in a folder of its own and ended by SIGKILL or SIGTERM, at a random moment or while it
writes; given a disk that is full (a tmpfs where one can be mounted, else a limit to the size of files), a folder that
it may not write; given inputs, stores and a cache of compiled programs that are cut short or have flipped bits. A Dask
worker and a scheduler are killed. Prints a table: faults tried, faults survived, what went wrong.
"""

import argparse
import pathlib
import tempfile
import time
from typing import NamedTuple

from experiments.fault_cases import CASES, Case, contents, copied, prepare, run, wrong
from experiments.fault_cluster import cluster_faults
from experiments.fault_damage import damages
from experiments.fault_kills import kills
from experiments.fault_places import full_disks, locked_folders

GROUPS = ("kills", "disk", "folders", "damage", "cluster")


class Row(NamedTuple):
    """A line of the table."""

    fault: str
    command: str
    tried: int
    survived: int
    told: str


def reference(case: Case, base: pathlib.Path, place: pathlib.Path) -> tuple[dict[str, bytes], float]:
    """The files of an untouched run, and the seconds that a run takes once its programs are compiled."""
    for _ in range(2):
        folder = copied(base, place, case, old=False)
        begin = time.perf_counter()
        code, _, err = run(case.words, folder)
        if code or set(found := contents(folder, case)) != set(case.outputs):
            raise SystemExit(f"{case.name}: {code} {err} {sorted(found)}")
        if faults := wrong(folder, base, case, found, ""):
            raise SystemExit(f"{case.name}: {faults}")
    return found, time.perf_counter() - begin


def kill_rows(case: Case, base: pathlib.Path, place: pathlib.Path, whole, seconds: float, tries: int, seed: int):
    """One row for each signal."""
    found = list(kills(case, base, place, whole, seconds, tries, seed))
    for name in dict.fromkeys(name for name, _ in found):
        ended = [one for other, one in found if other == name]
        faults = [fault for one in ended for fault in one.wrong]
        faults += [f"{one.left_after} hidden files stay" for one in ended if one.left_after]
        early, left = sum(one.code != 0 for one in ended), sum(one.left > 0 for one in ended)
        good = sum(not one.wrong and not one.left_after for one in ended)
        told = "; ".join(faults) or f"{early} ended early, {left} left a hidden file, which the next call removed"
        yield Row(name, case.name, len(ended), good, told)


def table(rows: list[Row]) -> str:
    """The rows in Markdown."""
    lines = ["| fault | command or file | tried | survived | |", "|---|---|---|---|---|"]
    lines += [f"| {row.fault} | {row.command} | {row.tried} | {row.survived} | {row.told} |" for row in rows]
    tried, survived = sum(row.tried for row in rows), sum(row.survived for row in rows)
    return "\n".join([*lines, f"| all | | {tried} | {survived} | |"])


def experiment(options, folder: pathlib.Path):
    """Yield the rows of every group that was asked for."""
    base, place = folder / "base", folder / "here"
    prepare(base)
    for case in CASES:
        asked = not options.commands or case.name in options.commands
        if not asked or not {"kills", "disk", "folders"} & {*options.only}:
            continue
        whole, seconds = reference(case, base, place)
        if "kills" in options.only:
            tries = options.slow_tries if case.slow else options.tries
            yield from kill_rows(case, base, place, whole, seconds, tries, options.seed)
        if "disk" in options.only and not case.changing:
            yield from (Row(*row) for row in full_disks(case, base, folder / "disk", whole))
        if "folders" in options.only:
            yield from (Row(*row) for row in locked_folders(case, base, place))
    if "damage" in options.only:
        yield from (Row(*row) for row in damages(base, folder, options.tries, options.seed))
    if "cluster" in options.only:
        yield from (Row(*row) for row in cluster_faults(folder))


def main() -> None:
    """Try all faults and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tries", type=int, default=12)
    parser.add_argument("--slow-tries", type=int, default=4, help="of commands that take minutes")
    parser.add_argument("--only", nargs="+", choices=GROUPS, default=GROUPS)
    parser.add_argument("--commands", nargs="+", choices=[case.name for case in CASES])
    parser.add_argument("--seed", type=int, default=0, help="of the moments and places")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        rows = []
        for row in experiment(options, pathlib.Path(place)):
            print(row, flush=True)
            rows.append(row)
    print(table(rows))


if __name__ == "__main__":
    main()

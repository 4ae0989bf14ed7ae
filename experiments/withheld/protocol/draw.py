"""Draw a set of cases: folders of logs, and beside them (never inside) the answers."""

import pathlib
import time

from .cases import write_answers, write_case
from .sets import draw_set, simulate_block


def draw(names: list[str], seed: int, out: pathlib.Path, answers: pathlib.Path) -> None:
    """Write OUT/case_NNN/ and the answers of these sets, numbered on; blocks of cases are simulated as one batch."""
    sets, begin, done = [draw_set(name, seed) for name in names], time.monotonic(), 0
    for cases in sets:
        block = 60 if cases[0]["generator"] == "batch" else 5
        for first in range(0, len(cases), block):
            part = cases[first : first + block]
            for number, logs in enumerate(simulate_block(part), start=done + 1):
                write_case(out / f"case_{number:03d}", logs)
            done += len(part)
            spent, total = time.monotonic() - begin, sum(map(len, sets))
            print(f"{done} of {total} cases in {spent:.0f} s; in all about {spent / done * total:.0f} s", flush=True)
    everything = [case for cases in sets for case in cases]
    write_answers(answers, {f"case_{k:03d}": case for k, case in enumerate(everything, start=1)})
    print(f"wrote {answers}")

"""Draw a set of cases: folders of logs, and beside them (never inside) the answers."""

import pathlib
import time

from .cases import write_answers, write_case
from .sets import draw_set, simulate_block


def draw(name: str, seed: int, out: pathlib.Path, answers: pathlib.Path, block: int | None = None) -> None:
    """Write OUT/case_NNN/ and the answers; blocks of cases are simulated as one batch."""
    cases, begin = draw_set(name, seed), time.monotonic()
    block = block or (60 if cases[0]["generator"] == "batch" else 5)
    for first in range(0, len(cases), block):
        part = cases[first : first + block]
        for number, logs in enumerate(simulate_block(part), start=first + 1):
            write_case(out / f"case_{number:03d}", logs)
        done = first + len(part)
        spent = time.monotonic() - begin
        print(f"{done} of {len(cases)} cases in {spent:.0f} s; in all {spent / done * len(cases):.0f} s", flush=True)
    write_answers(answers, {f"case_{k:03d}": case for k, case in enumerate(cases, start=1)})
    print(f"wrote {answers}")

"""`python -m experiments.withheld.worker OUT CASE...`: `jaxident diagnose` on case after case in one process.

It keeps what it compiled. OUT/NAME/process.json tells exit code, seconds and the last lines of stderr of each.
"""

import contextlib
import io
import json
import pathlib
import sys
import time

from jaxident.cli import main


def work(out: pathlib.Path, cases: list[pathlib.Path]) -> None:
    """Diagnose every case that has no record yet."""
    for case in cases:
        folder = out / case.name
        if (folder / "process.json").exists():
            continue
        folder.mkdir(parents=True, exist_ok=True)
        words, said, begin = ["diagnose", str(case), "--out", str(folder)], io.StringIO(), time.monotonic()
        with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
            code = _run(words)
        found = {
            "case": case.name,
            "command": "jaxident diagnose {case} --out {out}",
            "exit_code": code,
            "seconds": round(time.monotonic() - begin, 2),
            "stderr": said.getvalue().strip().splitlines()[-3:],
        }
        (folder / "process.json").write_text(json.dumps(found, indent=1) + "\n")
        print(f"{case.name}: exit {code}, {found['seconds']} s", flush=True)


def _run(words: list[str]) -> int:
    """The program's own entry, its exit code returned."""
    sys.argv = ["jaxident", *words]
    try:
        main.run()
    except SystemExit as done:
        return int(done.code or 0)
    return 0


if __name__ == "__main__":
    work(pathlib.Path(sys.argv[1]), [pathlib.Path(each) for each in sys.argv[2:]])

"""Run `jaxident diagnose` on every case, each in a process of its own that knows the case's folder alone."""

import concurrent.futures
import json
import os
import pathlib
import shlex
import subprocess
import sys
import time

DEFAULT = f"{shlex.quote(sys.executable)} -m jaxident diagnose {{case}} --out {{out}}"
"""The command; {case} and {out} are replaced by folders."""


def diagnose(cases: pathlib.Path, out: pathlib.Path, command: str = DEFAULT, jobs: int = 1) -> list[dict]:
    """OUT/case_NNN/diagnosis.json for every case that has none yet, and OUT/case_NNN/process.json beside it: exit code,
    seconds, last lines of stderr. What was done is not done again."""
    folders = sorted(folder for folder in cases.iterdir() if folder.is_dir())
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        return list(pool.map(lambda folder: _one(folder.resolve(), (out / folder.name).resolve(), command), folders))


def _one(case: pathlib.Path, out: pathlib.Path, command: str) -> dict:
    record = out / "process.json"
    if record.exists():
        return json.loads(record.read_text())
    out.mkdir(parents=True, exist_ok=True)
    words = [word.format(case=case, out=out) for word in shlex.split(command)]
    begin = time.monotonic()
    done = subprocess.run(words, cwd=out, env=_environment(), capture_output=True, text=True, check=False)
    found = {
        "case": case.name,
        "command": shlex.join(shlex.split(command)),
        "exit_code": done.returncode,
        "seconds": round(time.monotonic() - begin, 2),
        "stderr": done.stderr.strip().splitlines()[-3:],
    }
    record.write_text(json.dumps(found, indent=1) + "\n")
    print(f"{case.name}: exit {done.returncode}, {found['seconds']} s", flush=True)
    return found


def _environment() -> dict[str, str]:
    """That of this process, with the folder from which it imports the package first."""
    root = str(pathlib.Path(__file__).resolve().parents[3])
    paths = [root, *filter(None, [os.environ.get("PYTHONPATH")])]
    return os.environ | {"PYTHONPATH": os.pathsep.join(paths)}

"""Commands that write, each small enough to be run often, and the judge of what a fault left of their files."""

import json
import os
import pathlib
import shutil
import subprocess
import sys
from typing import NamedTuple

ROOT = pathlib.Path(__file__).resolve().parents[1]
ENVIRONMENT = os.environ | {"PYTHONPATH": str(ROOT)}
"""So that the program beside this file is run, wherever another one is installed."""
OLD = b"what stood here before\n"
PARTS = (".*.part", ".part-*", "*.partial")
"""Names of the hidden files and folders in which the program writes before it renames."""
SEEN = ("--method", "key-term-least-squares")
STUDY = """
name = "small"
seeds = 100
noise = [1e-5, 1e-4]
samples = [50]
hold = 4
chunk = 10
robots = [{ model = "published" }]
estimators = ["recursive"]
"""
ROBOT = ("simulate", "published", "--excitation", "multilevel", "--samples", "240")
SIMULATE = (*ROBOT, "--hold", "5", "--noise", "5e-4,3e-3")


class Case(NamedTuple):
    """A command: its words, the files that it writes, and whether they differ from call to call (times in them)."""

    words: tuple[str, ...]
    outputs: tuple[str, ...]
    changing: bool = False
    slow: bool = False

    @property
    def name(self) -> str:
        """The command's word."""
        return self.words[0]


def _in(folder: str, *names: str) -> tuple[str, ...]:
    return tuple(f"{folder}/{name}" for name in names)


def _told(name: str) -> tuple[str, str]:
    """An output, and the file beside it that says what it was made from."""
    return name, f"{name}.provenance.json"


RUNS = tuple(f"real_{k}.csv" for k in range(1, 7))
AHEAD = ("predict", "seen.json", "log.csv", "--horizon", "5")
FIGURES = (
    *("path", "convergence", "figure_4", "figure_7", "figure_8", "figure_9", "drift_dead_zone_r", "drift_delta_21"),
    *("noise_alpha_1", "noise_alpha_2", "noise_dead_zone_r", "noise_delta_21"),
)
CASES = (
    Case(("effects", "--json", "e.json"), ("e.json",)),
    Case((*SIMULATE, "--out", "s.csv.gz"), _told("s.csv.gz")),
    Case(("example", "--effect", "none", "--out", "ex"), _in("ex", *RUNS, ".answer.json")),
    Case(("convert", "--commands", "commands.csv", "--poses", "poses.csv", "--out", "c.csv"), _told("c.csv")),
    Case(("identify", "log.csv", *SEEN, "--out", "i.json", "--json", "r.json"), ("i.json", "r.json")),
    Case((*AHEAD, "--out", "p.csv", "--json", "p.json"), (*_told("p.csv"), "p.json")),
    Case(
        ("export", "ml.json", "--to", "mjcf", "--out", "m.xml", "--json", "m.json"),
        (*_told("m.xml"), "m_commands.py", "m.json"),
    ),
    Case(("plan", "ml.json", "--between", "transport_delay,motor_lag", "--out", "n.csv"), _told("n.csv")),
    Case(
        ("diagnose", "real", "--out", "d"),
        _in("d", "diagnosis.json", "nominal_model.json", "corrected_model.json", "report.html"),
        slow=True,
    ),
    Case(
        ("reproduce", "--seeds", "2", "--out", "rep"),
        _in("rep", "table.json", "index.html", *(f"{name}.png" for name in FIGURES)),
        slow=True,
    ),
    Case(("bench", "--trials", "50", "--json", "b.json"), ("b.json",), changing=True, slow=True),
)


def start(words, folder: pathlib.Path, **more) -> subprocess.Popen:
    """The program with these words in a folder; what it prints comes at once."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "env": ENVIRONMENT} | more
    return subprocess.Popen([sys.executable, "-u", "-m", "jaxident", *words], cwd=folder, **pipes)


def run(words, folder: pathlib.Path, **more) -> tuple[int, str, str]:
    """Run to the end: exit code, what it printed, its messages."""
    running = start(words, folder, **more)
    out, err = running.communicate()
    return running.returncode, out, err


def prepare(base: pathlib.Path) -> None:
    """The inputs of all cases, made by the program itself. RuntimeError where it fails."""
    base.mkdir()
    (base / "real").mkdir()
    (base / "study.toml").write_text(STUDY)
    times = [0.1 * k for k in range(100)]
    (base / "commands.csv").write_text("t,u_r,u_l\n" + "".join(f"{t:.2f},{t % 1:.2f},{t % 2:.2f}\n" for t in times))
    (base / "poses.csv").write_text("t,x,y,theta\n" + "".join(f"{t:.2f},{t:.3f},0,{0.1 * t:.3f}\n" for t in times))
    for words in (
        (*SIMULATE, "--out", "log.csv"),
        *((*SIMULATE, "--seed", str(k), "--out", f"real/real_{k}.csv") for k in range(1, 4)),
        ("identify", "log.csv", *SEEN, "--out", "seen.json"),
        ("identify", "log.csv", "--noise-law", "white", "--out", "ml.json"),
    ):
        code, _, err = run(words, base)
        if code:
            raise RuntimeError(f"{words}: {err}")


def copied(base: pathlib.Path, place: pathlib.Path, case: Case, old: bool) -> pathlib.Path:
    """A fresh folder with the inputs; `old` puts an older file in the place of every output."""
    shutil.rmtree(place, ignore_errors=True)
    shutil.copytree(base, place)
    for name in case.outputs if old else ():
        (place / name).parent.mkdir(exist_ok=True)
        (place / name).write_bytes(OLD)
    return place


def contents(folder: pathlib.Path, case: Case) -> dict[str, bytes]:
    """What the outputs hold that are there."""
    return {name: (folder / name).read_bytes() for name in case.outputs if (folder / name).is_file()}


def wrong(folder: pathlib.Path, base: pathlib.Path, case: Case, whole: dict[str, bytes], printed: str) -> list[str]:
    """What is not as it should be: a half-written file, one that was reported and is not there, one that nobody asked
    for, an input that changed."""
    found, faults = contents(folder, case), []
    for name, content in found.items():
        if content not in (OLD, whole[name]) and not (case.changing and _parses(content)):
            faults.append(f"{name} is half-written")
    reported = {line.removeprefix("wrote ") for line in printed.split("\n")[:-1] if line.startswith("wrote ")}
    faults += [f"{name} was reported and is not there" for name in reported if found.get(name, OLD) == OLD]
    inputs = {str(path.relative_to(base)) for path in base.rglob("*") if path.is_file()}
    faults += [f"{name} changed" for name in inputs if (folder / name).read_bytes() != (base / name).read_bytes()]
    files = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
    hidden = {str(path.relative_to(folder)) for path in left_over(folder)}
    return faults + [f"{name} is there unasked" for name in sorted(files - inputs - hidden - set(case.outputs))]


def left_over(folder: pathlib.Path) -> list[pathlib.Path]:
    """Hidden files and folders of writers that died."""
    return [path for pattern in PARTS for path in folder.rglob(pattern)]


def _parses(content: bytes) -> bool:
    try:
        return bool(json.loads(content))
    except ValueError:
        return False

"""The same command again: equal to the bit; with other threads or devices: equal to the tenth digit."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator

import numpy as np
import pytest

SIMULATE = ("simulate", "published", "--excitation", "multilevel", "--samples", "240", "--hold", "5")
COMMANDS = {
    "log.csv": (*SIMULATE, "--noise", "5e-4,3e-3", "--out", "log.csv"),
    "model.json": ("identify", "log.csv", "--method", "key-term-least-squares", "--out", "model.json"),
}
MACHINES = {
    "again": {},
    "one thread": {"XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false"},
    "one core": {"cores": 1},
    "four devices": {"XLA_FLAGS": "--xla_force_host_platform_device_count=4"},
}
ONE_CORE = """
import os
os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
from jaxident.cli.main import run
run()
"""
DIGITS = 1e-10


def made(folder, machine: dict) -> dict[str, bytes]:
    """What the commands write on a machine."""
    folder.mkdir()
    program = ["-c", ONE_CORE] if machine == {"cores": 1} else ["-m", "jaxident"]
    own = {} if machine == {"cores": 1} else machine
    for words in COMMANDS.values():
        subprocess.run([sys.executable, *program, *words], cwd=folder, env=os.environ | own, check=True,
                       capture_output=True)  # fmt: skip
    return {name: (folder / name).read_bytes() for name in COMMANDS}


def numbers(value) -> Iterator[float]:
    """Every number in a JSON value."""
    if isinstance(value, dict | list):
        for part in value.values() if isinstance(value, dict) else value:
            yield from numbers(part)
    elif isinstance(value, int | float):
        yield float(value)


def figures(name: str, content: bytes) -> np.ndarray:
    if name.endswith(".json"):
        return np.array(list(numbers(json.loads(content))))
    return np.genfromtxt(content.decode().splitlines(), delimiter=",", skip_header=1).ravel()


@pytest.fixture(scope="module")
def plain(tmp_path_factory) -> dict[str, bytes]:
    """What the commands write here."""
    return made(tmp_path_factory.mktemp("plain") / "here", {})


@pytest.mark.slow
@pytest.mark.parametrize("machine", MACHINES)
def test_the_same_command_on(machine, plain, tmp_path):
    other = made(tmp_path / "other", MACHINES[machine])
    for name in COMMANDS:
        if machine == "again":
            assert other[name] == plain[name]
        one, two = figures(name, plain[name]), figures(name, other[name])
        np.testing.assert_allclose(two, one, rtol=DIGITS, atol=DIGITS * np.nanmax(np.abs(one)))

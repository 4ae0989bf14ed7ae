"""The program, run as a user runs it."""

import subprocess
import sys


def jaxident(*words, cwd=None, stdin=None):
    return subprocess.run(
        [sys.executable, "-m", "jaxident", *map(str, words)],
        capture_output=True, text=True, cwd=cwd, input=stdin, check=False, timeout=300,
    )  # fmt: skip


def refused(result, *words):
    """Exit code 2 and one line on stderr that holds the words."""
    assert result.returncode == 2, result
    assert result.stdout == ""
    assert len(result.stderr.splitlines()) == 1, result.stderr
    for word in words:
        assert word in result.stderr

"""The last section of a page: what made it, from which files, with which versions."""

import shlex
from collections.abc import Sequence

from jaxident.origin import Origin
from jaxident.report.page import Code, Section, Table

DIGITS = 16
"""Of a checksum, shown: enough to tell files apart."""
LETTERS = 76
"""In a line of a command: what the page's column holds."""


def origin_section(made: Origin | None) -> list[Section]:
    """The command, the checksums of what it read, and the versions; no section for a page that no command wrote."""
    if made is None:
        return []
    rows = [(one.option, one.name, one.sha256[:DIGITS] if one.sha256 else "a pipe: unknown") for one in made.inputs]
    told = ", ".join(f"{name} {found}" for name, found in made.versions)
    command = Code(_wrapped(["jaxident", *made.command]), f"Files are named without their folders. {told}.")
    table = Table(("read as", "file", "SHA-256"), rows, f"The first {DIGITS} of 64 digits; the JSON output has all.")
    return [Section("What made this page", [command, *([table] if rows else [])], folded=True)]


def _wrapped(words: Sequence[str]) -> str:
    """A command on lines that a page is wide enough for, as a shell takes it."""
    lines = [""]
    for word in map(shlex.quote, words):
        if lines[-1] and len(lines[-1]) + 1 + len(word) > LETTERS:
            lines[-1] += " \\"
            lines.append("   ")
        lines[-1] = f"{lines[-1]} {word}" if lines[-1] else word
    return "\n".join(lines)

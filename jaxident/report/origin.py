"""The last section of a page: what made it, from which files, with which versions."""

import shlex

from jaxident.origin import Origin
from jaxident.report.page import Code, Section, Table


def origin_section(made: Origin | None) -> list[Section]:
    """The command, the checksums of what it read, and the versions; no section for a page that no command wrote."""
    if made is None:
        return []
    rows = [(one.option, one.name, one.sha256 or "a pipe: unknown") for one in made.inputs]
    told = ", ".join(f"{name} {found}" for name, found in made.versions)
    command = Code(shlex.join(["jaxident", *made.command]), f"Files are named without their folders. {told}.")
    return [Section("What made this page", [command, *([Table(("read as", "file", "SHA-256"), rows)] if rows else [])])]

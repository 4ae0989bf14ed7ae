"""What a result was made from: the command, the checksums of its inputs, the versions, the seed.

Nothing here says when or where: no date, no folder, no name of a machine. So the same inputs, seed and versions give
the same bytes, whoever makes them, and a result that is passed on tells nothing of the computer that made it.
"""

import platform
from importlib.metadata import version
from typing import NamedTuple

PACKAGES = ("jaxident", "jax", "jaxlib", "optimistix", "numpy")
"""Packages on which the last digits of a result depend."""


class Input(NamedTuple):
    """A file or folder that a command read. option: where it stood on the command line, as `--model`, or `LOG` for an
    argument. name: without its folder. sha256: of its content in hexadecimal; None for a pipe, which is gone."""

    option: str
    name: str
    sha256: str | None


class Origin(NamedTuple):
    """One output of one command. command: its words, what is the default left out, inputs by their names, and no word
    on where the outputs go. output: which of the command's outputs this is, as `--out` or `diagnosis.json`. versions:
    pairs of package and version. seed: None for a command that draws nothing."""

    command: tuple[str, ...]
    output: str
    inputs: tuple[Input, ...]
    versions: tuple[tuple[str, str], ...]
    seed: int | None


def versions() -> dict[str, str]:
    """Versions of the packages in PACKAGES and of Python."""
    return {name: version(name) for name in PACKAGES} | {"python": platform.python_version()}

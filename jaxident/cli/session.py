"""What every command sets up and shares: double precision, the compilation cache, JSON results, and tables."""

import json
import os
import pathlib
from typing import Any

import click

from jaxident.files.atomic import write_text

json_option = click.option("--json", "json_file", metavar="FILE", help="Also write the result here, for programs.")
seed_option = click.option("--seed", default=0, show_default=True, help="Makes every random result repeatable.")


def start_jax() -> None:
    """Double precision, and compiled code kept between runs (JAXIDENT_CACHE moves it; set but empty turns it off)."""
    import jax

    jax.config.update("jax_enable_x64", True)
    folder = os.environ.get("JAXIDENT_CACHE")
    if folder is None:
        home = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
        folder = os.path.join(home, "jaxident")
    if folder and _usable(folder):
        jax.config.update("jax_compilation_cache_dir", folder)
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.2)
        jax.config.update("jax_persistent_cache_min_entry_size_bytes", 0)


def _usable(folder: str) -> bool:
    try:
        pathlib.Path(folder).mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)


def write_json(content: dict[str, Any], path: str | None) -> None:
    """The result as JSON, whole or not at all; nothing without a path."""
    if path:
        write_text(path, json.dumps(content, indent=2, allow_nan=False) + "\n")
        wrote(path)


def wrote(path: str | os.PathLike) -> None:
    """Say what was written."""
    click.echo(f"wrote {path}")


def table(rows: list[tuple[str, ...]]) -> str:
    """Rows of text in columns: the first aligned left, the rest right; the first row is the header."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    lines = [
        "  ".join([row[0].ljust(widths[0]), *(cell.rjust(w) for cell, w in zip(row[1:], widths[1:], strict=True))])
        for row in rows
    ]
    return "\n".join([lines[0], "-" * len(lines[0]), *lines[1:]])

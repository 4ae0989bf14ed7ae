"""What the commands share: options, JSON results, tables."""

import json
import math
import os
from typing import Any

import click

from jaxident.files.atomic import check_target, write_text

MOST_ROWS = 10_000_000
"""Rows, samples or levels that an option may ask for: a day at 100 Hz."""
MOST_SEEDS = 2**63


class Number(click.FloatRange):
    """A finite number, in a range where one is given."""

    def convert(self, value, param, ctx):
        """The number; what is infinite or no number is refused."""
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value!r} is not a finite number", param, ctx)
        return number

    def _describe_range(self):
        """The range in --help: nothing where there is none, for which click writes `x<=None`."""
        return "" if self.min is None and self.max is None else super()._describe_range()


above_zero = Number(0, min_open=True)
not_negative = Number(0)
rows_option = click.IntRange(1, MOST_ROWS)
json_option = click.option("--json", "json_file", metavar="FILE", help="Also write the result here, for programs.")


class ColumnsOption(click.ParamType):
    """NAME=COLUMN[:UNIT],...: columns of a file that have other names or units than a log's."""

    name = "NAME=COLUMN:UNIT,..."

    def convert(self, value, param, ctx):
        """The columns by their names in a log."""
        from jaxident.columns import parse_columns

        return value if isinstance(value, dict) else parse_columns(value)


columns_option = click.option(
    "--columns", type=ColumnsOption(), default="", help="Columns with other names or units, as in "
    "t=time_ms:ms,x=X:mm,theta=yaw:deg; u_r=u_l,u_l=u_r swaps the wheels, y=y:-1 turns a sign.")  # fmt: skip


seed_option = click.option(
    "--seed",
    type=click.IntRange(0, MOST_SEEDS - 1),
    default=0,
    show_default=True,
    help="Makes every random result repeatable.",
)


class EffectOption(click.ParamType):
    """NAME:key=value,...: an effect of the catalogue and its parameters."""

    name = "NAME:key=value,..."

    def convert(self, value, param, ctx):
        """The name and a dict of numbers; a parameter that is not given keeps its neutral value."""
        name, _, listed = value.partition(":")
        parameters = {}
        for part in filter(None, listed.split(",")):
            key, equals, number = part.partition("=")
            try:
                parameters[key.strip()] = float(number)
                equals = equals if math.isfinite(float(number)) else ""
            except ValueError:
                equals = ""
            if not equals:
                self.fail(f"{value!r}: {part!r} is not key=value with a number, as in delay=0.05", param, ctx)
        if not parameters:
            self.fail(f"{value!r} has no parameter; an effect is given as in transport_delay:delay=0.05", param, ctx)
        return name.strip(), parameters


effect_option = click.option(
    "--effect", "effects", type=EffectOption(), multiple=True, help="An effect to add (repeatable)."
)


def check_outputs(*paths: str | None) -> None:
    """InputError unless each of these files can be written: told before the work, not after it. None is no file."""
    for path in paths:
        if path is not None:
            check_target(path)


def write_json(content: Any, path: str | None) -> None:
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

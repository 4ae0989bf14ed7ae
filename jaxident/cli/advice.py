"""What commands say of a log that looks wrong: warnings, with the options that mend the user's own files."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from shlex import quote

import click

OFFSET_ADVICE = re.compile(r"jaxident convert --log LOG --pose-offset (\S+) --out NEW")
"""As `suspicions` words it."""
IN_SPEEDS = {
    "--columns u_r=u_l,u_l=u_r": "--columns w=w:-1",
    "--columns u_r=u_r:-1,u_l=u_l:-1": "--columns v=v:-1,w=w:-1",
    "--columns u_r=u_l:-1,u_l=u_r:-1": "--columns v=v:-1",
}
"""What mends commands of wheels, in terms of the speeds that they were made from."""


def warn(lines, columns=None, whole=True) -> None:
    """Each line as a warning on stderr, its options those for the user's file; see `for_file`."""
    for line in lines:
        click.echo(f"warning: {for_file(line, columns or {}, whole)}", err=True)


@contextmanager
def advising(columns, whole=True) -> Iterator[None]:
    """Errors about a log from within tell the options for the user's file; see `for_file`."""
    from jaxident.errors import InputError

    try:
        yield
    except InputError as error:
        raise InputError(for_file(str(error), columns, whole)) from error


def for_file(line: str, columns, whole: bool) -> str:
    """The line with options for a file that is read by `columns`: all of these as they are to be, or without `whole`
    those alone that change."""
    from jaxident.columns import after, columns_text, parse_columns

    def option(told: re.Match) -> str:
        change = parse_columns(told[2])
        made = after(columns, change)
        return told[1] + quote(columns_text({name: made[name] for name in made if whole or name in change}))

    line = re.sub(r"(--(?:\w+-)?columns )([^`]*)(?=`)", option, line)
    log = "convert --log LOG"
    return line.replace(log, f"{log} --columns {quote(columns_text(columns))}") if columns and whole else line


def with_offset(line: str, offset: float, finished: bool) -> str:
    """A line about clocks that differ with the offset for this call: what is left and what was given already."""
    found = OFFSET_ADVICE.search(line)
    if not found:
        return line
    option = f"--pose-offset {float(found[1]) + offset:.3g}"
    return line.replace(found[0], f"jaxident convert {f'--log LOG {option} --out NEW' if finished else option}")


def for_speeds(lines):
    """The lines, their options those of commands in v,w; a single wheel that is reversed has none."""
    for wheels, speeds in IN_SPEEDS.items():
        lines = [line.replace(f"`{wheels}`", f"`{speeds}`") for line in lines]
    return lines

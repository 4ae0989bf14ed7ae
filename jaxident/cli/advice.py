"""What commands say of a log that looks wrong: warnings, with the options that mend the user's own files."""

import re

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
    """Each line as a warning on stderr. Its `--columns` become the option for the user's file, which is read by
    `columns`: all of them, or without `whole` those alone that change."""
    from jaxident.columns import columns_text

    log = f"convert --log LOG --columns {columns_text(columns)}" if columns and whole else "convert --log LOG"
    for line in lines:
        told = re.sub(r"--columns ([^`]*)(?=`)", lambda option: _for_file(option[1], columns or {}, whole), line)
        click.echo(f"warning: {told.replace('convert --log LOG', log)}", err=True)


def _for_file(option: str, columns, whole: bool) -> str:
    from jaxident.columns import after, columns_text, parse_columns

    change = parse_columns(option)
    made = after(columns, change)
    return "--columns " + columns_text({name: made[name] for name in made if whole or name in change})


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

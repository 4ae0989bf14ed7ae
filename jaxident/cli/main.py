"""The program: finds the command, and turns every way of ending badly into one line and an exit code."""

import contextlib
import importlib
import io
import os
import sys
import warnings

import click

from jaxident.cli.output import Lasting

COMMANDS = {
    "reproduce": "Repeat the paper's experiment beside its published table.",
    "example": "Write small example logs of a simulated robot.",
    "simulate": "Simulate logs of a model.",
    "effects": "Print the catalogue of what real robots do beyond the model.",
    "convert": "Make one log of commands and poses, or mend a log.",
    "identify": "Find the model behind one or several logs.",
    "motors": "Find the model of the motors by wheel speeds alone.",
    "predict": "Predict the poses of a log by a model.",
    "diagnose": "Find the sim-to-real gap, which effects cause it, and how far it shrinks.",
    "rerun": "Make a result again from what it says of itself, and compare.",
    "export": "Write a model for a simulator, a controller or a program.",
    "plan": "Design the next run: the one that best tells two effects apart.",
    "sweep": "Run a Monte-Carlo study over seeds, inputs, noise, robots and estimators.",
    "bench": "Measure how fast this machine is.",
}


LONGEST_LINE = 1200
"""Characters of a message: the catalogue's names, which some of them list, take 700."""


class LazyGroup(click.Group):
    """Commands by name alone: nothing heavy is imported before one of them runs."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """All command names, in the order of COMMANDS."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command, its module imported now; None for an unknown name."""
        if cmd_name not in COMMANDS:
            return None
        return importlib.import_module(f"jaxident.cli.{cmd_name}").command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The list of commands in --help, without importing any."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.command(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="jaxident", message="%(prog)s %(version)s")
def program() -> None:
    """Find the model of a differential-drive robot from motor commands and camera poses, and what the model misses.

    Begin with `jaxident example`, then `jaxident identify example`.
    """


def run() -> None:
    """Entry point of `jaxident` and `python -m jaxident`: exit 0 done, 2 wrong use or bad input, 1 the work failed."""
    # two threads make NumPy's small matrices five times slower on a busy machine; read once, when NumPy is loaded
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    warnings.showwarning = _show_warning
    for stream in (sys.stdout, sys.stderr):  # a file's name may be no text: what cannot be printed is written out
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        with contextlib.redirect_stdout(Lasting(sys.stdout)):
            code = program.main(prog_name="jaxident", standalone_mode=False)
            sys.stdout.flush()
    except BaseException as error:
        code = _explain(error)
    sys.exit(code if isinstance(code, int) else 0)


def _show_warning(message: Warning | str, category: type[Warning], *_, **__) -> None:
    """Print a warning on one line; what a library tells its developers about its future is nothing for users."""
    if not issubclass(category, DeprecationWarning | PendingDeprecationWarning | FutureWarning):
        print(f"warning: {one_line(str(message))}", file=sys.stderr)


def _explain(error: BaseException) -> int:
    """Print one line on stderr for what ended the program, and return the exit code."""
    from jaxident.errors import InputError, WorkError

    if isinstance(error, SystemExit | click.exceptions.Exit):
        return int(getattr(error, "exit_code", getattr(error, "code", 0)) or 0)
    if os.environ.get("JAXIDENT_TRACEBACK"):
        raise error
    if isinstance(error, KeyboardInterrupt | click.Abort):
        return _say("stopped", 130)
    if isinstance(error, click.UsageError):
        return _say(f"{error.format_message()} (see `{_where(error)} --help`)", 2)
    if isinstance(error, InputError | click.ClickException):
        return _say(str(error.format_message() if isinstance(error, click.ClickException) else error), 2)
    if isinstance(error, WorkError):
        return _say(str(error), 1)
    if isinstance(error, MemoryError) or "RESOURCE_EXHAUSTED" in str(error):  # the latter is the compiler's word
        return _say("out of memory", 1)
    return _say(f"{type(error).__name__}: {error} (JAXIDENT_TRACEBACK=1 shows where)", 1)


def _where(error: click.UsageError) -> str:
    return error.ctx.command_path if error.ctx else "jaxident"


def _say(line: str, code: int) -> int:
    print(f"jaxident: {one_line(line)}", file=sys.stderr)
    return code


def one_line(text: str) -> str:
    """A text on one line, without its middle where it is long; what a terminal would obey is written out instead."""
    line = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in " ".join(text.split()))
    return line if len(line) <= LONGEST_LINE else f"{line[: LONGEST_LINE // 2]} ... {line[-LONGEST_LINE // 2 :]}"

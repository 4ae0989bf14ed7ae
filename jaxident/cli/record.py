"""The command that runs, as the origin of what it writes; and such an origin as a command to run again.

Only words that click has checked, and the checksums of the files that were read, make an origin.
"""

import os
from collections.abc import Iterator, Sequence
from typing import Any

import click

from jaxident.cli.session import wrote

READ = ("logs", "log", "sim", "model", "inputs", "commands", "poses", "wheels", "bag", "study", "diagnosis")
"""Names of the parameters that stand for files or folders which are read."""
WRITTEN = ("out", "json_file", "report")
"""Names of those that stand for outputs: they are in no origin, or the same result in another folder would differ."""
UNTOLD = (*WRITTEN, "scheduler")
"""What no origin tells: outputs, and who computes, which changes no bit and may name a machine."""
WORDS_KEY = "jaxident.words"


class Recorded(click.Command):
    """A command that keeps the words which it was called with, so that `origin` can tell them."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """As every command, and the words of each parameter into the context."""
        ctx.meta[WORDS_KEY] = words_of(self, ctx, args)
        return super().parse_args(ctx, args)


def words_of(command: click.Command, ctx: click.Context, args: Sequence[str]) -> dict[str, list[str]]:
    """The words that each parameter was given, by its name; UsageError as click has it. A flag's word is empty."""
    given, left, _ = command.make_parser(ctx).parse_args(list(args))
    if left and not ctx.resilient_parsing:
        raise click.UsageError(f"Got unexpected extra argument ({left[0]})", ctx)
    return {name: list(_words(value)) for name, value in given.items() if isinstance(name, str)}


def _words(value: Any) -> Iterator[str]:
    if isinstance(value, list | tuple):
        for one in value:
            yield from _words(one)
    elif isinstance(value, str):
        yield value
    elif value is True:
        yield ""


def origin(output: str, **read: Sequence[str]) -> Any:
    """The `Origin` of an output of the command that runs. read: the files that a parameter stood for, where they are
    others than its words, as the logs of a folder."""
    from jaxident.files.origins import checksum
    from jaxident.origin import Input, Origin, versions

    ctx = click.get_current_context()
    told, inputs = [str(ctx.command.name)], []
    for parameter in ctx.command.params:
        name = str(parameter.name)
        words = list(map(str, read[name])) if name in read else ctx.meta[WORDS_KEY].get(name, [])
        if name in UNTOLD or not (words and (name in read or _differs(ctx, parameter))):
            continue
        for word in words:
            known = name in READ and (word == "-" or os.path.exists(word))
            short = os.path.basename(os.path.normpath(word)) if known else word
            told.append(spelled(parameter, short))
            if known:
                inputs.append(Input(place_of(parameter), short, None if word == "-" else checksum(word)))
    return Origin(tuple(told), output, tuple(inputs), tuple(versions().items()), ctx.params.get("seed"))


def _differs(ctx: click.Context, parameter: click.Parameter) -> bool:
    """Whether a parameter has another value than where it is left out."""
    default = parameter.get_default(ctx)
    usual = parameter.type_cast_value(ctx, default) if isinstance(default, str | float | int) else None
    return bool(ctx.params.get(str(parameter.name)) != usual)


def place_of(parameter: click.Parameter) -> str:
    """What an input's place is called: the option, or the name of an argument without dots."""
    if isinstance(parameter, click.Option):
        return parameter.opts[0]
    return (parameter.metavar or str(parameter.name).upper()).strip(".")


def spelled(parameter: click.Parameter, word: str) -> str:
    """A word of a parameter as one word of the command line."""
    if not isinstance(parameter, click.Option):
        return word
    return f"{parameter.opts[0]}={word}" if word else parameter.opts[0]


def tell_origin(path: str, made: Any) -> list[str]:
    """Write the origin of an output, which is no JSON, into the file beside it, and say so; returns its path, nothing
    for a pipe, which has none."""
    from jaxident.files.origins import write_beside

    written = write_beside(path, made)
    if written is None:
        return []
    wrote(written)
    return [str(written)]


def with_provenance(content: dict[str, Any], made: Any, output: str = "--json") -> dict[str, Any]:
    """The content of a JSON result and the origin of it, as the key `provenance`."""
    from jaxident.files.origins import origin_to_dict

    return content | {"provenance": origin_to_dict(made._replace(output=output))}

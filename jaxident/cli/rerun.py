"""`jaxident rerun`.

What the file says is data from strangers: it is never given to a shell, names of files in it have no folders, it must
name a command of this program with options that the command takes, and it cannot say where outputs go.
"""

import contextlib
import importlib
import io
import os
import pathlib
import shlex
import tempfile
from collections.abc import Iterator

import click

from jaxident.cli.main import one_line
from jaxident.cli.record import READ, WRITTEN, place_of, spelled, words_of
from jaxident.cli.session import check_outputs, json_option, write_json, wrote
from jaxident.errors import InputError, WorkError

REPEATABLE = {
    "identify": ("--out", "--json"),
    "motors": ("--out", "--json"),
    "predict": ("--out", "--json"),
    "plan": ("--out", "--json"),
    "simulate": ("--out",),
    "convert": ("--out",),
    "export": ("--out",),
    "diagnose": ("diagnosis.json", "nominal_model.json", "corrected_model.json"),
    "example": (".answer.json",),
    "reproduce": ("table.json",),
}
"""Commands that are run again, and which of their outputs are compared."""
LISTED = 20
"""Values that differ which the terminal shows, the largest differences first."""


@click.command("rerun")
@click.argument("file", metavar="FILE")
@click.option("--data", "folders", multiple=True, metavar="FOLDER", help="Where the inputs lie now (repeatable). "
              "They are also looked for in this folder, beside FILE, in the folders there, and one above.")  # fmt: skip
@click.option("--out", metavar="DIR", help="Keep the new outputs in this folder; without it they are only compared.")
@json_option
def command(file, folders, out, json_file):
    """Make FILE again from what it says of itself, and compare.

    FILE is a diagnosis.json, a model, a result of --json, predictions, a log or an export. The inputs must not have
    changed: their SHA-256 is checked. The exit code is 0 if every value is the same, and 1 if not.

    Example: jaxident rerun diagnosis/diagnosis.json --data logs
    """
    from jaxident.files.compare import compare
    from jaxident.files.origins import read_origin
    from jaxident.origin import versions

    for folder in folders:
        if not os.path.isdir(folder):
            raise InputError(f"--data {folder}: is no folder")
    path, origin = read_origin(file)
    check_outputs(json_file)
    words = _words(path, origin, [*folders, *_near(path)])
    with _folder(out, path) as place:
        target, outputs = _outputs(path, origin, place)
        click.echo(one_line(shlex.join(["jaxident", *origin.command])))
        _run(origin.command[0], [*outputs, *words])
        found = compare(path, target)
    then, now = dict(origin.versions), versions()
    other = [f"{name} {then.get(name, 'unknown')} then, {now[name]} now" for name in now if then.get(name) != now[name]]
    for line in _told(found, other):
        click.echo(one_line(line))
    if out:
        wrote(target)
    told = {"file": path.name, "command": list(origin.command), "same": found.same, "values": found.values}
    write_json(told | {"differences": [one._asdict() for one in found.differences], "versions": other}, json_file)
    if found.differences:
        raise WorkError(f"{path}: {len(found.differences)} of {found.values} values are not the same again")


def _words(path, origin, folders) -> list[str]:
    """The words to run, inputs as the paths where they were found: all of them checked. InputError names what is
    wrong."""
    where = f"{path}: provenance.command"
    name = origin.command[0] if origin.command else ""
    if origin.output not in REPEATABLE.get(name, ()):
        raise InputError(f"{where}: {origin.output!r} of {name!r} is not made again; it can be one of "
                         f"{', '.join(REPEATABLE)}")  # fmt: skip
    known = _command(name)
    try:
        given = words_of(known, click.Context(known), origin.command[1:])
    except click.UsageError as error:
        raise InputError(f"{where}: {error.format_message()}") from None
    options: list[str] = []
    arguments: list[str] = []
    for parameter in known.params:
        words = given.pop(str(parameter.name), [])
        if parameter.name in WRITTEN and words:
            raise InputError(f"{where}: names an output, {words[0]!r}; --out of this command says where outputs go")
        if parameter.name in READ:
            words = _found(where, parameter, words, origin.inputs, folders)
        (options if isinstance(parameter, click.Option) else arguments).extend(spelled(parameter, w) for w in words)
    if given:
        raise InputError(f"{where}: {name} has no option {next(iter(given))!r}")
    return [*options, "--", *arguments]


def _found(where, parameter, words, inputs, folders) -> list[str]:
    """The paths of a parameter's inputs; a shipped robot stays its name."""
    from jaxident.files.models import SHIPPED
    from jaxident.files.origins import find_input

    left = [one for one in inputs if one.option == place_of(parameter)]
    paths = []
    for word in words:
        if left and left[0].name == word:
            paths.append(find_input(left.pop(0), folders))
        elif parameter.name == "model" and word in SHIPPED and not os.path.exists(word):
            paths.append(word)
        else:
            raise InputError(f"{where}: {word!r} is not the next of its inputs")
    if left:
        raise InputError(f"{where}: does not name its input {left[0].name!r}")
    return paths


def _near(path: pathlib.Path) -> list[pathlib.Path]:
    """Where inputs are looked for: here, in the file's folder, the one above, and the folders in the first two."""
    here, own = pathlib.Path(), path.parent
    inside = [entry for folder in (here, own) for entry in sorted(folder.iterdir()) if entry.is_dir()]
    return list(dict.fromkeys([here, own, own / os.pardir, *inside]))


@contextlib.contextmanager
def _folder(out: str | None, path: pathlib.Path) -> Iterator[pathlib.Path]:
    """The folder of the new outputs: the user's, or one that vanishes."""
    from jaxident.files.atomic import make_folder

    if out is None:
        with tempfile.TemporaryDirectory(prefix="jaxident-") as folder:
            yield pathlib.Path(folder)
        return
    make_folder(out)
    if os.path.samefile(out, path.parent):
        raise InputError(f"--out {out}: is the folder of {path.name}; give another one, so that both can be compared")
    yield pathlib.Path(out)


def _outputs(path: pathlib.Path, origin, folder: pathlib.Path) -> tuple[pathlib.Path, list[str]]:
    """The file that is compared with the old one, and the words that say where outputs go."""
    if not origin.output.startswith("--"):
        return folder / origin.output, [f"--out={folder}"]
    target = folder / path.name
    words = [f"{origin.output}={target}"]
    required = any(one.name == "out" and one.required for one in _command(origin.command[0]).params)
    if origin.output != "--out" and required:
        words.append(f"--out={folder / 'out.csv'}")
    return target, words


def _command(name: str) -> click.Command:
    return importlib.import_module(f"jaxident.cli.{name}").command  # one of REPEATABLE


def _run(name: str, words: list[str]) -> None:
    """Run a command in this process; what it prints is not shown, its warnings are."""
    with contextlib.redirect_stdout(io.StringIO()):
        _command(name).main(words, prog_name=f"jaxident {name}", standalone_mode=False)


def _told(found, other: list[str]) -> list[str]:
    """What the terminal says of a comparison."""
    made = [f"made with other versions: {', '.join(other)}"] if other else []
    if found.same:
        return [*made, f"the same to the bit: {found.values} values"]
    if not found.differences:
        return [*made, f"the same in all of {found.values} values"]
    largest = sorted(found.differences, key=lambda one: -one.size)
    lines = [_line(one) for one in largest[:LISTED]]
    more = [f"and {len(largest) - LISTED} more, by less"] if len(largest) > LISTED else []
    return [*made, *lines, *more]


def _line(one) -> str:
    size = f" (by {one.size:.2g} of it)" if one.size < float("inf") else ""
    return f"{one.place}: {one.then} then, {one.now} now{size}"

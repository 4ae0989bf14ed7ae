"""`jaxident export`."""

import click

from jaxident.cli.progress import working
from jaxident.cli.session import check_outputs, json_option, write_json, wrote
from jaxident.start import start_jax

TARGETS = ("mjcf", "gazebo", "isaac", "ros2_control", "robot_localization", "c-header", "python", "table")
UNITS = ("unit", "rad/s", "m/s")
POSITIVE = click.FloatRange(0, min_open=True)


@click.command()
@click.argument("model")
@click.option("--to", "target", required=True, type=click.Choice(TARGETS), help="Simulator, controller or program.")
@click.option("--out", required=True, metavar="PATH", help="The file to write, its wrapper beside it.")
@click.option("--wheel-radius", type=POSITIVE, metavar="M", help="Of the robot's wheels (no path depends on it).")
@click.option("--track", type=POSITIVE, metavar="M", help="Measured on the robot, beside the one at which it moves.")
@click.option("--mass", type=POSITIVE, metavar="KG", help="Of the robot (no path depends on it).")
@click.option("--limit", type=POSITIVE, metavar="UMAX", help="Largest command: gives limits of speed and acceleration.")
@click.option("--command-unit", type=click.Choice(UNITS), default=UNITS[0], show_default=True,
              help="What commands of the logs are: a unit of your own, or speeds of the wheels.")  # fmt: skip
@click.option("--diagnosis", metavar="FILE", help="A diagnosis.json: what effects are worth (default: beside MODEL).")
@json_option
def command(model, target, out, wheel_radius, track, mass, limit, command_unit, diagnosis, json_file):
    """MODEL (a model file or `published`) in the words of a simulator, a controller, or a program.

    Says of each part of the model whether a field carries it, the wrapper around the commands, or neither, and how many
    millimetres 1 s ahead that costs.

    Example: jaxident export diagnosis/corrected_model.json --to mjcf --out robot.xml
    """
    start_jax()
    check_outputs(out, json_file)
    from jaxident.export.export import commands_path, export

    with working("exporting"):
        made = export(model, target, out, wheel_radius=wheel_radius, track=track, mass=mass, limit=limit,
                      command_unit=command_unit, diagnosis=diagnosis)  # fmt: skip
    click.echo(_table([("part", "carried by", "which"), *map(_row, made.parts)]))
    for line in made.assumed:
        click.echo(line)
    files = [out] if made.commands is None else [out, str(commands_path(out))]
    for file in files:
        wrote(file)
    parts = [part._asdict() for part in made.parts]
    write_json({"target": target, "files": files, "assumed": made.assumed, "parts": parts}, json_file)


def _table(rows: list[tuple[str, str, str]]) -> str:
    first, second = (max(len(row[k]) for row in rows) for k in range(2))
    return "\n".join(f"{a:<{first}}  {b:<{second}}  {c}" for a, b, c in rows)


def _row(part) -> tuple[str, str, str]:
    if part.how != "not carried":
        return part.name, part.how, part.where
    stays = part.source if part.gap is None else f"{part.gap:.2g} mm of the gap stay, {part.source}"
    return part.name, part.how, f"{stays}: {part.where}"

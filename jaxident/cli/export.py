"""`jaxident export`."""

import click

from jaxident.cli.record import Recorded, origin, tell_origin, with_provenance
from jaxident.cli.session import check_outputs, json_option, write_json, wrote
from jaxident.progress import working
from jaxident.start import start_jax

TARGETS = ("mjcf", "gazebo", "isaac", "ros2_control", "robot_localization", "c-header", "python", "table")
UNITS = ("unit", "rad/s", "m/s")
POSITIVE = click.FloatRange(0, min_open=True)


@click.command("export", cls=Recorded)
@click.argument("model")
@click.option(
    "--to", "target", required=True, type=click.Choice(TARGETS), help="For which simulator, controller or program."
)
@click.option("--out", required=True, metavar="PATH", help="The file to write. The wrapper is written beside it.")
@click.option("--wheel-radius", type=POSITIVE, metavar="M", help="Radius of the wheels. No path depends on it.")
@click.option("--track", type=POSITIVE, metavar="M", help="Distance between the wheels, measured on the robot.")
@click.option("--mass", type=POSITIVE, metavar="KG", help="Mass of the robot. No path depends on it.")
@click.option(
    "--limit", type=POSITIVE, metavar="UMAX", help="Largest command. Limits of speed and acceleration follow from it."
)
@click.option("--command-unit", type=click.Choice(UNITS), default=UNITS[0], show_default=True,
              help="Unit of the commands in the logs: one of your own, or speeds of the wheels.")  # fmt: skip
@click.option(
    "--diagnosis",
    metavar="FILE",
    help="A diagnosis.json that tells what each effect is worth (default: the one beside MODEL).",
)
@json_option
def command(model, target, out, wheel_radius, track, mass, limit, command_unit, diagnosis, json_file):
    """Write MODEL (a model file or `published`) as input for a simulator, a controller or a program.

    For each part of the model it says who carries it: a field of the target, a wrapper around the commands, or nobody.
    If nobody does, it says how many millimetres that costs 1 s ahead.

    Example: jaxident export diagnosis/corrected_model.json --to mjcf --out robot.xml
    """
    start_jax()
    from jaxident.export.export import commands_path, export
    from jaxident.export.gap import beside
    from jaxident.files.origins import check_beside

    check_outputs(out, json_file)
    check_beside(out)
    diagnosis = diagnosis or beside(model)
    made_from = origin("--out", **({"diagnosis": [str(diagnosis)]} if diagnosis else {}))
    with working("exporting"):
        made = export(model, target, out, wheel_radius=wheel_radius, track=track, mass=mass, limit=limit,
                      command_unit=command_unit, diagnosis=diagnosis)  # fmt: skip
    click.echo(_table([("part", "carried by", "which"), *map(_row, made.parts)]))
    for line in made.assumed:
        click.echo(line)
    files = [out] if made.commands is None else [out, str(commands_path(out))]
    for file in files:
        wrote(file)
    files += tell_origin(out, made_from)
    parts = [part._asdict() for part in made.parts]
    content = {"target": target, "files": files, "assumed": made.assumed, "parts": parts}
    write_json(with_provenance(content, made_from), json_file)


def _table(rows: list[tuple[str, str, str]]) -> str:
    first, second = (max(len(row[k]) for row in rows) for k in range(2))
    return "\n".join(f"{a:<{first}}  {b:<{second}}  {c}" for a, b, c in rows)


def _row(part) -> tuple[str, str, str]:
    if part.how != "not carried":
        return part.name, part.how, part.where
    stays = part.source if part.gap is None else f"{part.gap:.2g} mm of the gap stay, {part.source}"
    return part.name, part.how, f"{stays}: {part.where}"

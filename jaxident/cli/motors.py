"""`jaxident motors`."""

import dataclasses

import click

from jaxident.cli.advice import advising, warn
from jaxident.cli.record import Recorded, origin, with_provenance
from jaxident.cli.session import above_zero, check_outputs, columns_option, json_option, table, write_json, wrote
from jaxident.progress import working
from jaxident.start import start_jax


@click.command("motors", cls=Recorded)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option("--wheel-radius", "radius", type=above_zero, required=True, metavar="R", help="Radius of the wheels [m].")
@click.option("--wheel-track", "track", type=above_zero, required=True, metavar="W",
              help="Distance between the wheels [m].")  # fmt: skip
@columns_option
@click.option("--out", metavar="MODEL", help="The model file to write: a robot that moves as its wheels turn.")
@click.option("--report", metavar="FILE", help="Also write a page (.html) with a picture.")
@json_option
def command(logs, radius, track, columns, out, report, json_file):
    """Find the model of the motors by wheel speeds alone, such as with the wheels in the air. Poses are not read.

    `jaxident diagnose LOGS --model MODEL` then tells what of the robot on the ground is not the motors.

    Example: jaxident motors on_blocks.csv --wheel-radius 0.0325 --wheel-track 0.16 --out motors.json
    """
    start_jax()
    from jaxident.estimation.identify_motors import against, identify_motors
    from jaxident.files.logs import find_logs, read_logs
    from jaxident.files.models import model_to_dict, save_model
    from jaxident.files.origins import with_origin
    from jaxident.report.motors import lines_of, rows_of, write_motors

    check_outputs(out, report, json_file)
    records = read_logs(logs, columns, poses=False)
    with working("identifying"), advising(columns):
        found = identify_motors(records, radius, track)
    warn(against(found), columns)
    made = origin("--out", logs=find_logs(logs))
    model = dataclasses.replace(found.model, provenance=with_origin(found.model.provenance, made))
    found = found._replace(model=model)
    heads = ("parameter", "estimate", "95 % interval", "unit", "this input")
    click.echo(table([heads, *rows_of(found, records)]))
    click.echo("\n".join(lines_of(found)))
    if out:
        save_model(model, out)
        wrote(out)
    if report:
        write_motors(found, records, report)
        wrote(report)
    content = {"model": model_to_dict(model), "delay": found.delay, "delay_deviation": found.delay_deviation,
               "explained": [float(share) for share in found.explained], "rows_each": found.every}  # fmt: skip
    write_json(with_provenance(content, made), json_file)

"""`jaxident identify`."""

import dataclasses

import click

from jaxident.cli.progress import working
from jaxident.cli.session import json_option, table, write_json, wrote
from jaxident.start import start_jax

NOTE = (
    "Intervals take the equation error for white. Camera noise makes it coloured and biases these estimates: "
    "see the README, 'What the paper's method can and cannot do'."
)


@click.command()
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option("--method", type=click.Choice(["paper"]), default="paper", show_default=True)
@click.option(
    "--setup-time", type=click.FloatRange(0, min_open=True), metavar="S", help="Seconds for the start values."
)
@click.option(
    "--forgetting", type=float, default=1.0, show_default=True, metavar="F", help="In (0, 1]; 1 forgets nothing."
)
@click.option("--d-max", type=float, metavar="D", help="Largest dead zone (default: 0.9 of the largest command).")
@click.option(
    "--reading",
    type=click.Choice(["free-run", "one-step"]),
    default="one-step",
    show_default=True,
    help="How the cost of the start values reads the paper's (21).",
)
@click.option("--out", metavar="MODEL", help="The model file to write.")
@json_option
def command(logs, method, setup_time, forgetting, d_max, reading, out, json_file):
    """The model behind one or several logs (files, folders, or `-`), runs in the order given.

    Example: jaxident identify log.csv --method paper --out model.json
    """
    start_jax()
    import jaxident
    from jaxident.estimation.identify import identify
    from jaxident.estimation.verdict import verdicts
    from jaxident.files.logs import read_logs
    from jaxident.files.models import model_to_dict, save_model
    from jaxident.robot.model import Provenance

    records = read_logs(logs)
    settings = {"setup_time": setup_time, "forgetting": forgetting, "d_max": d_max}
    with working("identifying"):
        found = identify(records, method, reading=reading.replace("-", "_"), **settings)
    origin = Provenance(jaxident.__version__, method, tuple(logs))
    model = dataclasses.replace(found.model, provenance=origin)
    rows = verdicts(model, max(float(abs(u).max()) for record in records for u in record.command))
    click.echo(table([("parameter", "estimate", "95 % interval", "this input"), *(row.cells() for row in rows)]))
    click.echo(NOTE)
    if not bool(found.ok):
        click.echo(
            "warning: the batch fit on the setup time did not converge; the recursion started from it all the same",
            err=True,
        )
    if out:
        save_model(model, out)
        wrote(out)
    write_json({"model": model_to_dict(model), "parameters": [row._asdict() for row in rows]}, json_file)

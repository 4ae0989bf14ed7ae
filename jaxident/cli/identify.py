"""`jaxident identify`."""

import dataclasses

import click

from jaxident.cli.progress import working
from jaxident.cli.session import json_option, table, write_json, wrote
from jaxident.start import start_jax

NOTES = {
    "paper": "Intervals take the equation error for white. Camera noise makes it coloured and biases these estimates: "
    "see the README, 'What the paper's method can and cannot do'.",
    "maximum-likelihood": "Intervals hold under the noise law above; all poses were used, start states estimated.",
}


@click.command()
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option(
    "--method", type=click.Choice(["maximum-likelihood", "paper"]), default="maximum-likelihood", show_default=True
)
@click.option(
    "--noise-law",
    type=click.Choice(["white", "ar1", "slip", "slip-ar1", "auto"]),
    default="white",
    show_default=True,
    help="What is random: white camera error, one with a memory, slip of the wheels; auto tries them (minutes).",
)
@click.option(
    "--setup-time", type=click.FloatRange(0, min_open=True), metavar="S", help="Seconds for the start values (paper)."
)
@click.option("--forgetting", type=float, metavar="F", help="In (0, 1]; 1, the default, forgets nothing.")
@click.option("--coupling", is_flag=True, help="Let the two speeds drive each other: two more parameters.")
@click.option("--d-max", type=float, metavar="D", help="Largest dead zone (default: 0.9 of the largest command).")
@click.option(
    "--reading",
    type=click.Choice(["free-run", "one-step"]),
    help="How the cost of the start values reads the paper's (21); one-step by default (paper).",
)
@click.option("--out", metavar="MODEL", help="The model file to write.")
@click.option("--report", metavar="FILE", help="A page (.html): intervals, verdicts, doubts, residuals, pictures.")
@json_option
def command(logs, method, noise_law, setup_time, forgetting, coupling, d_max, reading, out, report, json_file):
    """The model behind one or several logs (files, folders, or `-`), runs in the order given.

    Example: jaxident identify log.csv --out model.json
    """
    start_jax()
    import jaxident
    from jaxident.estimation.identify import identify
    from jaxident.estimation.verdict import verdicts
    from jaxident.files.logs import read_logs
    from jaxident.files.models import model_to_dict, save_model
    from jaxident.robot.model import Provenance

    if report and method == "paper":
        raise click.UsageError("--report needs the method maximum-likelihood")
    records = read_logs(logs)
    settings = {"noise_law": noise_law, "setup_time": setup_time, "forgetting": forgetting, "d_max": d_max}
    settings["coupling"] = coupling
    with working("identifying"):
        found = identify(records, method, reading=reading and reading.replace("-", "_"), **settings)
    origin = Provenance(jaxident.__version__, method, tuple(logs))
    model = dataclasses.replace(found.model, provenance=origin)
    rows = verdicts(model, max(float(abs(u).max()) for record in records for u in record.command))
    _say(found, rows, method)
    if out:
        save_model(model, out)
        wrote(out)
    if report:
        from jaxident.report.identification import write_identification

        for path in write_identification(found._replace(model=model), records, rows, report):
            wrote(path)
    write_json(
        {"model": model_to_dict(model), "parameters": [row._asdict() for row in rows], "suspicions": found.suspicions},
        json_file,
    )


def _say(found, rows, method: str) -> None:
    """Print the parameters, what their intervals mean, and every warning."""
    click.echo(table([("parameter", "estimate", "95 % interval", "this input"), *(row.cells() for row in rows)]))
    click.echo(NOTES[method])
    for line in found.suspicions:
        click.echo(f"warning: {line}", err=True)
    if not bool(found.ok):
        click.echo(
            "warning: the fit did not converge: do not trust these numbers before you have looked at the log",
            err=True,
        )

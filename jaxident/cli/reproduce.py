"""`jaxident reproduce`."""

import os

import click

from jaxident.cli.record import Recorded, origin, with_provenance
from jaxident.cli.session import check_outputs, json_option, seed_option, table, write_json, wrote
from jaxident.progress import working
from jaxident.start import start_jax

TABLE = "table.json"


@click.command("reproduce", cls=Recorded)
@click.option("--out", default="reproduction", show_default=True, metavar="DIR", help="The folder to write.")
@click.option(
    "--seeds",
    type=click.IntRange(2),
    default=200,
    show_default=True,
    help="How many noisy logs are drawn at each noise level.",
)
@seed_option
@json_option
def command(out, seeds, seed, json_file):
    """Repeat the paper's experiment and put the result beside the published table.

    It writes DIR/table.json, the paper's figures 4, 7, 8 and 9, a figure of each estimator's error against camera
    noise, and DIR/index.html with all of them.

    Example: jaxident reproduce --out reproduction
    """
    start_jax()
    from jaxident.files.atomic import make_folder
    from jaxident.files.models import load_model
    from jaxident.report.reproduction import write_reproduction
    from jaxident.study.reproduction import reproduce, table_rows

    check_outputs(json_file)
    make_folder(out)
    check_outputs(os.path.join(out, TABLE), os.path.join(out, "index.html"))
    with working("reproducing the paper's experiment"):
        result = reproduce(load_model("published"), load_model("published-simplified"), seed=seed, seeds=seeds)
        paths = write_reproduction(result, out)  # while the noise study still computes
        rows = table_rows(result)
    click.echo(table([("parameter", "true", "paper", "ours", "standard error"), *map(_cells, rows)]))
    for path in paths:
        wrote(path)
    content = with_provenance({"rows": [row._asdict() for row in rows]}, origin(TABLE), TABLE)
    write_json(content, os.path.join(out, TABLE))
    write_json(content, json_file)


def _cells(row) -> tuple[str, ...]:
    return row.parameter, *(f"{value:.5g}" for value in (row.true, row.paper, row.ours, row.standard_error))

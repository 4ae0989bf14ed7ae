"""`jaxident predict`."""

import click

from jaxident.cli.progress import working
from jaxident.cli.session import json_option, write_json, wrote
from jaxident.start import start_jax


@click.command()
@click.argument("model")
@click.argument("log")
@click.option("--horizon", type=click.IntRange(1), required=True, metavar="N", help="Rows of each free run.")
@click.option("--burn-in", type=click.IntRange(1), default=20, show_default=True, metavar="M", help="Rows before it.")
@click.option("--stride", type=click.IntRange(1), metavar="S", help="Rows between starts (default: the horizon).")
@click.option("--from", "first", type=float, metavar="T", help="Use the rows from this time [s] on.")
@click.option("--to", "last", type=float, metavar="T", help="Use the rows up to this time [s].")
@click.option("--out", required=True, metavar="CSV", help="The predictions to write (.csv or .csv.gz).")
@json_option
def command(model, log, horizon, burn_in, stride, first, last, out, json_file):
    """Free runs of MODEL over LOG, each start state estimated from the rows before it alone.

    Example: jaxident predict model.json log.csv --horizon 100 --out predicted.csv
    """
    start_jax()
    from jaxident.estimation.predict import predict, prediction_error
    from jaxident.files.logs import read_log
    from jaxident.files.models import load_model
    from jaxident.files.predictions import write_prediction
    from jaxident.log import between

    record = between(read_log(log), first, last)
    with working("predicting"):
        prediction = predict(load_model(model), record, horizon, burn_in=burn_in, stride=stride)
    write_prediction(prediction, out)
    summary = prediction_error(prediction, record)
    click.echo(
        f"{summary['starts']} starts, {summary['compared']} of them with a pose after {summary['seconds']:.4g} s"
    )
    if summary["compared"]:
        errors = f"{summary['position_median']:.4g} m and {summary['heading_median']:.4g} rad"
        click.echo(f"error there, median: {errors}")
    wrote(out)
    write_json(summary, json_file)

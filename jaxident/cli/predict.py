"""`jaxident predict`."""

import warnings

import click

from jaxident.cli.record import Recorded, origin, tell_origin, with_provenance
from jaxident.cli.session import Number, check_outputs, columns_option, json_option, rows_option, write_json, wrote
from jaxident.errors import WorkError
from jaxident.progress import working
from jaxident.start import start_jax


@click.command("predict", cls=Recorded)
@click.argument("model")
@click.argument("log")
@click.option(
    "--horizon", type=rows_option, required=True, metavar="N", help="How many rows each prediction runs ahead."
)
@click.option(
    "--burn-in",
    type=rows_option,
    default=20,
    show_default=True,
    metavar="M",
    help="Rows before a start that its state is estimated from.",
)
@click.option("--stride", type=rows_option, metavar="S", help="Rows from one start to the next (default: the horizon).")
@click.option("--from", "first", type=Number(), metavar="T", help="Use the rows from this time [s] on.")
@click.option("--to", "last", type=Number(), metavar="T", help="Use the rows up to this time [s].")
@click.option(
    "--session-time",
    type=Number(),
    metavar="S",
    help="Session time [s] at the first row of LOG that is used, for effects that drift (default: where the model's "
    "own logs have it, or right after them).",
)
@click.option("--out", required=True, metavar="CSV", help="The predictions to write (.csv or .csv.gz).")
@columns_option
@json_option
def command(model, log, horizon, burn_in, stride, first, last, session_time, out, columns, json_file):
    """Let MODEL run ahead over the commands of LOG, from many places.

    Each start state is estimated only from the rows before it.

    Example: jaxident predict model.json log.csv --horizon 100 --out predicted.csv
    """
    start_jax()
    from jaxident.estimation.ahead.session import time_in_session
    from jaxident.estimation.ahead.session_check import new_session
    from jaxident.estimation.predict import predict, prediction_error
    from jaxident.files.logs import read_whole
    from jaxident.files.models import load_model
    from jaxident.files.origins import check_beside
    from jaxident.files.predictions import write_prediction
    from jaxident.log import between

    check_outputs(out, json_file)
    check_beside(out)
    robot, whole = load_model(model), read_whole(log, columns)
    record = between(whole, first, last)
    begin, known = time_in_session(robot, whole, record)
    begin = begin if session_time is None else session_time
    with working("predicting"):
        prediction = predict(robot, record, horizon, burn_in=burn_in, stride=stride, session_time=begin)
        other = None if known or session_time is not None else new_session(robot, record, horizon, burn_in, begin)
    summary = prediction_error(prediction, record) | {"session_time": begin}
    if summary["failed"] == summary["starts"]:
        raise WorkError(f"{model}: none of {summary['starts']} predictions is finite: the model runs away on {log}")
    made = origin("--out")
    write_prediction(prediction, out)
    for line in _told(summary, robot, session_time is not None, known):
        click.echo(line)
    if other is not None:
        warnings.warn(other, stacklevel=1)
    wrote(out)
    tell_origin(out, made)
    write_json(with_provenance(summary, made), json_file)


def _told(summary, robot, given: bool, known: bool) -> list[str]:
    """What the terminal says of predictions."""
    from jaxident.estimation.ahead.session_check import drifts
    from jaxident.report.words import error, plain_text

    lines = [f"{summary['starts']} starts, {summary['compared']} of them with a pose after {summary['seconds']:.4g} s"]
    if summary["compared"]:
        rms, median, expected = (
            plain_text(error((summary[f"position_{kind}"], summary[f"heading_{kind}"])))
            for kind in ("rms", "median", "expected")
        )
        lines.append(f"error there: {rms} root mean square, {median} median; {expected} expected, camera error apart")
    if summary["run_up"]:
        lines.append(f"{summary['run_up']} starts from a run-up of earlier commands: the filter did not converge there")
    if summary["failed"]:
        lines.append(f"{summary['failed']} predictions are not finite and count in no error")
    if drifts(robot):
        where = (
            "as told" if given else "where the model's own logs have it" if known else "right after the model's logs"
        )
        lines.append(f"effects that drift: the log begins at session time {summary['session_time']:.4g} s, {where}")
    return lines

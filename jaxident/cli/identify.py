"""`jaxident identify`."""

import dataclasses

import click

from jaxident.cli.advice import advising, warn
from jaxident.cli.record import Recorded, origin, with_provenance
from jaxident.cli.session import (
    Number,
    above_zero,
    check_outputs,
    columns_option,
    json_option,
    seed_option,
    table,
    write_json,
    wrote,
)
from jaxident.errors import WorkError
from jaxident.progress import working
from jaxident.start import start_jax

MOST_REFITS = 100_000
"""Refits of a bootstrap; more than some thousands move an interval's ends by nothing."""
NOTES = {
    "paper": "Intervals take the equation error for white. Camera noise makes it coloured and biases these estimates. "
    "An interval is the wider where as much noise again, added to the poses, moves its number beyond chance: "
    "see experiments/validation.md, 'Estimates and their intervals'.",
    "instrumental-variables": "Intervals take the filtered equation error for white. Camera noise makes path lengths "
    "longer than the path, which biases what is estimated from them.",
    "key-term-least-squares": "Intervals take the equation error for white. Camera noise makes it coloured and biases "
    "these estimates, as it does the paper's.",
    "maximum-likelihood": "Intervals hold under the noise law above; all poses were used, start states estimated.",
}

BOTH_SENSORS = (
    " Wheel speeds were used as a second sensor: wheel_radius and wheel_track [m], and their noise [rad/s], stand last."
)


@click.command("identify", cls=Recorded)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option(
    "--method",
    type=click.Choice(["maximum-likelihood", "paper", "instrumental-variables", "key-term-least-squares"]),
    default="maximum-likelihood",
    show_default=True,
)
@click.option(
    "--noise-law",
    type=click.Choice(["white", "ar1", "slip", "slip-ar1", "auto"]),
    default="auto",
    show_default=True,
    help="What is random: white camera error, camera error with a memory (ar1), slip of the wheels, or both. auto "
    "begins with white and tries the others if its residuals are not white.",
)
@click.option(
    "--setup-time", type=above_zero, metavar="S", help="Method paper: seconds from which the start values come."
)
@click.option(
    "--forgetting", type=Number(), metavar="F", help="Method paper: in (0, 1]. 1, the default, forgets nothing."
)
@click.option("--coupling", is_flag=True, help="Let speed and turn rate act on each other: two more parameters.")
@click.option("--d-max", type=Number(), metavar="D", help="Largest dead zone (default: 0.9 of the largest command).")
@click.option(
    "--reading",
    type=click.Choice(["free-run", "one-step"]),
    help="Method paper: how to read equation (21), the cost of the start values (default: one-step).",
)
@click.option(
    "--bootstrap",
    "count",
    type=click.IntRange(1, MOST_REFITS),
    metavar="N",
    help="Also give intervals from N refits to resampled data. 200 are enough.",
)
@click.option(
    "--resample",
    type=click.Choice(["blocks", "runs"]),
    default="blocks",
    show_default=True,
    help="What --bootstrap draws: blocks of residuals, or whole runs. The latter needs many runs.",
)
@columns_option
@seed_option
@click.option("--out", metavar="MODEL", help="The model file to write.")
@click.option(
    "--report", metavar="FILE", help="Also write a page (.html) with intervals, warnings, residuals and pictures."
)
@json_option
def command(logs, columns, method, reading, count, resample, seed, out, report, json_file, **settings):
    """Find the model behind logs: files, folders, or `-` for standard input. Runs are taken in the order given.

    Example: jaxident identify log.csv --out model.json
    """
    start_jax()
    from jaxident.estimation.ahead.session import with_session
    from jaxident.estimation.identify import identify
    from jaxident.estimation.uncertainty.verdict import verdicts
    from jaxident.files.logs import find_logs, read_logs
    from jaxident.files.models import model_to_dict, save_model
    from jaxident.files.origins import with_origin
    from jaxident.log import join

    for option in [name for name, value in (("--report", report), ("--bootstrap", count)) if value is not None]:
        if method != "maximum-likelihood":
            raise click.UsageError(f"{option} needs the method maximum-likelihood")
    check_outputs(out, report, json_file)
    records = read_logs(logs, columns)
    with working("identifying"), advising(columns):
        found = identify(records, method, reading=reading and reading.replace("-", "_"), **settings)
    _warn(found, columns)
    again = count and _resample(found, records, count, resample, seed, settings["d_max"])
    made = origin("--out", logs=find_logs(logs))
    told = with_origin(with_session(found.model.provenance._replace(method=method), join(records)), made)
    model = dataclasses.replace(found.model, provenance=told)
    rows = verdicts(model, max(float(abs(u).max()) for record in records for u in record.command))
    _say(found, rows, method, again)
    if out:
        save_model(model, out)
        wrote(out)
    if report:
        from jaxident.report.identification import write_identification

        for path in write_identification(found._replace(model=model), records, rows, report, again):
            wrote(path)
    result = {"parameters": [row._asdict() for row in rows], "suspicions": found.suspicions}
    content = {"model": model_to_dict(model)} | result | ({"bootstrap": _as_dict(again)} if again else {})
    write_json(with_provenance(content, made), json_file)


def _warn(found, columns) -> None:
    """Print what speaks against an identification; WorkError where it did not converge."""
    warn(found.suspicions, columns)
    if not bool(found.ok):
        raise WorkError(f"the fit did not converge, and nothing is written: {_failure(found)}")


def _failure(found) -> str:
    """Why a fit did not converge, and what to try."""
    import numpy as np

    if found.fit is None:
        return "the log has no more usable samples than the model has unknowns; record longer runs"
    measured = int(np.isfinite(np.asarray(found.residuals.x)).sum())
    unknowns = len(found.model.parameter_order) + np.size(found.fit.starts)
    if 3 * measured <= unknowns:
        return f"{measured} poses do not determine {unknowns} unknowns; record longer runs"
    return (
        f"its search stopped after {int(found.fit.steps)} steps without a minimum; look at the log, or try another "
        "--noise-law: white is the simplest"
    )


def _resample(found, records, count, resample, seed, d_max):
    """The bootstrap of a fit."""
    import jax

    from jaxident.estimation.bootstrap import bootstrap

    with working(f"{count} refits"):
        return bootstrap(jax.random.key(seed), found, records, count=count, resample=resample, d_max=d_max)


def _as_dict(again) -> dict:
    """A bootstrap for programs."""
    intervals = {name: list(map(float, ends)) for name, ends in zip(again.order, again.interval, strict=True)}
    return {
        "resample": again.resample, "block": again.block, "count": len(again.ok), "arrived": int(again.ok.sum()),
        "intervals": intervals,
    }  # fmt: skip


def _say(found, rows, method: str, again) -> None:
    """Print the parameters and what their intervals mean."""
    from jaxident.estimation.bootstrap import describe
    from jaxident.report.parameters import interval, told

    lines: list[tuple[str, ...]] = [("parameter", "estimate", "95 % interval", "unit", "this input")]
    lines += [(one.name, one.estimate, one.interval, one.unit, one.verdict) for one in map(told, rows)]
    if again:
        beside = ["bootstrap", *(interval(name, *ends) for name, ends in zip(again.order, again.interval, strict=True))]
        lines = [(*line[:3], own, *line[3:]) for line, own in zip(lines, beside, strict=True)]
    click.echo(table(lines))
    click.echo(NOTES[method] + (BOTH_SENSORS if found.model.wheels is not None else ""))
    if again:
        click.echo(describe(again))

"""`jaxident sweep`."""

import os

import click

from jaxident.cli.record import Recorded, origin, tell_origin
from jaxident.cli.session import seed_option, table, wrote
from jaxident.progress import counting, working
from jaxident.start import start_jax


@click.command("sweep", cls=Recorded)
@click.argument("study", metavar="STUDY.toml", required=False)
@click.option("--out", metavar="DIR", help="Folder of the results. A second call goes on where the first stopped.")
@click.option("--scheduler", metavar="ADDRESS|local:N", help="Compute with Dask: a scheduler, or N local processes.")
@click.option("--trial", type=click.IntRange(0), metavar="K", help="Run trial K alone; its picture and log go to DIR.")
@click.option("--example", is_flag=True, help="Print a commented study that runs in about 20 s.")
@seed_option
def command(study, out, scheduler, trial, example, seed):
    """Run a Monte-Carlo study: every combination of the file's axes, with many seeds.

    It writes DIR/trials.zarr (every trial; xarray.open_zarr opens it), DIR/summary.csv with bias, error and coverage,
    and DIR/index.html. With the estimator `diagnose`, which takes seconds a trial, it also writes what was named:
    DIR/naming.csv and DIR/named_effects.csv. If it is stopped at any moment, the same command goes on and ends with
    the same numbers.

    Example: jaxident sweep --example > study.toml, then jaxident sweep study.toml --out study
    """
    if example:
        from jaxident.files.study_example import EXAMPLE

        click.echo(EXAMPLE, nl=False)
        return
    if study is None or out is None:
        raise click.UsageError("give a study file and --out DIR, or --example")
    start_jax()
    from jaxident.files.studies import read_study

    plan = read_study(study, seed=seed)
    if trial is not None:
        _run_one(plan, trial, out)
    else:
        _run_all(plan, out, scheduler)


def _run_all(plan, out, scheduler):
    from jaxident.files.summary import write_naming, write_summary
    from jaxident.files.sweeps import Told, sweep
    from jaxident.files.trials import open_trials
    from jaxident.report.sweep import write_study
    from jaxident.study.bound import bounds
    from jaxident.study.naming import naming
    from jaxident.study.statistics import summarise

    def damaged(count):
        click.echo(f"{out}: {count} damaged chunk{'s are' if count > 1 else ' is'} computed again", err=True)

    with counting("trials") as bar:
        path = sweep(plan, out, scheduler=scheduler, told=Told(bar.begin, bar.advance, damaged))
    wrote(path)
    with working("summing up"):
        trials = open_trials(path)
        summary = summarise(trials, bounds(plan))
        paths = [write_summary(summary, os.path.join(out, "summary.csv"))]
        named = naming(trials)
        if named is not None:
            paths += write_naming(named, os.path.join(out, "naming.csv"), os.path.join(out, "named_effects.csv"))
        paths += write_study(plan, trials, summary, os.path.join(out, "index.html"), named)
    for name in paths:
        wrote(name)
    tell_origin(paths[0], origin("summary.csv"))
    failed = int(summary["failures"].sum())
    click.echo(f"{plan.trials} trials, {len(plan.estimators)} estimators, {failed} failed estimates")


def _run_one(plan, number, out):
    from jaxident.errors import InputError
    from jaxident.files.atomic import make_folder
    from jaxident.files.logs import write_log
    from jaxident.plot import save
    from jaxident.report.trial import draw_trial, trial_rows
    from jaxident.study.engine import run_one

    if number >= plan.trials:
        raise InputError(f"--trial {number}: the study has {plan.trials} trials, 0 to {plan.trials - 1}")
    make_folder(out)
    with working("running the trial"):
        recording, outcome = run_one(plan, number)
        figure = draw_trial(plan, number, recording, outcome)
    click.echo(table(trial_rows(plan, number, outcome)))
    stem = os.path.join(out, f"trial_{number}")
    save(figure, f"{stem}.png")
    wrote(f"{stem}.png")
    write_log(recording.log(), f"{stem}.csv")
    wrote(f"{stem}.csv")
    tell_origin(f"{stem}.csv", origin(f"trial_{number}.csv"))

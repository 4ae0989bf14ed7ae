"""`jaxident example`."""

import dataclasses
import os

import click

from jaxident.cli.record import Recorded, origin
from jaxident.cli.session import check_outputs, seed_option, wrote
from jaxident.progress import working
from jaxident.start import start_jax

OUTPUTS = (*(f"real_{number}.csv" for number in range(1, 7)), ".answer.json")


@click.command("example", cls=Recorded)
@click.option("--out", default="example", show_default=True, metavar="DIR", help="The folder to write.")
@click.option(
    "--effect",
    metavar="NAME",
    help="An effect of the catalogue (`jaxident effects`), or `none`. Without it one is drawn.",
)
@seed_option
def command(out, effect, seed):
    """Write small example logs of a simulated robot: six runs of 1000 rows with camera noise.

    The robot is drawn near the published one, and so is the size of the effect that it has beyond the nominal model;
    what they were is kept in DIR/.answer.json, a model file.

    Example: jaxident example --out example && jaxident identify example
    """
    start_jax()
    import jax

    from jaxident.files.atomic import make_folder
    from jaxident.files.logs import write_log
    from jaxident.files.models import load_model, save_model
    from jaxident.files.origins import with_origin
    from jaxident.study.example import draw_effect, example_robot, example_runs

    key_robot, key_runs = jax.random.split(jax.random.key(seed))
    robot = example_robot(key_robot, load_model("published"))
    robot = draw_effect(jax.random.fold_in(key_robot, 1), robot, effect)
    make_folder(out)
    check_outputs(*(os.path.join(out, name) for name in OUTPUTS))
    with working("simulating"):
        runs = example_runs(key_runs, robot)
    for number, run in enumerate(runs, start=1):
        path = os.path.join(out, f"real_{number}.csv")
        write_log(run, path)
        wrote(path)
    answer = os.path.join(out, ".answer.json")
    told = with_origin(robot.provenance, origin(os.path.basename(answer)))
    save_model(dataclasses.replace(robot, provenance=told), answer)
    wrote(answer)

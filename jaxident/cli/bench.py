"""`jaxident bench`."""

import click

from jaxident.cli.progress import working
from jaxident.cli.record import Recorded, origin, with_provenance
from jaxident.cli.session import check_outputs, json_option, seed_option, table, write_json
from jaxident.start import start_jax


@click.command("bench", cls=Recorded)
@click.option(
    "--trials", type=click.IntRange(50), default=1000, show_default=True, help="How many whole trials a batch has."
)
@seed_option
@json_option
def command(trials, seed, json_file):
    """Measure how fast this machine is, in double precision, on all its cores or GPUs.

    It prints five numbers. Four are medians of seven tries: nanoseconds of each stage for one sample of one trial (1024
    trials of 2000 samples), whole trials of 1000 samples per second, milliseconds for the start values of one trial in
    a batch, and microseconds in which the recursion takes one row of one robot. The fifth is the median of three tries:
    milliseconds of one maximum-likelihood fit in a batch of 64 runs of 1000 samples.

    Example: jaxident bench --json bench.json
    """
    start_jax()
    check_outputs(json_file)
    from jaxident.files.models import load_model
    from jaxident.study.bench import bench

    with working("measuring"):
        result = bench(load_model("published"), trials=trials, seed=seed)._asdict()
    numbers = [(name, f"{value:.4g}") for name, value in result.items() if isinstance(value, float)]
    click.echo(table([("figure", "value"), *numbers]))
    click.echo(", ".join(result["devices"]))
    write_json(with_provenance(result, origin("--json")), json_file)

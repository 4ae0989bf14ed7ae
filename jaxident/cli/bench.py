"""`jaxident bench`."""

import click

from jaxident.cli.record import Recorded, origin, with_provenance
from jaxident.cli.session import check_outputs, json_option, seed_option, table, write_json
from jaxident.progress import working
from jaxident.start import start_jax


@click.command("bench", cls=Recorded)
@click.option(
    "--trials", type=click.IntRange(50), default=1000, show_default=True, help="How many whole trials a batch has."
)
@seed_option
@json_option
def command(trials, seed, json_file):
    """Measure how fast this machine is, in double precision, on all its cores or GPUs.

    First come the stages: nanoseconds for one sample of one trial (medians of seven tries, 2000 samples), what part of
    a whole trial they take, and the same stage in C written by hand, as recorded on two cores of a server. Then whole
    trials of 1000 samples per second, milliseconds for the start values of one trial in a batch, microseconds in which
    the recursion takes one row of one robot, and milliseconds of one maximum-likelihood fit in a batch of runs of 1000
    samples (median of three). A GPU gets larger batches than a CPU; --json tells how large.

    Example: jaxident bench --json bench.json
    """
    start_jax()
    check_outputs(json_file)
    from jaxident.files.models import load_model
    from jaxident.study.bench import C_NS, STAGES, bench, parts

    with working("measuring"):
        found = bench(load_model("published"), trials=trials, seed=seed)
    result, share = found._asdict(), parts(found)
    numbers = [(name, value) for name, value in result.items() if isinstance(value, float)]
    rows = [
        (name, f"{value:.4g}", f"{share[name]:.0%}" if name in share else "", f"{C_NS[name]:g}" if name in C_NS else "")
        for name, value in numbers
    ]
    rows.insert(len(STAGES), ("rest", "", f"{share['rest']:.0%}", ""))
    click.echo(table([("figure", "value", "of a trial", "C"), *rows]))
    click.echo(", ".join(result["devices"]))
    write_json(with_provenance(result, origin("--json")), json_file)

"""`jaxident plan`."""

import click

from jaxident.cli.record import Recorded, origin, tell_origin, with_provenance
from jaxident.cli.session import (
    MOST_ROWS,
    above_zero,
    check_outputs,
    json_option,
    seed_option,
    table,
    write_json,
    wrote,
)
from jaxident.progress import working
from jaxident.start import start_jax

PLAIN = 9.0
"""Separation from which a diagnosis names one effect and not the other, odds of thousands to one."""


@click.command("plan", cls=Recorded)
@click.argument("model")
@click.option("--between", required=True, metavar="A,B", help="Two effects (`jaxident effects` lists them).")
@click.option(
    "--samples", type=click.IntRange(2, MOST_ROWS), default=600, show_default=True, help="Length of the run, in rows."
)
@click.option("--limit", type=above_zero, default=1.0, show_default=True, metavar="UMAX",
              help="Largest command, in the unit of the model.")  # fmt: skip
@click.option("--out", required=True, metavar="LOG", help="The log to write: times and commands, no poses.")
@seed_option
@json_option
def command(model, between, samples, limit, out, seed, json_file):
    """Design the next run: the commands that best tell two effects apart on the robot of MODEL, from rest.

    The "separation" that it prints says how much more likely the data are under the right effect than under the other
    one, when both are refitted. It is a difference of log-likelihoods, computed to first order. An effect has the size
    that MODEL gives it, or else a typical one.

    Example: jaxident plan model.json --between transport_delay,motor_lag --limit 0.8 --out next.csv
    """
    start_jax()
    from jaxident.diagnosis.planning.next_run import plan
    from jaxident.files.logs import write_log
    from jaxident.files.models import load_model
    from jaxident.files.origins import check_beside

    check_outputs(out, json_file)
    check_beside(out)
    made = origin("--out")
    names = tuple(name.strip() for name in between.split(","))
    robot = load_model(model)
    with working("trying inputs"):
        found = plan(robot, names, samples=samples, limit=limit, seed=seed)
    write_log(found.log, out)
    click.echo(_described(found))
    wrote(out)
    tell_origin(out, made)
    write_json(with_provenance(_content(found, samples, limit), made), json_file)


def _described(found) -> str:
    sizes = " from ".join(
        f"{name} ({', '.join(f'{key} {value:.3g}' for key, value in size.items())})"
        for name, size in found.sizes.items()
    )
    source = "assumed: the model has none" if found.assumed else "the model's"
    camera = f"camera noise {1e3 * found.noise.position:.3g} mm, {1e3 * found.noise.heading:.3g} mrad ({source})"
    rows: list[tuple[str, ...]] = [
        ("input", "separation"),
        (f"before: {found.ordinary}", f"{found.before:.1f}"),
        ("after: this plan", f"{found.after:.1f}"),
    ]
    times = f"{found.after / found.before:.1f} times the ordinary separation" if found.before > 0.05 else ""
    room = f"the path of the model is {found.area[0]:.2f} m wide and {found.area[1]:.2f} m high"
    faint = "" if found.after > PLAIN else f"below {PLAIN:g} the two stay hard to tell: give it more --samples"
    return "\n".join(filter(None, (f"telling {sizes}", camera, table(rows), times, room, faint)))


def _content(found, samples: int, limit: float) -> dict:
    return {
        "between": list(found.sizes),
        "sizes": found.sizes,
        "samples": samples,
        "limit": limit,
        "noise": {"position": float(found.noise.position), "heading": float(found.noise.heading)},
        "noise_assumed": found.assumed,
        "ordinary": found.ordinary,
        "before": found.before,
        "after": found.after,
        "area": list(found.area),
    }

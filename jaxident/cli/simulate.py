"""`jaxident simulate`."""

import click

from jaxident.cli.record import Recorded, origin, tell_origin
from jaxident.cli.session import (
    MOST_ROWS,
    above_zero,
    check_outputs,
    effect_option,
    not_negative,
    rows_option,
    seed_option,
    wrote,
)
from jaxident.progress import working
from jaxident.start import start_jax

EXCITATION_NAMES = ("staircase", "multilevel", "prbs", "multisine", "chirp")


class Noise(click.ParamType):
    """POS,HEAD: two standard deviations."""

    name = "POS,HEAD"

    def convert(self, value, param, ctx):
        """A pair of numbers that are not negative."""
        try:
            position, heading = (float(part) for part in value.split(","))
        except ValueError:
            self.fail(f"{value!r} is not POS,HEAD: two numbers, metres and radians, as in 0.001,0.01", param, ctx)
        if not (0.0 <= position < float("inf") and 0.0 <= heading < float("inf")):
            self.fail(f"{value!r}: standard deviations are finite and not negative", param, ctx)
        return position, heading


@click.command("simulate", cls=Recorded)
@click.argument("model")
@click.option("--inputs", metavar="LOG", help="Take times and commands from this log (`-`: standard input).")
@click.option("--excitation", type=click.Choice(EXCITATION_NAMES), help="Make commands of this kind instead.")
@click.option("--samples", type=click.IntRange(2, MOST_ROWS), help="Length of the excitation, in rows.")
@click.option("--amplitude", type=above_zero, default=1.0, show_default=True)
@click.option("--hold", type=rows_option, default=20, show_default=True, help="How many samples each level lasts.")
@effect_option
@click.option("--noise", type=Noise(), help="Camera noise [m], [rad]. Without it the log has no noise.")
@click.option(
    "--wheel-noise", type=not_negative, metavar="SD", help="Also write wheel speeds, with this white noise [rad/s]."
)
@click.option(
    "--wheel-radius", type=above_zero, metavar="R", help="Radius of the wheels [m] (default: what the model says)."
)
@click.option("--wheel-track", type=above_zero, metavar="W", help="Distance between the wheels [m] (default: what "
              "the model says, or what follows from its gains).")  # fmt: skip
@click.option("--out", required=True, metavar="LOG", help="The log to write (.csv or .csv.gz).")
@seed_option
def command(model, inputs, excitation, samples, amplitude, hold, effects, noise, out, seed, **wheels):
    """Simulate a log of MODEL, a model file or `published`.

    Random slip and the correlation time of the noise come from the model file. They count only with --noise. Each
    --effect is added to the effects of the model file and replaces one of the same name; `jaxident effects` lists all.
    A model with `wheels` also gives wheel speeds, without noise unless --wheel-noise is given.

    Example: jaxident simulate published --excitation staircase --samples 2000 --noise 0.001,0.01
    --effect transport_delay:delay=0.05 --out log.csv
    """
    if (inputs is None) == (excitation is None):
        raise click.UsageError("give either --inputs LOG or --excitation NAME")
    if (excitation is None) != (samples is None):
        raise click.UsageError("--excitation and --samples N go together")
    start_jax()
    import jax

    from jaxident.effects.apply import with_effects
    from jaxident.files.logs import read_log, write_log
    from jaxident.files.models import load_model
    from jaxident.files.origins import check_beside
    from jaxident.study.synthetic import excite, simulate_runs

    check_outputs(out)
    check_beside(out)
    made = origin("--out")
    robot = _with_wheels(with_effects(load_model(model), effects), **wheels)
    key_input, key_noise = jax.random.split(jax.random.key(seed))
    with working("simulating"):
        if inputs is None:
            log = excite(key_input, excitation, samples, robot.sample_period, amplitude=amplitude, hold=hold)
        else:
            log = read_log(inputs)
        own = wheels["wheel_noise"] or 0.0
        write_log(simulate_runs(robot, log, noise=noise, wheel_noise=own, key=key_noise), out)
    wrote(out)
    tell_origin(out, made)


def _with_wheels(robot, wheel_noise, wheel_radius, wheel_track):
    """The robot with the sensor of wheel speeds that the options ask for."""
    import dataclasses

    from jaxident.export.wheels import robot_of
    from jaxident.robot.wheel_sensor import WheelSensor

    if robot.wheels is None and wheel_radius is None and (wheel_noise is not None or wheel_track is not None):
        raise click.UsageError("wheel speeds need --wheel-radius R: this model has no wheels")
    if robot.wheels is None and wheel_radius is None:
        return robot
    known = robot.wheels or WheelSensor(None, None)
    track = wheel_track or known.track or robot_of(robot).track
    return dataclasses.replace(robot, wheels=WheelSensor(wheel_radius or known.radius, track))

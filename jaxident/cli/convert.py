"""`jaxident convert`."""

import click

from jaxident.cli.progress import working
from jaxident.cli.session import Number, above_zero, check_outputs, wrote


@click.command()
@click.option("--commands", required=True, metavar="CSV", help="Columns t,v,w or t,u_r,u_l.")
@click.option("--poses", required=True, metavar="CSV", help="Columns t,x,y,theta.")
@click.option("--period", type=above_zero, metavar="S", help="Rows at this even period; without it one row per event.")
@click.option("--track", type=above_zero, metavar="W", help="Distance between the wheels [m], for commands in v,w.")
@click.option("--pose-offset", type=Number(), default=0.0, show_default=True, metavar="S", help="Added to pose times.")
@click.option("--hold-timeout", type=above_zero, metavar="S", help="A command older than this counts as zero.")
@click.option("--out", required=True, metavar="LOG", help="The log to write (.csv or .csv.gz).")
def command(commands, poses, period, track, pose_offset, hold_timeout, out):
    """Two streams, each with its own times, to one log. Never interpolates a pose.

    Example: jaxident convert --commands cmd.csv --poses mocap.csv --track 0.26 --period 0.05 --out log.csv
    """
    import numpy as np

    from jaxident.files.logs import write_log
    from jaxident.files.streams import merge, read_commands, read_poses

    check_outputs(out)
    settings = {"period": period, "track": track, "pose_offset": pose_offset, "hold_timeout": hold_timeout}
    with working("converting"):
        log = merge(read_commands(commands), read_poses(poses), **settings)
        write_log(log, out)
    seen = np.count_nonzero(np.isfinite(log.x))
    click.echo(f"{len(log.t)} rows, {seen} with a pose, {log.t[-1] - log.t[0]:.6g} s")
    wrote(out)

"""`jaxident convert`."""

import click

from jaxident.cli.progress import working
from jaxident.cli.record import Recorded, origin, tell_origin
from jaxident.cli.session import ColumnsOption, Number, above_zero, check_outputs, columns_option, table, warn, wrote

NEEDED = "give --commands CSV --poses CSV, or --bag PATH"


class OffsetOption(Number):
    """A time in seconds, or `auto`."""

    name = "S|auto"

    def convert(self, value, param, ctx):
        """The time, or the word `auto`."""
        if value == "auto":
            return value
        try:
            return super().convert(float(value), param, ctx)
        except ValueError:
            self.fail(f"{value!r} is neither a time in seconds nor auto", param, ctx)


class OrderOption(click.ParamType):
    """RIGHT,LEFT: indices or joint names."""

    name = "RIGHT,LEFT"

    def convert(self, value, param, ctx):
        """Both words."""
        words = tuple(word.strip() for word in value.split(",")) if isinstance(value, str) else value
        if len(words) != 2 or not all(words) or words[0] == words[1]:
            self.fail(f"{value!r} should be two indices or joint names, the right wheel first, as in 1,0", param, ctx)
        return words


@click.command("convert", cls=Recorded)
@click.option("--commands", metavar="CSV", help="Columns t,v,w or t,u_r,u_l.")
@click.option("--poses", metavar="CSV", help="Columns t,x,y,theta or t,x,y,qx,qy,qz,qw.")
@click.option("--bag", metavar="PATH", help="A ROS bag in place of both: .bag, .db3, .mcap or a ROS 2 folder.")
@click.option("--list", "listing", is_flag=True, help="Show the topics of --bag, and which look right.")
@click.option("--command-topic", metavar="T", help="Twist, TwistStamped, Float64MultiArray or JointState.")
@click.option(
    "--pose-topic", metavar="T", help="PoseStamped, PoseWithCovarianceStamped, TransformStamped, tf, Odometry."
)
@click.option("--child-frame", metavar="F", help="Of a tf topic: the frame that moves with the robot.")
@click.option("--wheel-order", type=OrderOption(), help="Which numbers or joints are the wheels, the right one first.")
@click.option("--bag-time", is_flag=True, help="Times of recording in place of the headers' stamps.")
@columns_option
@click.option("--command-columns", type=ColumnsOption(), default="", help="As --columns, for the commands alone.")
@click.option("--pose-columns", type=ColumnsOption(), default="", help="As --columns, for the poses alone.")
@click.option("--period", type=above_zero, metavar="S", help="Rows at this even period; without it one row per event.")
@click.option("--track", type=above_zero, metavar="W", help="Distance between the wheels [m], for commands in v,w.")
@click.option("--pose-offset", type=OffsetOption(), default="0", show_default=True, help="Time added to the poses'; "
              "auto finds it, a delay of the robot included.")  # fmt: skip
@click.option("--hold-timeout", type=above_zero, metavar="S", help="A command older than this counts as zero.")
@click.option("--out", metavar="LOG", help="The log to write (.csv or .csv.gz).")
def command(commands, poses, bag, listing, out, period, track, pose_offset, hold_timeout, **chosen):
    """Two streams, each with its own times, to one log. Never interpolates a pose.

    Example: jaxident convert --commands cmd.csv --poses mocap.csv --track 0.26 --period 0.05 --out log.csv
    """
    if bool(bag) == bool(commands or poses) or (not bag and not (commands and poses)):
        raise click.UsageError(NEEDED)
    if listing and not bag:
        raise click.UsageError("--list shows the topics of --bag PATH")
    if listing:
        _list(bag)
        return
    if not out:
        raise click.UsageError("Missing option '--out': the log to write")
    import numpy as np

    from jaxident.estimation.suspicions import log_suspicions
    from jaxident.files.logs import write_log
    from jaxident.files.origins import check_beside
    from jaxident.files.streams import merge

    check_outputs(out)
    check_beside(out)
    made = origin("--out")
    with working("converting"):
        given, seen, notes = _from_bag(bag, chosen) if bag else _from_files(commands, poses, chosen)
        offset, told = _estimate(given, seen, track) if pose_offset == "auto" else (pose_offset, ())
        settings = {"period": period, "track": track, "pose_offset": offset, "hold_timeout": hold_timeout}
        log = merge(given, seen, **settings)
        doubts = log_suspicions(log)
        write_log(log, out)
    for note in (*notes, *told):
        click.echo(note)
    own = chosen["columns"] | chosen["command_columns"] | chosen["pose_columns"]
    warn(_for_speeds(doubts) if track else doubts, own)
    measured = np.count_nonzero(np.isfinite(log.x))
    click.echo(f"{len(log.t)} rows, {measured} with a pose, {log.t[-1] - log.t[0]:.6g} s")
    wrote(out)
    tell_origin(out, made)


IN_SPEEDS = {
    "--columns u_r=u_l,u_l=u_r": "--columns w=w:-1",
    "--columns u_r=u_r:-1,u_l=u_l:-1": "--columns v=v:-1,w=w:-1",
    "--columns u_r=u_l:-1,u_l=u_r:-1": "--columns v=v:-1",
}
"""What mends commands of wheels, in terms of the speeds that they were made from."""


def _for_speeds(lines):
    """The lines, their options those of commands in v,w; a single wheel that is reversed has none."""
    for wheels, speeds in IN_SPEEDS.items():
        lines = [line.replace(f"`{wheels}`", f"`{speeds}`") for line in lines]
    return lines


def _from_files(commands, poses, chosen):
    from jaxident.files.streams import read_commands, read_poses

    columns = chosen["columns"]
    given = read_commands(commands, columns | chosen["command_columns"])
    return given, read_poses(poses, columns | chosen["pose_columns"]), ()


def _from_bag(bag, chosen):
    from jaxident.files.bags import read_bag_streams
    from jaxident.files.messages import Choice

    choice = Choice(chosen["child_frame"], chosen["wheel_order"], chosen["bag_time"])
    columns = chosen["columns"] | chosen["command_columns"] | chosen["pose_columns"]
    return read_bag_streams(bag, chosen["command_topic"], chosen["pose_topic"], choice, columns)


def _estimate(given, seen, track):
    """The offset, and a line that tells it."""
    from jaxident.files.offset import estimate_offset

    found = estimate_offset(given, seen, track)
    error = f"standard error {found.standard_error:.1g} s"
    return found.offset, (f"--pose-offset {found.offset:.6f} ({error}; a delay of the robot counts in it)",)


def _list(bag) -> None:
    from jaxident.files.bags import list_topics

    rows = [
        (one.name, one.type, str(one.messages), f"{one.rate:.4g}" if one.rate > 0 else "", one.suits)
        for one in list_topics(bag)
    ]
    click.echo(table([("topic", "type", "messages", "rate [1/s]", "could be"), *rows]))

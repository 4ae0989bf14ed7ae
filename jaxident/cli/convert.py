"""`jaxident convert`."""

import re

import click

from jaxident.cli.progress import working
from jaxident.cli.record import Recorded, origin, tell_origin
from jaxident.cli.session import ColumnsOption, Number, above_zero, check_outputs, columns_option, table, warn, wrote

NEEDED = "give --commands CSV --poses CSV, or --bag PATH, or --log LOG"
OFFSET_ADVICE = re.compile(r"jaxident convert --log LOG --pose-offset (\S+) --out NEW")
"""As `suspicions` words it."""


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


class PairOption(click.ParamType):
    """Two different words."""

    def __init__(self, name: str, wanted: str) -> None:
        self.name, self.wanted = name, wanted

    def convert(self, value, param, ctx):
        """Both words."""
        words = tuple(word.strip() for word in value.split(",")) if isinstance(value, str) else value
        if len(words) != 2 or not all(words) or words[0] == words[1]:
            self.fail(f"{value!r} should be two {self.wanted}", param, ctx)
        return words


ORDER = PairOption("RIGHT,LEFT", "indices or joint names, the right wheel first, as in 1,0")
FRAMES = PairOption("FIXED,ROBOT", "frames, the robot's last, as in map,base_link")


@click.command("convert", cls=Recorded)
@click.option("--commands", metavar="CSV", help="Columns t,v,w or t,u_r,u_l.")
@click.option("--poses", metavar="CSV", help="Columns t,x,y,theta or t,x,y,qx,qy,qz,qw.")
@click.option("--log", metavar="LOG", help="A finished log (file or folder) in place of both, for --pose-offset, "
              "--period and --columns.")  # fmt: skip
@click.option("--bag", metavar="PATH", help="A ROS bag in place of both: .bag, .db3, .mcap or a ROS 2 folder.")
@click.option("--list", "listing", is_flag=True, help="Show the topics of --bag, and which look right.")
@click.option("--command-topic", metavar="T", help="Twist, TwistStamped, Float64MultiArray or JointState.")
@click.option(
    "--pose-topic", metavar="T", help="PoseStamped, PoseWithCovarianceStamped, TransformStamped, tf, Odometry."
)
@click.option("--child-frame", metavar="F", help="Of a tf topic: the frame that moves with the robot.")
@click.option("--pose-frames", type=FRAMES, help="Compose tf from a fixed frame to the robot's, as in "
              "map,base_link.")  # fmt: skip
@click.option("--wheel-order", type=ORDER, help="Which numbers or joints are the wheels, the right one first.")
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
def command(**chosen):
    """Two streams, each with its own times, to one log; or a log to a better one. A topic's pose is never interpolated.

    Example: jaxident convert --commands cmd.csv --poses mocap.csv --track 0.26 --period 0.05 --out log.csv

    Example: jaxident convert --log log.csv --pose-offset auto --out mended.csv
    """
    _check_sources(chosen)
    if chosen["listing"]:
        _list(chosen["bag"])
        return
    out = chosen["out"]
    if not out:
        raise click.UsageError("Missing option '--out': the log to write")
    import numpy as np

    from jaxident.estimation.suspicions import log_suspicions
    from jaxident.files.logs import write_log
    from jaxident.files.origins import check_beside

    check_outputs(out)
    check_beside(out)
    made = origin("--out")
    with working("converting"):
        log, offset, notes = _from_log(chosen) if chosen["log"] else _from_streams(chosen)
        doubts = log_suspicions(log)
        write_log(log, out)
    for note in notes:
        click.echo(note)
    own = chosen["columns"] | chosen["command_columns"] | chosen["pose_columns"]
    lines = [_with_offset(line, offset, bool(chosen["log"])) for line in doubts]
    warn(_for_speeds(lines) if chosen["track"] else lines, own)
    measured = np.count_nonzero(np.isfinite(log.x))
    length = sum(run.t[-1] - run.t[0] for run in log.runs())
    click.echo(f"{len(log.t)} rows, {measured} with a pose, {length:.6g} s")
    wrote(out)
    tell_origin(out, made)


STREAMS_ALONE = ("track", "hold_timeout", "command_columns", "pose_columns", "command_topic", "pose_topic",
                 "child_frame", "pose_frames", "wheel_order", "bag_time")  # fmt: skip
"""Options that a finished log has no use for."""


def _check_sources(chosen) -> None:
    """UsageError unless there is one source, with options that it knows."""
    streams = bool(chosen["commands"] and chosen["poses"])
    half = bool(chosen["commands"]) != bool(chosen["poses"])
    if half or streams + bool(chosen["bag"]) + bool(chosen["log"]) != 1:
        raise click.UsageError(NEEDED)
    if chosen["child_frame"] and chosen["pose_frames"]:
        raise click.UsageError("--pose-frames FIXED,ROBOT names the robot's frame; leave --child-frame out")
    if chosen["listing"] and not chosen["bag"]:
        raise click.UsageError("--list shows the topics of --bag PATH")
    foreign = next((name for name in STREAMS_ALONE if chosen["log"] and chosen[name]), None)
    if foreign is not None:
        raise click.UsageError(f"--{foreign.replace('_', '-')} is for two streams; --log LOG has its rows already")


def _with_offset(line: str, offset: float, finished: bool) -> str:
    """A line about clocks that differ with the offset for this call: what is left and what was given already."""
    found = OFFSET_ADVICE.search(line)
    if not found:
        return line
    option = f"--pose-offset {float(found[1]) + offset:.3g}"
    return line.replace(found[0], f"jaxident convert {f'--log LOG {option} --out NEW' if finished else option}")


def _from_log(chosen):
    """The log made of a finished one, the offset, and notes, a line each."""
    from jaxident.files.logs import read_whole
    from jaxident.files.offset import estimate_log_offset
    from jaxident.files.shifted import shift_poses

    log = read_whole(chosen["log"], chosen["columns"])
    offset, told = _offset(chosen, lambda: estimate_log_offset(log))
    return shift_poses(log, offset, chosen["period"]), offset, told


def _from_streams(chosen):
    """The log made of two streams, the offset, and notes, a line each."""
    from jaxident.files.offset import estimate_offset
    from jaxident.files.streams import merge

    given, seen, notes = _from_bag(chosen) if chosen["bag"] else _from_files(chosen)
    offset, told = _offset(chosen, lambda: estimate_offset(given, seen, chosen["track"]))
    settings = {name: chosen[name] for name in ("period", "track", "hold_timeout")}
    return merge(given, seen, pose_offset=offset, **settings), offset, (*notes, *told)


def _offset(chosen, estimate):
    """The offset that was asked for, and a line that tells one that was found."""
    if chosen["pose_offset"] != "auto":
        return chosen["pose_offset"], ()
    found = estimate()
    error = f"standard error {found.standard_error:.1g} s"
    return found.offset, (f"--pose-offset {found.offset:.6f} ({error}; a delay of the robot counts in it)",)


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


def _from_files(chosen):
    from jaxident.files.streams import read_commands, read_poses

    columns = chosen["columns"]
    given = read_commands(chosen["commands"], columns | chosen["command_columns"])
    return given, read_poses(chosen["poses"], columns | chosen["pose_columns"]), ()


def _from_bag(chosen):
    from jaxident.files.bags import read_bag_streams
    from jaxident.files.messages import Choice

    choice = Choice(chosen["child_frame"], chosen["wheel_order"], chosen["bag_time"], chosen["pose_frames"])
    columns = chosen["columns"] | chosen["command_columns"] | chosen["pose_columns"]
    return read_bag_streams(chosen["bag"], chosen["command_topic"], chosen["pose_topic"], choice, columns)


def _list(bag) -> None:
    from jaxident.files.bags import list_topics

    rows = [
        (one.name, one.type, str(one.messages), f"{one.rate:.4g}" if one.rate > 0 else "", one.suits)
        for one in list_topics(bag)
    ]
    click.echo(table([("topic", "type", "messages", "rate [1/s]", "could be"), *rows]))

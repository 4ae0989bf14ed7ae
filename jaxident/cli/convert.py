"""`jaxident convert`."""

import click

from jaxident.cli.advice import advising, for_speeds, warn, with_offset
from jaxident.cli.convert_options import FRAMES, ORDER, OffsetOption
from jaxident.cli.record import Recorded, origin, tell_origin
from jaxident.cli.session import ColumnsOption, above_zero, check_outputs, columns_option, table, wrote
from jaxident.progress import working

NEEDED = "give --commands CSV --poses CSV, or --bag PATH, or --log LOG"


@click.command("convert", cls=Recorded)
@click.option("--commands", metavar="CSV", help="Columns t,v,w or t,u_r,u_l.")
@click.option("--poses", metavar="CSV", help="Columns t,x,y,theta or t,x,y,qx,qy,qz,qw.")
@click.option("--wheels", metavar="CSV", help="Columns t,wheel_r,wheel_l: measured wheel speeds [rad/s].")
@click.option("--log", metavar="LOG", help="A finished log (file or folder) to mend, with --pose-offset, "
              "--period and --columns.")  # fmt: skip
@click.option("--bag", metavar="PATH", help="A ROS bag that has both streams: .bag, .db3, .mcap or a ROS 2 folder.")
@click.option("--list", "listing", is_flag=True, help="Show the topics of --bag, and what each could be.")
@click.option(
    "--command-topic", metavar="T", help="Topic of the commands: Twist, TwistStamped, Float64MultiArray or JointState."
)
@click.option(
    "--pose-topic",
    metavar="T",
    help="Topic of the poses: PoseStamped, PoseWithCovarianceStamped, TransformStamped, tf or Odometry.",
)
@click.option("--wheels-topic", metavar="T", help="JointState whose velocities are measured wheel speeds [rad/s].")
@click.option("--wheel-joints", type=ORDER, help="Which joints of --wheels-topic are the wheels, the right one first.")
@click.option("--wheel-ticks", type=above_zero, metavar="N", help="The wheel columns hold counts, N to a turn of the "
              "wheel. Of --wheels-topic the joints' positions are taken (N = 6.283185 for radians).")  # fmt: skip
@click.option("--wheel-counter", type=above_zero, metavar="M", help="The number at which these counts begin again at "
              "zero, such as 65536.")  # fmt: skip
@click.option("--child-frame", metavar="F", help="In a tf topic, the frame that moves with the robot.")
@click.option("--pose-frames", type=FRAMES, help="Compose tf from a fixed frame to the robot's, as in "
              "map,base_link.")  # fmt: skip
@click.option("--wheel-order", type=ORDER, help="Which numbers or joints are the wheels, the right one first.")
@click.option("--bag-time", is_flag=True, help="Use the times of recording instead of the stamps in the messages.")
@columns_option
@click.option("--command-columns", type=ColumnsOption(), default="", help="Like --columns, only for the commands.")
@click.option("--pose-columns", type=ColumnsOption(), default="", help="Like --columns, only for the poses.")
@click.option("--wheels-columns", type=ColumnsOption(), default="", help="Like --columns, only for the wheel speeds.")
@click.option(
    "--period",
    type=above_zero,
    metavar="S",
    help="Write rows at this even period. Without it there is one row for each message.",
)
@click.option("--track", type=above_zero, metavar="W", help="Distance between the wheels [m], for commands in v,w.")
@click.option("--pose-offset", type=OffsetOption(), default="0", show_default=True, help="Seconds to add to the times "
              "of the poses. auto finds them; a delay of the robot is part of what it finds.")  # fmt: skip
@click.option("--wheels-offset", type=OffsetOption(), default="0", show_default=True, help="Seconds to add to "
              "the times of the wheel speeds. auto finds those at which they fit the poses.")  # fmt: skip
@click.option("--hold-timeout", type=above_zero, metavar="S", help="A command older than this counts as zero.")
@click.option("--out", metavar="LOG", help="The log to write (.csv or .csv.gz).")
def command(**chosen):
    """Make one log of two streams, commands and poses, each with its own times; or mend a finished log.

    Measured wheel speeds may be a third stream. A pose of one topic is never interpolated.

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
    from jaxident.estimation.suspicions.log_suspicions import log_suspicions
    from jaxident.files.logs import write_log
    from jaxident.files.origins import check_beside

    check_outputs(out)
    check_beside(out)
    made = origin("--out")
    own = chosen["columns"] | chosen["command_columns"] | chosen["pose_columns"] | chosen["wheels_columns"]
    whole = not (chosen["command_columns"] or chosen["pose_columns"] or chosen["wheels_columns"])
    with working("converting"), advising(own, whole):
        log, offset, notes = _from_log(chosen) if chosen["log"] else _from_streams(chosen)
        doubts = log_suspicions(log)
        write_log(log, out)
    for note in notes:
        click.echo(note)
    lines = [with_offset(line, offset, bool(chosen["log"])) for line in doubts]
    warn(for_speeds(lines) if chosen["track"] else lines, own, whole)
    click.echo(_counted(log))
    wrote(out)
    tell_origin(out, made)


def _counted(log) -> str:
    """What a log holds, in a line."""
    import numpy as np

    from jaxident.log import wheels_measured

    poses, turning = np.count_nonzero(np.isfinite(log.x)), wheels_measured(log)
    wheels = "" if turning is None else f", {np.count_nonzero(turning)} with both wheel speeds"
    length = sum(run.t[-1] - run.t[0] for run in log.runs())
    return f"{len(log.t)} rows, {poses} with a pose{wheels}, {length:.6g} s"


STREAMS_ALONE = ("track", "hold_timeout", "command_columns", "pose_columns", "command_topic", "pose_topic",
                 "child_frame", "pose_frames", "wheel_order", "bag_time", "wheels", "wheels_columns", "wheels_topic",
                 "wheel_joints", "wheel_ticks", "wheel_counter")  # fmt: skip
"""Options that a finished log has no use for."""


def _check_sources(chosen) -> None:
    """UsageError unless there is one source, with options that it knows."""
    streams = bool(chosen["commands"] and chosen["poses"])
    half = bool(chosen["commands"]) != bool(chosen["poses"])
    if half or streams + bool(chosen["bag"]) + bool(chosen["log"]) != 1:
        raise click.UsageError(NEEDED)
    if chosen["child_frame"] and chosen["pose_frames"]:
        raise click.UsageError("--pose-frames FIXED,ROBOT names the robot's frame; leave --child-frame out")
    if chosen["wheels"] and chosen["bag"]:
        raise click.UsageError("--wheels CSV goes with --commands and --poses; of a bag give --wheels-topic T")
    if (chosen["wheels_topic"] or chosen["wheel_joints"]) and not chosen["bag"]:
        raise click.UsageError("--wheels-topic and --wheel-joints are for --bag PATH; beside CSV give --wheels CSV")
    if chosen["wheel_joints"] and not chosen["wheels_topic"]:
        raise click.UsageError("--wheel-joints names joints of --wheels-topic T, which is missing")
    if chosen["wheel_ticks"] and not (chosen["wheels"] or chosen["wheels_topic"]):
        raise click.UsageError("--wheel-ticks tells of --wheels CSV or --wheels-topic T, which is missing")
    if chosen["wheel_counter"] and not chosen["wheel_ticks"]:
        raise click.UsageError("--wheel-counter tells of counts: give --wheel-ticks N as well")
    if chosen["listing"] and not chosen["bag"]:
        raise click.UsageError("--list shows the topics of --bag PATH")
    foreign = next((name for name in STREAMS_ALONE if chosen["log"] and chosen[name]), None)
    if foreign is not None:
        raise click.UsageError(f"--{foreign.replace('_', '-')} is for two streams; --log LOG has its rows already")


def _from_log(chosen):
    """The log made of a finished one, the offset, and notes, a line each."""
    from jaxident.estimation.suspicions.checks import check_log_rate
    from jaxident.files.logs import read_whole
    from jaxident.files.offset import estimate_log_offset
    from jaxident.files.shifted import shift_poses

    log = read_whole(chosen["log"], chosen["columns"])
    check_log_rate(log)
    offset, told = _offset(chosen, lambda: estimate_log_offset(log))
    if chosen["wheels_offset"] == 0.0:
        return shift_poses(log, offset, chosen["period"]), offset, told
    log, wheels_told = _moved_wheels(chosen, shift_poses(log, offset))
    return log, offset, (*told, *wheels_told)


def _from_streams(chosen):
    """The log made of two streams, the offset, and notes, a line each."""
    from jaxident.files.offset import estimate_offset
    from jaxident.files.streams import merge

    given, seen, notes = _from_bag(chosen) if chosen["bag"] else _from_files(chosen)
    offset, told = _offset(chosen, lambda: estimate_offset(given, seen, chosen["track"]))
    settings = {name: chosen[name] for name in ("period", "track", "hold_timeout")}
    wheels, fine = _wheels(chosen)
    log = merge(given, seen, wheels=wheels, pose_offset=offset, **settings)
    log, wheels_told = _moved_wheels(chosen, log)
    return log, offset, (*notes, *told, *fine, *wheels_told)


def _moved_wheels(chosen, log):
    """The log with the offset of its wheel speeds that was asked for, and a line that tells one that was found."""
    from jaxident.files.offset import estimate_wheels_offset
    from jaxident.files.shifted import shift_wheels

    if chosen["wheels_offset"] != "auto":
        return shift_wheels(log, chosen["wheels_offset"], chosen["period"]), ()
    offset, error = estimate_wheels_offset(log)
    line = f"--wheels-offset {offset:.6f} (standard error {error:.1g} s)"
    return shift_wheels(log, offset, chosen["period"]), (line,)


def _wheels(chosen):
    """The stream of measured wheel speeds, or None; and a line on how fine counts are."""
    from jaxident.files.bags import read_bag_wheels
    from jaxident.files.streams import read_wheels
    from jaxident.files.ticks import speeds_of_counts

    columns = chosen["columns"] | chosen["wheels_columns"]
    if chosen["wheels"]:
        found = read_wheels(chosen["wheels"], columns)
    elif chosen["wheels_topic"]:
        found = read_bag_wheels(chosen["bag"], chosen["wheels_topic"], _choice(chosen), columns)
    else:
        return None, ()
    if chosen["wheel_ticks"] is None:
        return found, ()
    found, line = speeds_of_counts(found, chosen["wheel_ticks"], chosen["wheel_counter"])
    return found, (line,)


def _offset(chosen, estimate):
    """The offset that was asked for, and a line that tells one that was found."""
    if chosen["pose_offset"] != "auto":
        return chosen["pose_offset"], ()
    found = estimate()
    error = f"standard error {found.standard_error:.1g} s"
    return found.offset, (f"--pose-offset {found.offset:.6f} ({error}; a delay of the robot counts in it)",)


def _from_files(chosen):
    from jaxident.files.streams import read_commands, read_poses

    columns = chosen["columns"]
    given = read_commands(chosen["commands"], columns | chosen["command_columns"])
    return given, read_poses(chosen["poses"], columns | chosen["pose_columns"]), ()


def _from_bag(chosen):
    from jaxident.files.bags import read_bag_streams

    columns = chosen["columns"] | chosen["command_columns"] | chosen["pose_columns"]
    return read_bag_streams(chosen["bag"], chosen["command_topic"], chosen["pose_topic"], _choice(chosen), columns)


def _choice(chosen):
    """What the options say of the topics of a bag."""
    from jaxident.files.messages import Choice

    names = ("child_frame", "wheel_order", "bag_time", "pose_frames", "wheel_joints")
    return Choice(*(chosen[name] for name in names))._replace(positions=chosen["wheel_ticks"] is not None)


def _list(bag) -> None:
    from jaxident.files.bag_topics import list_topics

    rows = [
        (one.name, one.type, str(one.messages), f"{one.rate:.4g}" if one.rate > 0 else "", one.suits)
        for one in list_topics(bag)
    ]
    click.echo(table([("topic", "type", "messages", "rate [1/s]", "could be"), *rows]))

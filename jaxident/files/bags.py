"""ROS bags to streams: ROS 1, and ROS 2 as sqlite3 or MCAP, read by `rosbags` (the extra `ros`).

Messages are read one by one and nothing but their numbers is kept, so that a bag may be larger than the memory.
"""

import os
import warnings
from array import array
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Pose, Wheels
from jaxident.columns import QUATERNION, Columns, heading_of, make_columns, seconds
from jaxident.errors import InputError
from jaxident.files.bag_topics import Topic, choose_topic, open_bag, topics_of, transform_topics
from jaxident.files.bag_transforms import check_clock, read_pose_of_frame
from jaxident.files.messages import COMMANDS, POSES, WHEEL_SPEEDS, Choice, MessageReader
from jaxident.files.streams import Commands, Poses, Speeds, WheelSpeeds, merge
from jaxident.log import Log


class BagStream(NamedTuple):
    """What a topic held: times [s], columns (v, w), (u_r, u_l) or (x, y, theta), and notes, a line each."""

    t: np.ndarray
    columns: dict[str, np.ndarray]
    notes: tuple[str, ...]


def read_bag(
    path: str | os.PathLike,
    command_topic: str | None = None,
    pose_topic: str | None = None,
    *,
    wheels_topic: str | None = None,
    child_frame: str | None = None,
    frames: tuple[str, str] | None = None,
    wheel_order: tuple[str, str] | None = None,
    wheel_joints: tuple[str, str] | None = None,
    bag_time: bool = False,
    columns: Mapping[str, str] | str | None = None,
    units: Mapping[str, str | float] | None = None,
    **settings: Any,
) -> Log:
    """Read one log from two topics of a ROS bag, or three with wheel speeds (ROS 1, or ROS 2 as sqlite3 or MCAP).

    Needs the extra `ros`. What is odd about the topics is a UserWarning.

    Args:
        path: the bag.
        command_topic: of the commands. Left out, it is the only topic that looks right.
        pose_topic: of the poses, likewise.
        wheels_topic: of measured wheel speeds, JointState.
        child_frame: of a tf topic: which transform is the robot.
        frames: a fixed frame and the robot's, between which the transforms of all tf topics are composed.
        wheel_order: right and left wheel in the commands: indices (Float64MultiArray) or joint names (JointState).
        wheel_joints: names of the right and the left joint of `wheels_topic`.
        bag_time: whether the time of recording replaces the stamps of the headers.
        columns: changes to the columns v,w or u_r,u_l, x,y,theta and wheel_r,wheel_l, as in `Log.from_dataframe`.
        units: of the columns, likewise.
        **settings: period, track, pose_offset and hold_timeout, as in `merge`.

    Returns:
        Log: one run on the clock of the poses, or of the period.

    Raises:
        InputError: one line that names what is wrong, and what the bag holds.
    """
    chosen, choice = make_columns(columns, units), Choice(child_frame, wheel_order, bag_time, frames, wheel_joints)
    commands, poses, notes = read_bag_streams(path, command_topic, pose_topic, choice, chosen)
    for note in notes:
        warnings.warn(note, stacklevel=2)
    wheels = None if wheels_topic is None else read_bag_wheels(path, wheels_topic, choice, chosen)
    return merge(commands, poses, wheels=wheels, **settings)


def read_bag_streams(
    path: str | os.PathLike,
    command_topic: str | None,
    pose_topic: str | None,
    choice: Choice,
    columns: Columns | None = None,
) -> tuple[Commands, Poses, tuple[str, ...]]:
    """Commands and poses of a bag, and what is worth knowing of them, a line each; see `read_bag`."""
    with open_bag(path) as reader:
        topics = topics_of(reader)
        first, first_note = choose_topic(path, topics, command_topic, "commands")
        command = _read_topic(path, reader, first, COMMANDS, choice._replace(child_frame=None))
        if choice.frames is None:
            second, second_note = choose_topic(path, topics, pose_topic, "poses")
            pose = _read_topic(path, reader, second, POSES, choice)
        else:
            second_note = ()
            pose = BagStream(*read_pose_of_frame(path, reader, transform_topics(path, topics, pose_topic), choice))
    values = [_in_si(stream.columns, columns or {}) for stream in (command, pose)]
    kind = Speeds if "v" in values[0] else Wheels
    notes = (*first_note, *second_note, *command.notes, *pose.notes)
    seen = np.isfinite(np.stack(list(values[1].values()))).all(axis=0)
    measured = Pose(**{name: column[seen] for name, column in values[1].items()})
    return Commands(command.t, kind(*values[0].values())), Poses(pose.t[seen], measured), notes


def read_bag_wheels(path: str | os.PathLike, topic: str, choice: Choice, columns: Columns | None = None) -> WheelSpeeds:
    """The measured wheel speeds in a topic of a bag; see `read_bag`."""
    with open_bag(path) as reader:
        chosen, _ = choose_topic(path, topics_of(reader), topic, "wheel speeds")
        found = _read_topic(path, reader, chosen, WHEEL_SPEEDS, choice._replace(child_frame=None))
    return WheelSpeeds(found.t, Wheels(*_in_si(found.columns, columns or {}).values()))


def _in_si(found: dict[str, np.ndarray], columns: Columns) -> dict[str, np.ndarray]:
    """The columns as `columns` has them; those that it does not name stay as they are."""
    taken = {name: columns[name] for name in found if name in columns}
    for name, column in taken.items():
        if column.source not in found:
            raise InputError(f"columns: {name}={column.source}: the topic has the columns {', '.join(found)}")
    return found | {name: column.convert(found[column.source]) for name, column in taken.items()}


def _read_topic(
    path: Any, reader: Any, topic: Topic, readers: Mapping[str, MessageReader], choice: Choice
) -> BagStream:
    """All readings of a topic, kept as flat arrays of numbers; of one frame alone."""
    place = f"{path}: {topic.name}"
    names, read = readers[topic.type]
    stamps, values, frames, unstamped = array("q"), array("d"), set(), 0
    try:
        for connection, recorded, raw in reader.messages([c for c in reader.connections if c.topic == topic.name]):
            for one in read(reader.deserialize(raw, connection.msgtype), choice):
                frames.add(one.frame)
                if one.frame == (choice.child_frame or one.frame):
                    unstamped += not one.stamp
                    stamps.append(one.stamp if one.stamp and not choice.bag_time else recorded)
                    values.extend(one.values)
    except InputError as error:
        raise InputError(f"{place}: {error}") from None
    _check_frame(place, frames, choice.child_frame)
    if 0 < unstamped < len(stamps):
        raise InputError(
            f"{place}: {unstamped} of {len(stamps)} messages have no stamp; --bag-time takes all times from the bag"
        )
    t = seconds(np.frombuffer(stamps, np.int64))
    check_clock(place, t)
    columns = dict(zip(names, np.frombuffer(values).reshape(-1, len(names)).T.copy(), strict=True))
    return _as_stream(t, columns, topic, bool(unstamped))


def _check_frame(place: str, frames: set[str], wanted: str | None) -> None:
    """InputError where several frames move and none is chosen, or the chosen one is not there."""
    listed = ", ".join(sorted(frames))
    if wanted is None and len(frames) > 1:
        raise InputError(
            f"{place}: holds several frames; choose the robot's: --child-frame, one of {listed}, or compose them: "
            "--pose-frames"
        )
    if wanted is not None and wanted not in frames and frames != {""}:
        raise InputError(f"{place}: no child frame {wanted!r}; there are {listed}")
    if wanted is not None and frames == {""}:
        raise InputError(f"{place}: has no child frames; leave --child-frame out")


def _as_stream(t: np.ndarray, columns: dict[str, np.ndarray], topic: Topic, unstamped: bool) -> BagStream:
    """The stream with its heading, and what is worth knowing of it."""
    notes = []
    if unstamped:
        notes.append(f"{topic.name} ({topic.type}) has no stamps: its times are those at which the bag recorded it")
    if "qw" in columns:
        variance = [columns.pop(f"var_{name}") for name in Pose._fields]
        columns["theta"] = heading_of(*(columns.pop(name) for name in QUATERNION))
        known = np.sqrt([np.median(one) if np.isfinite(one).all() and (one >= 0.0).all() else 0.0 for one in variance])
        if known.any():
            x, y, theta = known
            notes.append(
                f"{topic.name} claims standard deviations of {x:.2g} m, {y:.2g} m, {theta:.2g} rad (median): compare "
                "them with the noise that `jaxident identify` finds"
            )
        if np.isnan(columns["theta"]).all():
            raise InputError(f"{topic.name}: every orientation is (0, 0, 0, 0), which is no rotation")
    return BagStream(t, columns, tuple(notes))

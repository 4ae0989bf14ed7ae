"""ROS messages to numbers: one small reader per message type, for commands and for poses.

A reader takes a message and a `Choice` and yields readings. Names of fields are those of the ROS message definitions
(geometry_msgs, nav_msgs, sensor_msgs, std_msgs, tf2_msgs), which ROS 1 and ROS 2 share.
"""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from jaxident.errors import InputError

NO_COVARIANCE = (np.nan, np.nan, np.nan)
POSE_COLUMNS = ("x", "y", "qx", "qy", "qz", "qw", "var_x", "var_y", "var_theta")
SPEED_COLUMNS, WHEEL_COLUMNS = ("v", "w"), ("u_r", "u_l")
MEASURED_COLUMNS = ("wheel_r", "wheel_l")


class Choice(NamedTuple):
    """What a topic alone does not say: the child frame of a transform, index or joint name of the right and the left
    wheel among the commands, whether the time of recording counts in place of the header's stamp, the frames between
    which transforms are composed, the robot's last, the right and the left joint among measured wheel speeds, and
    whether positions of joints are read in place of velocities."""

    child_frame: str | None = None
    wheel_order: tuple[str, str] | None = None
    bag_time: bool = False
    frames: tuple[str, str] | None = None
    wheel_joints: tuple[str, str] | None = None
    positions: bool = False


class Reading(NamedTuple):
    """Stamp [ns], 0 where there is none; numbers in the order of the reader's columns; the frame they belong to."""

    stamp: int
    values: tuple[float, ...]
    frame: str = ""


class MessageReader(NamedTuple):
    """The columns of a message type, and the function that gives its readings."""

    columns: tuple[str, ...]
    read: Callable[[Any, Choice], Iterator[Reading]]


def stamp_of(message: Any) -> int:
    """The header's stamp [ns]."""
    stamp = message.header.stamp
    return int(stamp.sec) * 10**9 + int(stamp.nanosec)


def read_twist(message: Any, choice: Choice) -> Iterator[Reading]:
    """geometry_msgs/Twist: speed along x [m/s] and turn rate about z [rad/s]; it has no stamp."""
    yield Reading(0, (message.linear.x, message.angular.z))


def read_stamped_twist(message: Any, choice: Choice) -> Iterator[Reading]:
    """geometry_msgs/TwistStamped."""
    yield Reading(stamp_of(message), (message.twist.linear.x, message.twist.angular.z))


def read_wheel_array(message: Any, choice: Choice) -> Iterator[Reading]:
    """std_msgs/Float64MultiArray: its numbers have no names, so `wheel_order` says which is right and which left."""
    if choice.wheel_order is None:
        raise InputError(f"a Float64MultiArray of {len(message.data)} does not say which number is which wheel: give "
                         "--wheel-order RIGHT,LEFT, as in --wheel-order 1,0")  # fmt: skip
    try:
        yield Reading(0, tuple(float(message.data[_index(word)]) for word in choice.wheel_order))
    except (ValueError, IndexError):
        raise InputError(f"--wheel-order {','.join(choice.wheel_order)}: should be two of the numbers 0 to "
                         f"{len(message.data) - 1} of the Float64MultiArray") from None  # fmt: skip


def _index(word: str) -> int:
    if int(word) < 0:
        raise ValueError(word)
    return int(word)


def read_joints(message: Any, choice: Choice) -> Iterator[Reading]:
    """sensor_msgs/JointState as commands: velocities of two joints, named by `wheel_order` or saying right and left."""
    yield _of_joints(message, "velocity", choice.wheel_order, "--wheel-order")


def read_measured_joints(message: Any, choice: Choice) -> Iterator[Reading]:
    """sensor_msgs/JointState as measured wheel speeds, or as positions; joints as `wheel_joints` names them."""
    field = "position" if choice.positions else "velocity"
    yield _of_joints(message, field, choice.wheel_joints, "--wheel-joints")


def _of_joints(message: Any, field: str, order: tuple[str, str] | None, option: str) -> Reading:
    joints = list(message.name)
    order = order or (_only("right", joints, option), _only("left", joints, option))
    for joint in order:
        if joint not in joints:
            raise InputError(f"{option} {','.join(order)}: no joint {joint!r}; there are {', '.join(joints)}")
    values = getattr(message, field)
    if len(values) != len(joints):
        other = "; with --wheel-ticks 6.283185 they are read from its positions [rad]" if field == "velocity" else ""
        raise InputError(f"a JointState has {len(values)} numbers of {field} for {len(joints)} joints; wheels are read "
                         f"from these{other}")  # fmt: skip
    return Reading(stamp_of(message), tuple(float(values[joints.index(joint)]) for joint in order))


def _only(side: str, joints: list[str], option: str) -> str:
    found = [joint for joint in joints if side in joint.lower()]
    if len(found) != 1:
        raise InputError(f"{len(found)} joints say {side!r} among {', '.join(joints)}: give {option} RIGHT,LEFT")
    return found[0]


def _pose(position: Any, turn: Any, variance: tuple[float, ...] = NO_COVARIANCE) -> tuple[float, ...]:
    return (position.x, position.y, turn.x, turn.y, turn.z, turn.w, *variance)


def read_pose(message: Any, choice: Choice) -> Iterator[Reading]:
    """geometry_msgs/PoseStamped."""
    yield Reading(stamp_of(message), _pose(message.pose.position, message.pose.orientation))


def read_uncertain_pose(message: Any, choice: Choice) -> Iterator[Reading]:
    """geometry_msgs/PoseWithCovarianceStamped and nav_msgs/Odometry: the variances of x, y and yaw come along."""
    variance = tuple(float(message.pose.covariance[place]) for place in (0, 7, 35))
    pose = message.pose.pose
    yield Reading(stamp_of(message), _pose(pose.position, pose.orientation, variance))


def read_transform(message: Any, choice: Choice) -> Iterator[Reading]:
    """geometry_msgs/TransformStamped."""
    moved = message.transform
    yield Reading(stamp_of(message), _pose(moved.translation, moved.rotation), message.child_frame_id)


def read_transforms(message: Any, choice: Choice) -> Iterator[Reading]:
    """tf2_msgs/TFMessage, and tf/tfMessage of old ROS 1: several transforms at once."""
    for transform in message.transforms:
        yield from read_transform(transform, choice)


class Moved(NamedTuple):
    """One transform: stamp [ns], 0 where there is none; parent and child frame; x, y, z [m], quaternion x, y, z, w."""

    stamp: int
    parent: str
    child: str
    values: tuple[float, ...]


def read_links(message: Any) -> Iterator[Moved]:
    """The transforms of a message of TRANSFORMS; frames without the slash that old ROS 1 puts before them."""
    for one in getattr(message, "transforms", [message]):
        place, turn = one.transform.translation, one.transform.rotation
        frames = one.header.frame_id.lstrip("/"), one.child_frame_id.lstrip("/")
        yield Moved(stamp_of(one), *frames, (place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w))


COMMANDS = {
    "geometry_msgs/msg/Twist": MessageReader(SPEED_COLUMNS, read_twist),
    "geometry_msgs/msg/TwistStamped": MessageReader(SPEED_COLUMNS, read_stamped_twist),
    "std_msgs/msg/Float64MultiArray": MessageReader(WHEEL_COLUMNS, read_wheel_array),
    "sensor_msgs/msg/JointState": MessageReader(WHEEL_COLUMNS, read_joints),
}
"""Readers of commands by message type."""
POSES = {
    "geometry_msgs/msg/PoseStamped": MessageReader(POSE_COLUMNS, read_pose),
    "geometry_msgs/msg/PoseWithCovarianceStamped": MessageReader(POSE_COLUMNS, read_uncertain_pose),
    "geometry_msgs/msg/TransformStamped": MessageReader(POSE_COLUMNS, read_transform),
    "tf2_msgs/msg/TFMessage": MessageReader(POSE_COLUMNS, read_transforms),
    "tf/msg/tfMessage": MessageReader(POSE_COLUMNS, read_transforms),
    "nav_msgs/msg/Odometry": MessageReader(POSE_COLUMNS, read_uncertain_pose),
}
"""Readers of poses by message type."""
WHEEL_SPEEDS = {"sensor_msgs/msg/JointState": MessageReader(MEASURED_COLUMNS, read_measured_joints)}
"""Readers of measured wheel speeds by message type."""
TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage", "geometry_msgs/msg/TransformStamped")
"""Types of messages that hold transforms."""

"""Small ROS bags of all three formats, made by `rosbags` itself."""

import numpy as np

ROS_1, SQLITE, MCAP = "ros1", "sqlite3", "mcap"
FORMATS = (ROS_1, SQLITE, MCAP)
BEGIN = 1_700_000_000 * 10**9
"""Unix time [ns] at which the bags begin."""


class Bag:
    """A bag that is written message by message; `add` takes the topic, the time of recording [ns] and the message."""

    def __init__(self, path, form):
        from rosbags import rosbag1, rosbag2
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        self.store = get_typestore(Stores.ROS1_NOETIC if form == ROS_1 else Stores.ROS2_HUMBLE)
        self.store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"))
        self.ros1, self.path, self.connections = form == ROS_1, path, {}
        plugins = {SQLITE: rosbag2.StoragePlugin.SQLITE3, MCAP: rosbag2.StoragePlugin.MCAP}
        self.writer = (
            rosbag1.Writer(path) if self.ros1 else rosbag2.Writer(path, version=9, storage_plugin=plugins[form])
        )
        self.writer.open()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.writer.close()

    def topic(self, name, kind):
        """Make a topic, which may stay without messages."""
        if name not in self.connections:
            self.connections[name] = self.writer.add_connection(name, kind, typestore=self.store)
        return self.connections[name]

    def add(self, name, recorded, message):
        """Write one message."""
        kind = message.__msgtype__
        connection = self.topic(name, kind)
        raw = self.store.serialize_ros1(message, kind) if self.ros1 else self.store.serialize_cdr(message, kind)
        self.writer.write(connection, int(recorded), raw)

    def make(self, kind, *fields):
        """A message of a type by its name without `msg`, as in geometry_msgs/Twist."""
        package, name = kind.split("/")
        return self.store.types[f"{package}/msg/{name}"](*fields)

    def header(self, stamp, frame="map"):
        """A header with a stamp [ns]."""
        time = self.make("builtin_interfaces/Time", int(stamp) // 10**9, int(stamp) % 10**9)
        return self.make("std_msgs/Header", *((0,) if self.ros1 else ()), time, frame)

    def twist(self, v, w):
        """geometry_msgs/Twist."""
        vector = [self.make("geometry_msgs/Vector3", *part) for part in ((v, 0.0, 0.0), (0.0, 0.0, w))]
        return self.make("geometry_msgs/Twist", *vector)

    def pose(self, x, y, theta):
        """geometry_msgs/Pose of a robot on the floor."""
        turn = self.make("geometry_msgs/Quaternion", 0.0, 0.0, np.sin(0.5 * theta), np.cos(0.5 * theta))
        return self.make("geometry_msgs/Pose", self.make("geometry_msgs/Point", x, y, 0.0), turn)

    def transform(self, stamp, child, x, y, theta, parent="map"):
        """geometry_msgs/TransformStamped."""
        pose = self.pose(x, y, theta)
        place = self.make("geometry_msgs/Vector3", x, y, 0.0)
        moved = self.make("geometry_msgs/Transform", place, pose.orientation)
        return self.make("geometry_msgs/TransformStamped", self.header(stamp, parent), child, moved)

    def covered(self, pose, variances):
        """geometry_msgs/PoseWithCovariance with variances of x, y and yaw."""
        covariance = np.zeros(36)
        covariance[[0, 7, 35]] = variances
        return self.make("geometry_msgs/PoseWithCovariance", pose, covariance)


def name_of(folder, form):
    """Where a bag of a format is written."""
    return folder / {ROS_1: "run.bag", SQLITE: "run_sqlite3", MCAP: "run_mcap"}[form]

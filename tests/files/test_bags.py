"""ROS bags of all three formats, made by `rosbags`: what is read, what is said of it, and what is refused."""

import tracemalloc
import warnings

import numpy as np
import pytest
from support.bags import BEGIN, FORMATS, MCAP, ROS_1, SQLITE, Bag, name_of

import jaxident as ji
from jaxident.columns import parse_columns
from jaxident.errors import InputError
from jaxident.files.bag_topics import list_topics
from jaxident.files.bags import read_bag, read_bag_streams, read_bag_wheels
from jaxident.files.logs import read_log, write_log
from jaxident.files.messages import Choice
from jaxident.files.streams import merge, read_commands, read_poses

pytest.importorskip("rosbags", reason="rosbags is not installed (extra ros)")

COMMAND_AT = BEGIN + 200_000_007 * np.arange(25)
POSE_AT = BEGIN + 1_000_003 + 33_333_333 * np.arange(150)
RNG = np.random.default_rng(3)
V, W = RNG.uniform(-0.3, 0.3, 25), RNG.uniform(-1, 1, 25)
X, Y, THETA = np.round(RNG.normal(size=(3, 150)), 6)
LATE = 5_000_000
"""From stamp to recording [ns]."""


def add_poses(bag, kind):
    """Every pose as a message of a kind, on /pose."""
    for stamp, *pose in zip(POSE_AT, X, Y, THETA, strict=True):
        flat = bag.pose(*pose)
        if kind == "PoseStamped":
            message = bag.make("geometry_msgs/PoseStamped", bag.header(stamp), flat)
        elif kind == "PoseWithCovarianceStamped":
            message = bag.make("geometry_msgs/PoseWithCovarianceStamped", bag.header(stamp),
                               bag.covered(flat, (4e-6, 9e-6, 1e-4)))  # fmt: skip
        elif kind == "Odometry":
            twist = bag.make("geometry_msgs/TwistWithCovariance", bag.twist(0.0, 0.0), np.zeros(36))
            message = bag.make("nav_msgs/Odometry", bag.header(stamp), "base", bag.covered(flat, (0, 0, 0)), twist)
        elif kind == "TransformStamped":
            message = bag.transform(stamp, "base", *pose)
        else:
            others = bag.transform(stamp, "camera", 0.0, 0.0, 0.0), bag.transform(stamp, "base", *pose)
            message = bag.make("tf2_msgs/TFMessage", list(others))
        bag.add("/pose", stamp + LATE, message)


def add_commands(bag, kind):
    """Every command as a message of a kind, on /cmd."""
    for stamp, v, w in zip(COMMAND_AT, V, W, strict=True):
        if kind == "Twist":
            bag.add("/cmd", stamp, bag.twist(v, w))
        elif kind == "TwistStamped":
            bag.add("/cmd", stamp + LATE, bag.make("geometry_msgs/TwistStamped", bag.header(stamp), bag.twist(v, w)))
        elif kind == "JointState":
            message = bag.make("sensor_msgs/JointState", bag.header(stamp), ["arm", "wheel_left", "wheel_right"],
                               np.zeros(3), np.array([0.0, w, v]), np.zeros(0))  # fmt: skip
            bag.add("/cmd", stamp + LATE, message)
        else:
            layout = bag.make("std_msgs/MultiArrayLayout", [], 0)
            bag.add("/cmd", stamp, bag.make("std_msgs/Float64MultiArray", layout, np.array([w, v])))


def write_bag(path, form, command="TwistStamped", pose="PoseStamped"):
    """A whole bag; its path."""
    with Bag(path, form) as bag:
        add_commands(bag, command)
        add_poses(bag, pose)
        bag.topic("/rosout", "std_msgs/msg/String")
    return path


@pytest.fixture(scope="module", params=FORMATS)
def bag(request, tmp_path_factory):
    return write_bag(name_of(tmp_path_factory.mktemp("bags"), request.param), request.param)


def quietly(*args, **settings):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return read_bag(*args, **settings)


def same(first, second):
    return all(np.array_equal(a, b, equal_nan=True) for a, b in zip(first, second, strict=True))


def seconds(at):
    """Decimal seconds of whole nanoseconds, as text."""
    return [f"{stamp // 10**9}.{stamp % 10**9:09d}" for stamp in at.tolist()]


def test_a_bag_a_frame_and_a_foreign_csv_of_one_run_are_one_log(bag, tmp_path):
    """To the last digit: the files hold dates, whole micrometres, semicolons and quaternions."""
    log = ji.read_bag(bag, "/cmd", "/pose", track=0.26)
    columns = (np.sin(0.5 * THETA).tolist(), np.cos(0.5 * THETA).tolist(), 1e6 * X, 1e6 * Y)
    dates = [f"{np.datetime64(stamp, 'ns')}Z" for stamp in POSE_AT.tolist()]
    lines = [f"{t};0;0;{z!r};{w!r};{x:.0f};{y:.0f}" for t, z, w, x, y in zip(dates, *columns, strict=True)]
    text = "stamp;qx;qy;qz;qw;X;Y\n" + "\n".join(lines)
    (tmp_path / "p.csv").write_text(text)
    rows = zip(seconds(COMMAND_AT), V.tolist(), W.tolist(), strict=True)
    (tmp_path / "c.csv").write_text("v,w,t\n" + "\n".join(f"{v!r},{w!r},{t}" for t, v, w in rows))
    poses = read_poses(tmp_path / "p.csv", parse_columns("t=stamp,x=X:um,y=Y:um"))
    foreign = merge(read_commands(tmp_path / "c.csv"), poses, track=0.26)
    assert same(log, foreign)
    write_log(log, tmp_path / "log.csv")
    assert same(read_log(tmp_path / "log.csv"), log)
    frame = {"time": log.t, "right": log.u_r, "left": log.u_l, "x": log.x, "y": log.y, "yaw": log.theta}
    assert same(ji.Log.from_dataframe(frame, "t=time,u_r=right,u_l=left,theta=yaw"), log)
    np.testing.assert_allclose(log.x[np.isfinite(log.x)], X, rtol=0)


def test_topics_are_listed(bag):
    topics = {topic.name: topic for topic in list_topics(bag)}
    assert topics["/cmd"][1:3] == ("geometry_msgs/msg/TwistStamped", 25)
    assert (topics["/cmd"].suits, topics["/pose"].suits, topics["/rosout"].suits) == ("commands", "poses", "")
    assert topics["/pose"].rate == pytest.approx(30, rel=0.05)


@pytest.mark.parametrize("pose", ["PoseWithCovarianceStamped", "Odometry", "TransformStamped", "TFMessage"])
@pytest.mark.parametrize("form", [ROS_1, MCAP])
def test_every_pose_type_gives_the_same_poses(tmp_path, form, pose):
    path = write_bag(name_of(tmp_path, form), form, pose=pose)
    choice = Choice(child_frame="base") if pose == "TFMessage" else Choice()
    _, poses, notes = read_bag_streams(path, None, None, choice)
    np.testing.assert_allclose(poses.pose, [X, Y, np.angle(np.exp(1j * THETA))], atol=1e-14)
    np.testing.assert_array_equal(poses.t, [float(text) for text in seconds(POSE_AT)])
    claims = [note for note in notes if "claims standard deviations of 0.002 m, 0.003 m, 0.01 rad" in note]
    assert len(claims) == (pose == "PoseWithCovarianceStamped")


@pytest.mark.parametrize("form", [ROS_1, SQLITE])
@pytest.mark.parametrize("command", ["Twist", "JointState", "Float64MultiArray"])
def test_every_command_type_gives_the_same_commands(tmp_path, form, command):
    path = write_bag(name_of(tmp_path, form), form, command=command)
    order = ("1", "0") if command == "Float64MultiArray" else None
    commands, _, notes = read_bag_streams(path, None, None, Choice(wheel_order=order))
    np.testing.assert_array_equal(commands.value, [V, W])
    np.testing.assert_array_equal(commands.t, [float(text) for text in seconds(COMMAND_AT)])
    assert any("has no stamps: its times are those at which the bag recorded it" in note for note in notes) == (
        command != "JointState"
    )


def test_measured_wheel_speeds_are_a_third_topic(tmp_path):
    path = name_of(tmp_path, MCAP)
    with Bag(path, MCAP) as bag:
        add_commands(bag, "TwistStamped")
        add_poses(bag, "PoseStamped")
        for stamp, v, w in zip(COMMAND_AT, V, W, strict=True):
            message = bag.make("sensor_msgs/JointState", bag.header(stamp), ["fl", "fr"],
                               np.array([2.0 * w, 3.0 * v]), np.array([w, v]), np.zeros(0))  # fmt: skip
            bag.add("/joint_states", stamp + LATE, message)
    found = read_bag_wheels(path, "/joint_states", Choice(wheel_joints=("fr", "fl")))
    np.testing.assert_array_equal(found.speed, [V, W])
    counts = read_bag_wheels(path, "/joint_states", Choice(wheel_joints=("fr", "fl"), positions=True))
    np.testing.assert_array_equal(counts.speed, [3.0 * np.array(V), 2.0 * np.array(W)])
    np.testing.assert_array_equal(found.t, [float(text) for text in seconds(COMMAND_AT)])
    log = quietly(path, "/cmd", "/pose", wheels_topic="/joint_states", wheel_joints=("fr", "fl"), track=0.3)
    np.testing.assert_array_equal(log.wheel_r[np.isfinite(log.wheel_r)], V)
    with pytest.raises(InputError, match="0 joints say 'right' among fl, fr: give --wheel-joints RIGHT,LEFT"):
        read_bag_wheels(path, "/joint_states", Choice())
    with pytest.raises(InputError, match="of which no wheel speeds are read"):
        read_bag_wheels(path, "/cmd", Choice())


def test_times_of_recording_if_asked_for(tmp_path):
    path = write_bag(name_of(tmp_path, MCAP), MCAP)
    stamped, recorded = (read_bag_streams(path, "/cmd", "/pose", Choice(bag_time=late)) for late in (False, True))
    np.testing.assert_allclose(recorded[1].t - stamped[1].t, 1e-9 * LATE, atol=3e-7)


def test_units_and_signs_of_a_bag(tmp_path):
    path = write_bag(name_of(tmp_path, MCAP), MCAP)
    plain, turned = (quietly(path, track=0.26, columns=text) for text in ("", "x=y,y=x:mm,w=w:-1"))
    np.testing.assert_array_equal(turned.x, plain.y)
    np.testing.assert_array_equal(turned.y, plain.x / 1000)
    np.testing.assert_array_equal(turned.u_r, plain.u_l)


@pytest.mark.parametrize(
    ("command", "pose", "settings", "reason"),
    [
        ("Twist", "TFMessage", {}, "/pose: holds several frames; .* --child-frame, one of base, camera"),
        ("Twist", "TFMessage", {"child_frame": "b"}, "/pose: no child frame 'b'; there are base, camera"),
        ("Twist", "PoseStamped", {"child_frame": "b"}, "/pose: has no child frames"),
        ("Twist", "PoseStamped", {"command_topic": "/x"}, "no topic '/x'; there are /cmd .geometry_msgs"),
        ("Twist", "PoseStamped", {"command_topic": "/pose"}, "/pose has the type geometry_msgs/msg/PoseStamped, of"),
        ("Twist", "PoseStamped", {"pose_topic": "/rosout"}, "/rosout has the type std_msgs/msg/String, of"),
        ("Float64MultiArray", "PoseStamped", {}, "/cmd: a Float64MultiArray of 2 does not say .* --wheel-order 1,0"),
        ("Float64MultiArray", "PoseStamped", {"wheel_order": ("2", "0")}, "--wheel-order 2,0: should be two of"),
        ("JointState", "PoseStamped", {"wheel_order": ("r", "l")}, "no joint 'r'; there are arm, wheel_left"),
        ("Twist", "PoseStamped", {"columns": "t=t:ms,x=z"}, "x=z: the topic has the columns x, y, theta"),
    ],
)  # fmt: skip
def test_a_wrong_choice_is_named(tmp_path, command, pose, settings, reason):
    path = write_bag(name_of(tmp_path, MCAP), MCAP, command, pose)
    with pytest.raises(InputError, match=reason) as caught:
        quietly(path, **{"track": 0.26, **settings})
    assert "\n" not in str(caught.value)


def test_several_topics_that_look_right_are_listed(tmp_path):
    with Bag(tmp_path / "two", SQLITE) as bag:
        add_commands(bag, "Twist")
        bag.add("/teleop", BEGIN, bag.twist(0.0, 0.0))
    with pytest.raises(InputError, match="--command-topic is needed; topics that could be commands: /cmd, /teleop"):
        read_bag(tmp_path / "two")
    with pytest.raises(InputError, match="--pose-topic is needed; topics that could be poses: none"):
        read_bag(tmp_path / "two", "/cmd")


@pytest.mark.parametrize("form", FORMATS)
def test_a_clock_that_goes_back_is_named(tmp_path, form):
    with Bag(name_of(tmp_path, form), form) as bag:
        add_commands(bag, "Twist")
        for k, stamp in enumerate([5, 6, 7, 1, 2]):
            message = bag.make("geometry_msgs/PoseStamped", bag.header(stamp * 10**9), bag.pose(0.0, 0.0, 0.0))
            bag.add("/pose", BEGIN + k * 10**9, message)
    with pytest.raises(
        InputError, match="/pose: the clock goes back from 7 to 1 s at message 3: a simulation that was"
    ):
        quietly(name_of(tmp_path, form), track=0.26)


@pytest.mark.parametrize("form", FORMATS)
def test_no_bag_empty_and_cut_bags_are_refused(tmp_path, form):
    path = name_of(tmp_path, form)
    with pytest.raises(InputError, match="no such file or folder"):
        list_topics(path)
    with Bag(path, form):
        pass
    with pytest.raises(InputError, match=r"--command-topic is needed; .* there are none at all|is no bag that can be"):
        read_bag(path)
    (tmp_path / "full").mkdir()
    full = write_bag(name_of(tmp_path / "full", form), form)
    file = full if form == ROS_1 else next(one for one in full.iterdir() if one.suffix in (".db3", ".mcap"))
    content = file.read_bytes()
    for size in (0, 100, len(content) // 2):
        file.write_bytes(content[:size])
        with pytest.raises(InputError, match="is no bag that can be read") as caught:
            quietly(full, track=0.26)
        assert "\n" not in str(caught.value)


def test_an_encrypted_bag_is_named(tmp_path):
    """A ROS 1 bag says in its first record what encrypts it; the record is filled up with blanks to 4096 bytes."""
    path = write_bag(name_of(tmp_path, ROS_1), ROS_1)
    content = path.read_bytes()
    begin = len(b"#ROSBAG V2.0\n")
    length = int.from_bytes(content[begin : begin + 4], "little")
    header, rest = content[begin + 4 : begin + 4 + length], content[begin + 4 + length :]
    filled = int.from_bytes(rest[:4], "little")
    entry = b"encryptor=rosbag/AesCbcEncryptor"
    header += len(entry).to_bytes(4, "little") + entry
    less = len(entry) + 4
    sizes = len(header).to_bytes(4, "little"), (filled - less).to_bytes(4, "little")
    path.write_bytes(content[:begin] + sizes[0] + header + sizes[1] + rest[4 + less :])
    with pytest.raises(InputError, match=r"is no bag that can be read .*encryption.*; decrypt it"):
        list_topics(path)


def test_a_file_that_is_no_bag(tmp_path):
    (tmp_path / "x.csv").write_text("t,x\n")
    for path in (tmp_path, tmp_path / "x.csv"):
        with pytest.raises(InputError, match="is no bag that can be read"):
            list_topics(path)


@pytest.mark.parametrize("form", FORMATS)
def test_what_nobody_asked_for_is_not_kept(tmp_path, form):
    """60 pictures of 1 MB each lie between the messages; reading takes the memory of a few."""
    path = name_of(tmp_path, form)
    with Bag(path, form) as bag:
        add_commands(bag, "Twist")
        for k, stamp in enumerate(POSE_AT[:60]):
            picture = np.full(1_000_000, k, np.uint8)
            header = bag.header(stamp)
            bag.add("/image", stamp, bag.make("sensor_msgs/Image", header, 1000, 1000, "mono8", 0, 1000, picture))
        add_poses(bag, "PoseStamped")
    tracemalloc.start()
    read_bag_streams(path, "/cmd", "/pose", Choice())
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 15e6

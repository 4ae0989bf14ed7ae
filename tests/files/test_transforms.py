"""Chains of coordinate frames, in arrays and in bags of all three formats."""

import numpy as np
import pytest
from support.bags import BEGIN, FORMATS, Bag, name_of
from support.program import jaxident

from jaxident.errors import InputError
from jaxident.files.bags import read_bag
from jaxident.files.logs import read_log
from jaxident.files.transforms import Link, find_chain, follow_chain, multiply, rotate, transform_at

RNG = np.random.default_rng(6)
MOVED, SLOW = 1e-2 * np.arange(200), 0.05 + 0.3 * np.arange(6)
"""Times [s] of odom -> base_link, and of map -> odom, which ends before the others."""


def turn_about_z(theta):
    theta = np.atleast_1d(theta)
    return np.stack([0 * theta, 0 * theta, np.sin(0.5 * theta), np.cos(0.5 * theta)], axis=1)


def flat_link(t, x, y, theta, fixed=False):
    x, y, theta, t = np.broadcast_arrays(x, y, theta, t)
    return Link(np.atleast_1d(t), np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3), turn_about_z(theta), fixed)


def drift(t):
    """map -> odom: linear in time, so that interpolating is exact."""
    return 0.4 - 0.1 * t, 0.2 * t, 0.3 + 0.2 * t


def driven(t):
    """odom -> base_link."""
    return np.sin(t), 0.5 * t, 2.0 * t


def composed(t):
    """map -> base_link, by hand."""
    a, b, c = drift(t)
    x, y, theta = driven(t)
    return a + x * np.cos(c) - y * np.sin(c), b + x * np.sin(c) + y * np.cos(c), c + theta


LINKS = {
    ("odom", "base_link"): flat_link(MOVED, *driven(MOVED)),
    ("map", "odom"): flat_link(SLOW, *drift(SLOW)),
    ("base_link", "marker"): flat_link(0.0, 0.1, 0.0, np.pi / 2, fixed=True),
    ("camera", "table"): flat_link(MOVED, 0.0, 0.0, 0.0),
}


def wrapped(angle):
    return (angle + np.pi) % (2 * np.pi) - np.pi


def headings(turn):
    return 2.0 * np.arctan2(turn[:, 2], turn[:, 3])


def test_a_chain_is_composed_at_the_stamps_of_its_last_link():
    made = follow_chain(LINKS, "map", "base_link")
    inside = (SLOW[0] <= MOVED) & (SLOW[-1] >= MOVED)
    np.testing.assert_array_equal(made.t, MOVED[inside])
    assert (made.own, made.left_out) == (("odom", "base_link"), int(np.sum(~inside)))
    x, y, theta = composed(made.t)
    np.testing.assert_allclose(made.x, x, atol=1e-12)
    np.testing.assert_allclose(made.y, y, atol=1e-12)
    np.testing.assert_allclose(wrapped(headings(made.turn) - theta), 0.0, atol=1e-12)


def test_static_links_count_at_any_time_and_a_chain_goes_both_ways():
    """The marker sits 0.1 m ahead; seen from it, the map moves the other way."""
    base, marker = (follow_chain(LINKS, "map", frame) for frame in ("base_link", "marker"))
    heading = headings(base.turn)
    np.testing.assert_allclose(marker.x, base.x + 0.1 * np.cos(heading), atol=1e-12)
    np.testing.assert_allclose(wrapped(headings(marker.turn) - heading), np.pi / 2, atol=1e-12)
    back = follow_chain(LINKS, "marker", "map")
    assert back.own == ("map", "odom")
    there = follow_chain(LINKS, "map", "marker")
    rows = np.searchsorted(there.t, back.t[:-1])
    np.testing.assert_allclose(there.t[rows], back.t[:-1], atol=1e-12)
    np.testing.assert_allclose(wrapped(headings(back.turn[:-1]) + headings(there.turn[rows])), 0.0, atol=1e-9)


def test_quaternions_agree_with_matrices():
    def matrix(q):
        x, y, z, w = q
        return np.array([
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ])  # fmt: skip

    a, b = RNG.normal(size=(2, 5, 4))
    a, b = (q / np.linalg.norm(q, axis=1, keepdims=True) for q in (a, b))
    v = RNG.normal(size=(5, 3))
    for k in range(5):
        np.testing.assert_allclose(rotate(a, v)[k], matrix(a[k]) @ v[k], atol=1e-12)
        np.testing.assert_allclose(matrix(multiply(a, b)[k]), matrix(a[k]) @ matrix(b[k]), atol=1e-12)


def test_turns_are_interpolated_along_the_shorter_arc_whatever_their_sign():
    link = Link(np.array([0.0, 1.0]), np.zeros((2, 3)), turn_about_z([3.0, 3.6]) * [[1.0], [-1.0]], False)
    _, turn = transform_at(link, np.array([0.0, 0.25, 1.0]))
    np.testing.assert_allclose(wrapped(headings(turn) - [3.0, 3.15, 3.6]), 0.0, atol=1e-12)
    same = Link(np.array([0.0, 1.0]), np.zeros((2, 3)), turn_about_z([1.0, 1.0]), False)
    np.testing.assert_allclose(headings(transform_at(same, np.array([0.5]))[1]), 1.0, atol=1e-12)


def test_what_makes_no_chain_is_refused():
    with pytest.raises(InputError, match=r"no chain .* from 'map' to 'table'; there are base_link -> marker, camera"):
        follow_chain(LINKS, "map", "table")
    with pytest.raises(InputError, match=r"no chain .* 'map' to 'map'"):
        find_chain(list(LINKS), "map", "map")
    with pytest.raises(InputError, match="nothing moves between 'base_link' and 'marker'"):
        follow_chain(LINKS, "base_link", "marker")
    late = LINKS | {("map", "odom"): flat_link(SLOW + 100.0, *drift(SLOW))}
    with pytest.raises(InputError, match=r"share no time: map -> odom from 100\.05 to"):
        follow_chain(late, "map", "base_link")


@pytest.fixture(scope="module", params=FORMATS)
def bag(request, tmp_path_factory):
    """A bag with wheels' odometry in tf, a localisation above it, a static marker, and commands."""
    pytest.importorskip("rosbags", reason="rosbags is not installed (extra ros)")
    path = name_of(tmp_path_factory.mktemp("tf"), request.param)
    sent = []
    for pair, link in LINKS.items():
        topic = "/tf_static" if link.fixed else "/tf"
        for t, place, turn in zip(link.t, link.place, headings(link.turn), strict=True):
            sent.append((BEGIN + round(1e9 * float(t)), topic, pair, (float(place[0]), float(place[1]), float(turn))))
    with Bag(path, request.param) as made:
        for k in range(20):
            made.add("/cmd_vel", BEGIN + 10**8 * k, made.twist(0.1 * k, 0.0))
        for stamp, topic, (parent, child), pose in sorted(sent):
            message = made.make("tf2_msgs/TFMessage", [made.transform(stamp, child, *pose, parent=parent)])
            made.add(topic, stamp + 10**6, message)
    return path


@pytest.mark.filterwarnings("ignore:.*stamps")
def test_a_bag_gives_the_composed_pose(bag):
    log = read_bag(bag, "/cmd_vel", frames=("map", "/base_link"), track=0.3)
    seen = np.isfinite(log.x)
    t = log.t[seen] - 1e-9 * BEGIN
    assert seen.sum() == np.sum((SLOW[0] <= MOVED) & (SLOW[-1] >= MOVED))
    for found, right in zip(log.pose, composed(t), strict=True):
        error = found[seen] - right
        np.testing.assert_allclose(wrapped(error), 0.0, atol=1e-6)  # stamps in Unix time tell 2e-7 s


def test_the_command_says_what_it_composed_and_which_frames_there_are(bag, tmp_path):
    words = ("convert", "--bag", str(bag), "--track", "0.3", "--out", "log.csv")
    made = jaxident(*words, "--pose-frames", "map,marker", cwd=tmp_path)
    assert made.returncode == 0, made
    line = "marker in map from map -> odom, odom -> base_link, base_link -> marker (static), at the 151 stamps of odom"
    assert line in made.stdout
    assert "map -> odom interpolated there; 49 stamps left out" in made.stdout
    assert np.isfinite(read_log(tmp_path / "log.csv").x).sum() == 151
    for more, told in (
        (("--pose-frames", "map,table"), "no chain of transforms leads from 'map' to 'table'; there are base_link ->"),
        (("--pose-frames", "map,base_link", "--pose-topic", "/cmd_vel"), "/cmd_vel holds no transforms"),
        (("--pose-frames", "map"), "should be two frames, the robot's last"),
        (("--pose-frames", "map,marker", "--child-frame", "marker"), "leave --child-frame out"),
        (("--pose-topic", "/tf"), "or compose them: --pose-frames"),
    ):
        ended = jaxident(*words, *more, cwd=tmp_path)
        assert (ended.returncode, told in ended.stderr) == (2, True), ended

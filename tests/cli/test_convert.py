"""`jaxident convert` as a user runs it: own names and units, bags, offsets, and what looks wrong."""

import re

import numpy as np
import pytest
from support.bags import BEGIN, FORMATS, Bag, name_of
from support.program import jaxident, refused

import jaxident as ji
from jaxident.estimation.suspicions.log_suspicions import log_suspicions
from jaxident.files.logs import read_log, write_log
from jaxident.log import join

ROWS, PERIOD, TRACK = 600, 1 / 30, 0.3
LATE = 0.25
"""Stamps of the poses are late by this [s]."""


@pytest.fixture(scope="module")
def run():
    """A robot that turns and drives under random levels: speeds told and poses."""
    draw = np.random.default_rng(2)
    u = np.repeat(draw.uniform(-1.0, 1.0, (ROWS // 10, 2)), 10, axis=0)
    log = ji.make_log(PERIOD * np.arange(ROWS), *u.T)
    speed, turn = np.zeros(ROWS), np.zeros(ROWS)
    for k in range(1, ROWS):
        speed[k] = 0.8 * speed[k - 1] + 0.2 * 0.5 * u[k - 1].sum()
        turn[k] = 0.8 * turn[k - 1] + 0.2 * (u[k - 1, 0] - u[k - 1, 1]) / TRACK
    theta = np.cumsum(turn) * PERIOD
    x, y = (np.cumsum(speed * side(theta)) * PERIOD for side in (np.cos, np.sin))
    noise = draw.normal(size=(3, ROWS)) * np.array([[1e-3], [1e-3], [5e-3]])
    return log._replace(x=x + noise[0], y=y + noise[1], theta=theta + noise[2])


def write_streams(folder, log, late=0.0, scale=1.0):
    """Commands v,w and poses with names and units of their own."""
    v, w = 0.5 * (log.u_r + log.u_l), (log.u_r - log.u_l) / TRACK
    rows = "\n".join(f"{t:.6f},{a!r},{b!r}" for t, a, b in zip(log.t, v.tolist(), w.tolist(), strict=True))
    (folder / "c.csv").write_text(f"t,v,w\n{rows}\n")
    poses = zip(1e3 * (log.t + late), scale * 1e3 * log.x, scale * 1e3 * log.y, np.degrees(log.theta), strict=True)
    rows = "\n".join(";".join(f"{value:.9f}".replace(".", ",") for value in row) for row in poses)
    (folder / "p.csv").write_text(f"time_ms;X;Y;yaw\n{rows}\n")


OWN = "--pose-columns", "t=time_ms:ms,x=X:mm,y=Y:mm,theta=yaw:deg"


def test_own_names_and_units(tmp_path, run):
    write_streams(tmp_path, run)
    made = jaxident("convert", "--commands", "c.csv", "--poses", "p.csv", *OWN, "--track", TRACK, "--out", "log.csv",
                    cwd=tmp_path)  # fmt: skip
    assert (made.returncode, made.stderr) == (0, "")
    log = read_log(tmp_path / "log.csv")
    np.testing.assert_allclose(np.stack(tuple(log)[:6]), np.stack(tuple(run)[:6]), atol=1e-6)


def test_an_offset_is_said_and_found(tmp_path, run):
    write_streams(tmp_path, run, late=LATE)
    words = ("convert", "--commands", "c.csv", "--poses", "p.csv", *OWN, "--track", TRACK, "--out", "log.csv")
    told = jaxident(*words, cwd=tmp_path)
    assert told.returncode == 0
    assert re.search(r"warning: the robot answers .* late: .*`jaxident convert --pose-offset -0\.2", told.stderr)
    found = jaxident(*words, "--pose-offset", "auto", cwd=tmp_path)
    assert (found.returncode, found.stderr) == (0, "")
    offset, error = re.search(r"--pose-offset (\S+) \(standard error (\S+) s", found.stdout).groups()
    # the simulated robot moves in whole rows: its speed follows a command half a row early
    assert abs(float(offset) + LATE) < 5 * float(error) + 0.5 * PERIOD
    refused(jaxident(*words, "--pose-offset", "later", cwd=tmp_path), "neither a time in seconds nor auto")


def test_what_looks_wrong_is_said_with_the_option_that_mends_it(tmp_path, run):
    write_streams(tmp_path, run, scale=1e3)
    words = ("convert", "--commands", "c.csv", "--poses", "p.csv", *OWN, "--track", TRACK, "--out", "log.csv",
             "--command-columns", "w=w:-1")  # fmt: skip
    told = jaxident(*words, cwd=tmp_path).stderr
    assert (
        "right and left are swapped (`--columns w=w`), or y points down (`--columns y=Y:-0.001,theta=yaw:-0.01" in told
    )
    assert "than metres: `--columns x=X:um,y=Y:um` (then 0.15 m) or" in told


def test_the_option_that_is_told_mends_a_file_of_other_words(tmp_path, run):
    """It stands in the place of the one that was given, and is whole."""
    rows = np.column_stack([1e3 * run.t, run.u_r, run.u_l, 1e3 * run.x, -1e3 * run.y, np.degrees(run.theta)])
    head = "time_ms,right,left,X,Y,yaw"
    np.savetxt(tmp_path / "own.csv", rows, delimiter=",", header=head, comments="", fmt="%.9f")
    given = "t=time_ms:ms,u_r=right,u_l=left,x=X:mm,y=Y:mm,theta=yaw:deg"
    told = jaxident("convert", "--log", "own.csv", "--columns", given, "--out", "log.csv", cwd=tmp_path).stderr
    option = re.search(r"y axis points down: `--columns (\S+)`", told)[1]
    made = jaxident("convert", "--log", "own.csv", "--columns", option, "--out", "log.csv", cwd=tmp_path)
    assert (made.returncode, made.stderr) == (0, "")
    np.testing.assert_allclose(np.stack(tuple(read_log(tmp_path / "log.csv"))[:6]), np.stack(tuple(run)[:6]), atol=1e-8)


def test_times_in_another_unit_are_refused(tmp_path, run):
    write_log(run._replace(t=1e3 * run.t), tmp_path / "log.csv")
    made = jaxident("convert", "--log", "log.csv", "--out", "mended.csv", cwd=tmp_path)
    refused(made, "`--columns t=t:ms` takes them for ms")
    assert not (tmp_path / "mended.csv").exists()


@pytest.mark.parametrize("form", FORMATS)
def test_a_bag(tmp_path, run, form):
    pytest.importorskip("rosbags", reason="rosbags is not installed (extra ros)")
    path = name_of(tmp_path, form)
    with Bag(path, form) as bag:
        for k, at in enumerate(np.round(1e9 * run.t).astype(np.int64) + BEGIN):
            v, w = 0.5 * (run.u_r[k] + run.u_l[k]), (run.u_r[k] - run.u_l[k]) / TRACK
            bag.add("/cmd_vel", at, bag.twist(v, w))
            pose = bag.pose(float(run.x[k]), float(run.y[k]), float(run.theta[k]))
            bag.add("/pose", at, bag.make("geometry_msgs/PoseStamped", bag.header(at), pose))
    words = ("convert", "--bag", path, "--command-topic", "/cmd_vel", "--pose-topic", "/pose", "--track", TRACK)
    made = jaxident(*words, "--out", tmp_path / "log.csv")
    assert (made.returncode, made.stderr) == (0, "")
    assert "/cmd_vel (geometry_msgs/msg/Twist) has no stamps" in made.stdout
    assert f"{ROWS} rows, {ROWS} with a pose" in made.stdout
    listed = jaxident("convert", "--bag", path, "--list").stdout
    assert re.search(r"/cmd_vel +geometry_msgs/msg/Twist +600 +30.* commands", listed)
    refused(jaxident(*words, "--out", tmp_path), "is a folder; give the name of a file")


def test_wrong_use(tmp_path, run):
    write_streams(tmp_path, run)
    both = ("--commands", "c.csv", "--poses", "p.csv")
    for words, told in (
        ((), "give --commands CSV --poses CSV, or --bag PATH"),
        (("--commands", "c.csv"), "or --bag PATH"),
        ((*both, "--bag", "x.bag"), "or --bag PATH"),
        ((*both, "--list"), "--list shows the topics of --bag"),
        (both, "--out"),
        ((*both, "--out", "log.csv"), "no column t in the header 'time_ms,X,Y,yaw'"),
        ((*both, "--pose-columns", "t=stamp", "--out", "log.csv"), "no column 'stamp' for t; there are time_ms, X"),
        ((*both, "--columns", "x=X:miles", "--out", "log.csv"), "unknown unit 'miles'; it should be m, cm, mm"),
        ((*both, "--wheel-order", "1", "--out", "log.csv"), "should be two indices or joint names"),
        (("--bag", "none.bag", "--out", "log.csv"), "none.bag: no such file or folder"),
    ):
        refused(jaxident("convert", *words, cwd=tmp_path), told)
    assert not (tmp_path / "log.csv").exists()


def test_an_error_about_the_log_tells_the_option_for_the_users_names(tmp_path, run):
    write_log(run._replace(t=1e3 * run.t), tmp_path / "log.csv")
    text = (tmp_path / "log.csv").read_text()
    (tmp_path / "log.csv").write_text(text.replace("t,", "time of day,", 1))
    for words in (
        ("convert", "--log", "log.csv", "--out", "new.csv"),
        ("identify", "log.csv"),
        ("diagnose", "log.csv"),
    ):
        made = jaxident(*words, "--columns", "t=time of day", cwd=tmp_path)
        refused(made, "`--columns 't=time of day:ms'` takes them for ms")


def test_a_log_of_another_program_is_identified(tmp_path, run):
    """Its names and units are given; what is wrong with it is told in its own names."""
    head = "stamp,right,left,X,Y,yaw\n"
    columns = (1e3 * run.t, run.u_l, run.u_r, run.x, run.y, run.theta)
    rows = "\n".join(",".join(map(repr, map(float, row))) for row in zip(*columns, strict=True))
    (tmp_path / "own.csv").write_text(head + rows)
    found = jaxident("identify", "own.csv", "--columns", "t=stamp:ms,u_r=right,u_l=left,x=X,y=Y,theta=yaw",
                     "--method", "key-term-least-squares", cwd=tmp_path)  # fmt: skip
    assert found.returncode == 0, found.stderr
    assert "swapped (`--columns t=stamp:ms,u_r=left,u_l=right,x=X,y=Y,theta=yaw`)" in found.stderr


def late_log(folder, run):
    """A finished log of two runs whose poses have stamps that are late by four rows."""
    late = run._replace(**{name: np.r_[[np.nan] * 4, getattr(run, name)[:-4]] for name in ("x", "y", "theta")})
    write_log(join([late, late._replace(t=late.t + 100.0)]), folder / "late.csv")


def test_a_finished_log_is_mended(tmp_path, run):
    """The advice of `identify` is followed word for word; an offset of whole rows puts every pose back on its row."""
    late_log(tmp_path, run)
    (told,) = log_suspicions(read_log(tmp_path / "late.csv"))
    advice = re.search(r"`jaxident (convert --log LOG --pose-offset \S+ --out NEW)`", told)[1]
    words = advice.replace("LOG", "late.csv").replace("NEW", "mended.csv").split()
    assert jaxident(*words, "--period", str(PERIOD), cwd=tmp_path).returncode == 0
    for one in read_log(tmp_path / "mended.csv").runs():
        np.testing.assert_array_equal(one.x[: ROWS - 4], run.x[: ROWS - 4])
        np.testing.assert_array_equal(one.u_r, run.u_r)
    again = jaxident("convert", "--log", "mended.csv", "--out", "same.csv", cwd=tmp_path)
    assert (again.returncode, again.stderr) == (0, "")
    assert (tmp_path / "same.csv").read_bytes() == (tmp_path / "mended.csv").read_bytes()
    auto = ("--pose-offset", "auto", "--out", "auto.csv")
    found = jaxident("convert", "--log", "late.csv", *auto, cwd=tmp_path)
    offset, error = map(float, re.search(r"--pose-offset (\S+) \(standard error (\S+) s", found.stdout).groups())
    assert abs(offset + 4 * PERIOD) < 5 * error + 0.5 * PERIOD


@pytest.mark.parametrize(
    ("more", "told"),
    [
        (("--track", "0.3"), "--track is for two"),
        (("--bag", "x.bag"), "or --log LOG"),
        (("--pose-offset", "99"), "run 0: the streams do not overlap"),
    ],
)
def test_what_a_finished_log_has_no_use_for(tmp_path, run, more, told):
    late_log(tmp_path, run)
    ended = jaxident("convert", "--log", "late.csv", *more, "--out", "x.csv", cwd=tmp_path)
    assert (ended.returncode, told in ended.stderr) == (2, True)
    assert not (tmp_path / "x.csv").exists()


def test_an_offset_that_was_given_counts_in_the_advice(tmp_path, run):
    write_streams(tmp_path, run, late=LATE)
    words = ("convert", "--commands", "c.csv", "--poses", "p.csv", *OWN, "--track", str(TRACK), "--pose-offset", "0.1")
    told = jaxident(*words, "--out", "log.csv", cwd=tmp_path).stderr
    assert abs(float(re.search(r"`jaxident convert --pose-offset (\S+)`", told)[1]) + LATE) < PERIOD

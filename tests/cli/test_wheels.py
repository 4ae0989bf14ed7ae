"""Wheel speeds through the commands: made, converted, mended, refused."""

import json

import numpy as np
import pytest
from support.program import jaxident

import jaxident as ji
from jaxident.robot.drive import Physical
from jaxident.robot.wheel_sensor import WheelSensor


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a model, and a log of it with wheel speeds."""
    place = tmp_path_factory.mktemp("wheels")
    drive = Physical(np.array([3.0, 5.0]), np.array([[0.5, 0.5], [5.0, -5.0]]))
    ji.save_model(ji.Model(0.05, drive, np.zeros(2)), place / "model.json")
    words = "simulate model.json --excitation multilevel --samples 400 --noise 0.001,0.005 --wheel-noise 0.05"
    ended = jaxident(*words.split(), "--wheel-radius", "0.08", "--out", "log.csv", cwd=place)
    assert ended.returncode == 0, ended.stderr
    assert jaxident(*words.split()[:6], "--out", "plain.csv", cwd=place).returncode == 0
    return place


def test_wheel_speeds_are_simulated_with_the_track_of_the_gains(folder):
    """Steady speeds per command are 1/6 m/s and 1 rad/s: the wheels stand 1/3 m apart."""
    log = ji.read_log(folder / "log.csv")
    exact = ji.load_model(folder / "model.json")
    sensor = WheelSensor(0.08, 1.0 / 3.0, 0.0)
    true = ji.simulate(ji.Model(0.05, exact.dynamics, exact.dead_zone, wheels=sensor), log)
    assert np.std(log.wheel_r - true.wheel_r) == pytest.approx(0.05, rel=0.15)
    assert np.std(log.wheel_l - true.wheel_l) == pytest.approx(0.05, rel=0.15)
    again = "simulate", "model.json", "--inputs", "log.csv", "--out", "plain.csv"
    ended = jaxident(*again, "--wheel-noise", "0", cwd=folder)
    assert ended.returncode == 2
    assert "wheel speeds need --wheel-radius R" in ended.stderr
    assert ji.read_log(folder / "plain.csv").wheel_r is None


def test_three_streams_become_a_log_and_a_late_one_is_mended(folder):
    log = ji.read_log(folder / "log.csv")
    for name, columns in (("cmd", ("u_r", "u_l")), ("pose", ("x", "y", "theta")), ("wheel", ("wheel_r", "wheel_l"))):
        late = 0.2 if name == "wheel" else 0.0
        frame = log.to_dataframe()[["t", *columns]]
        frame.assign(t=frame.t + late).to_csv(folder / f"{name}.csv", index=False)
    streams = ("--commands", "cmd.csv", "--poses", "pose.csv", "--wheels", "wheel.csv", "--wheels-columns")
    ended = jaxident("convert", *streams, "wheel_r=wheel_r:rad/s", "--wheels-offset", "-0.2", "--period", "0.05",
                     "--out", "made.csv", cwd=folder)  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    assert "400 with a pose, 39" in ended.stdout
    made = ji.read_log(folder / "made.csv")
    both = np.isfinite(made.wheel_r)
    np.testing.assert_allclose(made.wheel_r[both], log.wheel_r[both], rtol=1e-12)
    assert jaxident("convert", *streams, "wheel_r=wheel_r", "--out", "late.csv", cwd=folder).returncode == 0
    ended = jaxident("convert", "--log", "late.csv", "--wheels-offset", "auto", "--out", "mended.csv", cwd=folder)
    assert ended.returncode == 0, ended.stderr
    assert float(ended.stdout.split("--wheels-offset ")[1].split()[0]) == pytest.approx(-0.2, abs=0.02)


def test_counts_become_speeds(folder):
    log = ji.read_log(folder / "log.csv")
    frame = log.to_dataframe()
    for name, columns in (("cmd", ["t", "u_r", "u_l"]), ("pose", ["t", "x", "y", "theta"])):
        frame[columns].to_csv(folder / f"{name}.csv", index=False)
    turned = {side: 1e4 / (2.0 * np.pi) * np.cumsum(0.05 * frame[side]) for side in ("wheel_r", "wheel_l")}
    frame.assign(**{side: np.floor(each) % 4096 for side, each in turned.items()})[["t", *turned]].to_csv(
        folder / "ticks.csv", index=False
    )
    words = ("convert", "--commands", "cmd.csv", "--poses", "pose.csv", "--wheels", "ticks.csv", "--out", "counted.csv")
    ended = jaxident(*words, "--wheel-ticks", "10000", cwd=folder)
    assert ended.returncode == 2
    assert "`--wheel-counter 4096`" in ended.stderr.replace("\n", " ")
    ended = jaxident(*words, "--wheel-ticks", "10000", "--wheel-counter", "4096", "--period", "0.05", cwd=folder)
    assert ended.returncode == 0, ended.stderr
    assert "one count more in 0.1 s is 0.00628 rad/s" in ended.stdout
    made = ji.read_log(folder / "counted.csv")
    wanted = 0.5 * (log.wheel_r[1:-1] + log.wheel_r[2:])  # each count holds the speed of the step before it
    np.testing.assert_allclose(made.wheel_r[1:-1], wanted, atol=0.0064)


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("--commands", "cmd.csv", "--poses", "pose.csv", "--wheel-ticks", "10"), "which is missing"),
        (("--commands", "cmd.csv", "--poses", "pose.csv", "--wheels", "wheel.csv", "--wheel-counter", "10"), "as well"),
        (("--wheels", "wheel.csv", "--bag", "x.mcap"), "--wheels CSV goes with --commands and --poses"),
        (("--wheels-topic", "/j", "--commands", "cmd.csv", "--poses", "pose.csv"), "are for --bag PATH"),
        (("--log", "log.csv", "--wheels", "wheel.csv"), "--wheels is for two streams"),
        (("--log", "plain.csv", "--wheels-offset", "0.1"), "the log has no wheel speeds"),
    ],
)
def test_wrong_use_is_one_line(folder, words, line):
    ended = jaxident("convert", *words, "--out", "no.csv", cwd=folder)
    assert ended.returncode == 2
    assert line in ended.stderr.replace("\n", " ")
    assert not (folder / "no.csv").exists()


def test_the_wheels_of_a_model_file_are_checked(folder):
    content = json.loads((folder / "model.json").read_text())
    assert "wheels" not in content
    for wheels, line in (({"radius": 0.0, "track": 0.3}, "wheels.radius: is 0"), ({"radius": 0.1}, "no key 'track'"),
                         ({"radius": 0.1, "track": 0.3, "gear": 2}, "unknown key 'gear'")):  # fmt: skip
        (folder / "bad.json").write_text(json.dumps(content | {"wheels": wheels}))
        with pytest.raises(ji.InputError, match=line):
            ji.load_model(folder / "bad.json")
    (folder / "good.json").write_text(json.dumps(content | {"wheels": {"radius": 0.1, "track": 0.3, "noise": None}}))
    assert ji.load_model(folder / "good.json").wheels == WheelSensor(0.1, 0.3, 0.0)


def test_motors_are_found_on_blocks_without_a_camera(folder):
    """Steady speeds per command are 1/6 m/s and 1 rad/s, rates 3 and 5 per second."""
    log = ji.read_log(folder / "log.csv")
    frame = log.to_dataframe()[["t", "u_r", "u_l", "wheel_r", "wheel_l"]]
    frame.to_csv(folder / "blocks.csv", index=False)
    words = "motors blocks.csv --wheel-radius 0.08 --wheel-track 0.333333 --out motors.json --report motors.html"
    ended = jaxident(*words.split(), "--json", "motors_result.json", cwd=folder)
    assert ended.returncode == 0, ended.stderr
    assert "rate_1" in ended.stdout
    assert "The wheels answer a command at once" in ended.stdout
    found = ji.load_model(folder / "motors.json")
    np.testing.assert_allclose(found.dynamics.rate, [3.0, 5.0], rtol=0.1)
    np.testing.assert_allclose(found.dynamics.gain, [[0.5, 0.5], [5.0, -5.0]], rtol=0.1)
    result = json.loads((folder / "motors_result.json").read_text())
    assert min(result["explained"]) > 0.99
    page = (folder / "motors.html").read_text()
    assert "The motors" in page
    assert "Commands and wheel speeds, measured and modelled" in page
    ended = jaxident("predict", "motors.json", "log.csv", "--horizon", "60", "--out", "ahead.csv", cwd=folder)
    assert ended.returncode == 0, ended.stderr
    ended = jaxident(*words.replace("blocks.csv", "plain.csv").split(), cwd=folder)
    assert (ended.returncode, "no wheel speeds" in ended.stderr) == (2, True)

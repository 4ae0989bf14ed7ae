"""Motor or ground: motors found on blocks, the ground diagnosed against them, both predicted on a run that no fit saw.

    python experiments/motor_or_ground.py --seeds 4                     # simulated robots
    python experiments/motor_or_ground.py --data DATA                   # a Husky on wet grass, DATA/husky_encoders

A simulated robot has late motors on blocks. On the ground it also loses speed in turns and slides sideways. The Husky's
runs are split in two halves, each of which is predicted by what the other one taught: by the poses alone, by both
sensors, and by a unicycle that believes its wheels.
"""

import argparse
import dataclasses
import pathlib

import jax
import numpy as np

import jaxident as ji
from jaxident.diagnosis.account.odometry import follow_wheels, sensor_by_stretches
from jaxident.estimation.increments.observations import poses_only
from jaxident.estimation.predict import predict
from jaxident.log import Log, join
from jaxident.robot.drive import Physical
from jaxident.robot.noise import Noise

SENSOR, STEP, ROWS, RUNS = ji.WheelSensor(0.03, 0.1, 0.1), 1.0 / 30.0, 500, 5
DRIVE = Physical(np.array([3.0, 5.0]), np.array([[0.9, 0.85], [14.0, -13.0]]))
MOTOR = (ji.Effect("transport_delay", {"delay": 0.06}),)
GROUND = (ji.Effect("turn_loss", {"loss": 0.3}), ji.Effect("lateral_slip", {"slip": 0.05}))
CAMERA = Noise(0.001, 0.005, slip_along=0.003, slip_heading=0.03)
RADIUS, TRACK = 0.165, 0.5708
"""Of the Husky [m], as built."""


def driven(robot: ji.Model, seed: int, rows: int = ROWS) -> Log:
    """A log whose levels last 8 to 30 rows."""
    rng = np.random.default_rng(seed)
    levels, lasting = rng.uniform(-1.0, 1.0, (rows // 8, 2)), rng.integers(8, 30, rows // 8)
    command = np.repeat(levels, lasting, axis=0)[:rows]
    made = ji.simulate(robot, ji.make_log(STEP * np.arange(rows), *command.T), key=jax.random.key(seed))
    return type(made)(*(None if column is None else np.asarray(column) for column in made))


def told(model: ji.Model, log: Log, horizon: int) -> str:
    """Root mean squares and medians of predictions, in mm and mrad."""
    error = ji.predict(model, log, horizon).error
    rms, median = (
        [1e3 * error[f"{channel}_{kind}"] for channel in ("position", "heading")] for kind in ("rms", "median")
    )
    return f"{rms[0]:.3g} mm {rms[1]:.3g} mrad (median {median[0]:.3g}, {median[1]:.3g})"


def simulated(seed: int) -> None:
    """One robot: motors on blocks, diagnosis on the ground, errors 1 s ahead on a run that no fit saw."""
    plain = ji.Model(STEP, DRIVE, np.array([0.25, 0.2]), wheels=SENSOR)
    on_blocks = driven(dataclasses.replace(plain, effects=MOTOR), 1000 * seed + 99, 900)
    ground = dataclasses.replace(plain, effects=(*MOTOR, *GROUND), noise=CAMERA)
    *logs, unseen = [driven(ground, 1000 * seed + k) for k in range(RUNS + 1)]
    motors = ji.identify_motors(on_blocks, SENSOR.radius, SENSOR.track)
    found = ji.diagnose(logs, model=motors.model)
    rms = {name: f"{1e3 * own[0]:.3g} mm {1e3 * own[1]:.3g} mrad" for name, own in found.odometry.rms.items()}
    print(f"seed {seed}: {found.verdict}, {', '.join(found.selected)}; wheels {rms['wheels']}")
    for name, model in (("motors", motors.model), ("corrected", found.corrected_model)):
        print(f"  {name}: {told(model, unseen, 30)}", flush=True)


def unicycle(fitted: Log, log: Log, horizon: int, model: ji.Model) -> str:
    """Errors of a robot that moves as its wheels turned, from where a model's predictions begin; radius and track as
    the fitted runs show them."""
    sensor = sensor_by_stretches(fitted, horizon)
    ahead, missed = predict(model, log, horizon), []
    runs = {int(run.run[0]): run for run in log.runs()}
    for k in np.flatnonzero(ahead.step == 1):
        run, begin = runs[int(ahead.run[k])], int(ahead.start[k]) + 1
        rows = slice(begin, begin + horizon)
        wheels = np.stack([run.wheel_r, run.wheel_l])[:, None, rows]
        if wheels.shape[2] < horizon:
            continue
        first = np.array([[ahead.x[k], ahead.y[k], ahead.theta[k]]])
        end = follow_wheels(sensor, np.asarray(run.t)[None, rows], wheels, first)[0, -1]
        away = np.array([column[rows][-1] for column in run.pose]) - end
        missed.append([np.hypot(away[0], away[1]), abs((away[2] + np.pi) % (2.0 * np.pi) - np.pi)])
    own = 1e3 * np.array([each for each in missed if np.isfinite(each).all()])
    rms, median = np.sqrt(np.mean(own**2, axis=0)), np.median(own, axis=0)
    return (
        f"{rms[0]:.3g} mm {rms[1]:.3g} mrad (median {median[0]:.3g}, {median[1]:.3g}), "
        f"radius {sensor.radius:.3g} m, track {sensor.track:.3g} m"
    )


def husky(data: pathlib.Path) -> None:
    """The motors on blocks; then each half of the runs on wet grass, predicted by what the other one taught."""
    folder = data / "husky_encoders"
    for path in sorted(folder.glob("wheels_in_the_air_*.csv.gz")):
        print(path.name, ji.identify_motors(str(path), RADIUS, TRACK), sep="\n")
    runs = ji.read_log(str(folder / "wet_grass.csv.gz")).runs()
    halves = [[run for k, run in enumerate(runs) if k % 2 == parity] for parity in (0, 1)]
    for fitted, unseen in (halves, halves[::-1]):
        log = join(unseen)
        motors = ji.identify_motors(fitted, RADIUS, TRACK).model
        found = {name: ji.diagnose(own) for name, own in (("poses", [poses_only(r) for r in fitted]), ("both", fitted))}
        for horizon in (20, 100):
            print(f"{len(fitted)} runs taught, {len(unseen)} predicted, {horizon / 20:g} s ahead")
            print("  motors:", told(motors, log, horizon))
            print("  wheels:", unicycle(join(fitted), log, horizon, found["both"].corrected_model))
            for name, gap in found.items():
                print(f"  {name}, nominal:", told(gap.nominal_model, log, horizon))
                print(f"  {name}, corrected ({', '.join(gap.selected) or gap.verdict}):",
                      told(gap.corrected_model, log, horizon), flush=True)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=0, help="simulated robots")
    parser.add_argument("--data", type=pathlib.Path, help="a folder with husky_encoders")
    options = parser.parse_args()
    ji.start_jax()
    for seed in range(options.seeds):
        simulated(seed)
    if options.data is not None:
        husky(options.data)


if __name__ == "__main__":
    main()

"""A robot that moves as its wheels turned, beside the models: is it the motors, or the ground?

If this robot is right where a model is wrong, the cause lies before the wheels: command, motors, load. If it is wrong
as well, the cause lies behind them: on the ground or in the camera. Nothing is assumed of either. NumPy alone.
"""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.preparation.prepare import Prepared
from jaxident.effects.coordinates import POSES_ONLY
from jaxident.estimation.suspicions.motions import increments_of
from jaxident.estimation.suspicions.wheel_answer import turns_of_wheels
from jaxident.log import Log, run_begins
from jaxident.robot.model import Model
from jaxident.robot.wheel_sensor import WheelSensor


class Odometry(NamedTuple):
    """sensor: radius and track [m] by which the wheel speeds of the rows that fit show their motion best. paths
    (starts, rows, 3): the poses that measured wheels make of each judging start, NaN where a wheel speed is missing.
    rms, median: of the errors in position [m] and heading [rad] at the end, of the `nominal` and the `corrected` model,
    of the `wheels`, and of `wheels_late` where the corrected model has a camera that reports late: the wheels as late
    as the poses; all over the same `starts`."""

    sensor: WheelSensor
    paths: Any
    rms: dict[str, tuple[float, float]]
    median: dict[str, tuple[float, float]]
    starts: int


def odometry(prepared: Prepared, paths: Array, corrected: Model) -> Odometry | None:
    """The judging stretches as the wheels tell them, each from the first pose that the corrected model predicts; paths
    (2, starts, rows, 3): those of the nominal and of the corrected model. None without wheel speeds, or where they or
    the poses never move."""
    if prepared.windows.wheels is None or not len(prepared.judging.row):
        return None
    late = sum(sum(effect.parameters.values()) for effect in corrected.effects if effect.name in POSES_ONLY)
    sensor = sensor_by_stretches(beside_poses(prepared.fitted, late), prepared.rows)
    if sensor is None:
        return None
    log, begins = prepared.log, run_begins(prepared.log)[prepared.judging.run] + prepared.judging.row
    places = begins[:, None] + np.arange(1, 1 + prepared.rows)

    def told(log: Log) -> np.ndarray:
        wheels = np.stack([log.wheel_r, log.wheel_l])[:, places]
        return follow_wheels(sensor, np.asarray(log.t)[places], wheels, paths[1][:, 0])

    own = told(log)
    measured = np.stack([np.asarray(column)[places[:, -1]] for column in log.pose], axis=-1)
    ends = {"nominal": paths[0], "corrected": paths[1], "wheels": own}
    if late:
        ends["wheels_late"] = told(beside_poses(log, late))
    missed = {name: _missed(measured, path[:, -1]) for name, path in ends.items()}
    kept = np.isfinite(np.stack(list(missed.values()))).all(axis=(0, 2))
    if not kept.any():
        return None
    rms = {name: tuple(np.sqrt(np.mean(each[kept] ** 2, axis=0)).tolist()) for name, each in missed.items()}
    median = {name: tuple(np.median(np.abs(each[kept]), axis=0).tolist()) for name, each in missed.items()}
    return Odometry(sensor, own, rms, median, int(kept.sum()))


def beside_poses(log: Log, late: float) -> Log:
    """The log with the wheel speeds that belong to its poses, where these come late [s]; interpolated, NaN beside a
    missing one."""
    if late == 0.0:
        return log
    runs = [(np.asarray(run.t), (run.wheel_r, run.wheel_l)) for run in log.runs()]
    right, left = (np.concatenate([np.interp(t - late, t, wheels[k]) for t, wheels in runs]) for k in (0, 1))
    return log._replace(wheel_r=right, wheel_l=left)


def _missed(measured: Array, pose: Array) -> np.ndarray:
    """How far poses (n, 3) are from measured ones in position [m] and heading [rad], (n, 2)."""
    away = measured - pose
    turn = (away[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    return np.stack([np.hypot(away[:, 0], away[:, 1]), turn], axis=1)


def sensor_by_stretches(log: Log, rows: int) -> WheelSensor | None:
    """Radius and track [m] by regression of how far and by how much the robot moves on how far its wheels turn
    meanwhile, both added up over stretches of some rows: over one row the camera's clock and error would rule. None
    where the wheels never turn together, or never against each other."""
    parts = [_added_up(run, rows) for run in log.runs()]
    (along, turn), (together, against) = (np.concatenate(each, axis=1) for each in zip(*parts, strict=True))
    whole, across = float(together @ together), float(against @ against)
    if not (whole > 0.0 and across > 0.0):
        return None
    radius, ratio = float(together @ along) / whole, float(against @ turn) / across
    return WheelSensor(radius, radius / ratio) if radius > 0.0 and ratio > 0.0 else None


def _added_up(run: Log, rows: int) -> tuple[np.ndarray, np.ndarray]:
    """How far the robot of a run moves and turns, and how far its wheels turn meanwhile, added up over stretches of
    rows (2, stretches); a step between two poses counts where no wheel speed is missing."""
    seen, moved = steps_of_run(run)
    turned = turns_of_wheels(np.asarray(run.t), np.stack([run.wheel_r, run.wheel_l]))
    known = np.isfinite(turned).all(axis=0)
    total = np.cumsum(np.pad(np.where(known, turned, 0.0), ((0, 0), (1, 0))), axis=1)
    holes = np.cumsum(np.append(0, ~known))
    kept = np.diff(holes[seen]) == 0
    places, count = seen[1:][kept] // rows, len(run.t) // rows + 1
    steps = moved[:, kept], np.diff(total[:, seen], axis=1)[:, kept]
    sums = [np.stack([np.bincount(places, each, count) for each in both]) for both in steps]
    return sums[0], sums[1]


def steps_of_run(run: Log) -> tuple[np.ndarray, np.ndarray]:
    """The rows (n,) of a run that have a pose, and path length [m] and turn [rad] from each to the next (2, n - 1)."""
    pose = np.stack([np.asarray(column, float) for column in run.pose])
    seen = np.flatnonzero(np.isfinite(pose).all(axis=0))
    return seen, increments_of(pose[:, seen])


def follow_wheels(sensor: WheelSensor, t: Array, speeds: Array, begin: Array) -> np.ndarray:
    """Poses (n, rows, 3) of a robot that rolls as its wheels turn at speeds (2, n, rows) [rad/s], from poses (n, 3) at
    the first row; arcs from row to row."""
    together, against = turns_of_wheels(t, speeds)
    along, turn = sensor.radius * together, sensor.radius / sensor.track * against
    theta = begin[:, 2:] + np.cumsum(turn, axis=1)
    middle = theta - 0.5 * turn
    gone = along * np.sinc(0.5 * turn / np.pi)  # the chord of an arc
    x, y = (begin[:, k, None] + np.cumsum(gone * f(middle), axis=1) for k, f in enumerate((np.cos, np.sin)))
    return np.concatenate([begin[:, None], np.stack([x, y, theta], axis=-1)], axis=1)

"""Motor or ground: a robot that moves as its wheels turned beside the models, in words and in a picture."""

import numpy as np

from jaxident import plot
from jaxident.diagnosis.account.odometry import Odometry, steps_of_run
from jaxident.diagnosis.diagnose import Diagnosis
from jaxident.estimation.suspicions.motions import increments_of
from jaxident.estimation.suspicions.wheel_answer import turns_of_wheels
from jaxident.report.page import PHONE, Figure, Section, Table
from jaxident.report.words import angle, error, length, plain_text

LEAD = 15
"""Rows before the stretch that the picture shows: what was commanded just before."""
HEADS = {"nominal": "nominal model", "corrected": "corrected model", "wheels": "as its wheels turned",
         "wheels_late": "as its wheels turned, delayed like the camera"}  # fmt: skip


def motor_or_ground(found: Diagnosis) -> list[Section]:
    """The section of a page; none for logs without wheel speeds."""
    told = found.odometry
    if told is None:
        return []
    rows = [
        (HEADS[name], length(own[0]), angle(own[1]), *(length(told.median[name][0]), angle(told.median[name][1])))
        for name, own in told.rms.items()
    ]
    caption = f"Errors {found.gap.horizon:.3g} s ahead, from the same {told.starts} places: root mean squares, medians."
    table = Table(("prediction", "position", "heading", "median position", "median heading"), rows, caption)
    text = TEXT.format(radius=length(told.sensor.radius), track=length(told.sensor.track))
    return [Section("Motor or ground", [text, *_picture(found, told), table])]


TEXT = (
    "The wheels say what the motors did; the poses say what became of it. Here a robot is taken to move exactly as its "
    "wheels turned. Its radius of {radius} and track of {track} are those that suit the fitted runs best. If this "
    "robot is right where the nominal model is wrong, the cause lies before the wheels: in the command, the motors, or "
    "the load. If it is wrong as well, the cause lies behind them: on the ground or in the camera."
)
PICTURE = (
    "The stretch on which the nominal model errs most. Where the wheels leave the model, the cause lies before the "
    "wheels. Where the robot leaves the wheels, it lies behind them."
)


def wheels_line(found: Diagnosis) -> list[str]:
    """The same as a line for terminals."""
    if found.odometry is None:
        return []
    own = found.odometry.median
    return [
        plain_text(
            f"motor or ground (median errors): {error(own['wheels'])} for a robot that moves as its wheels turned, "
            f"{error(own['nominal'])} for the nominal model"
        )
    ]


def _picture(found: Diagnosis, told: Odometry) -> list[Figure]:
    """The stretch with all wheel speeds on which the nominal model errs most."""
    errors = np.sum(np.asarray(found.gap.errors)[1], axis=1) + 0.0 * told.paths[:, -1, 0]
    if not np.isfinite(errors).any():
        return []
    worst = int(np.nanargmax(errors))
    starts, rows = found.prepared.judging, found.prepared.rows
    run, row = found.prepared.log.runs()[starts.run[worst]], int(starts.row[worst])
    own = run.rows(max(row - LEAD, 0), row + rows + 1)
    t, wheels = np.asarray(own.t), np.stack([own.wheel_r, own.wheel_l])
    rims = turns_of_wheels(t, wheels) / np.diff(t)
    rims *= np.array([[told.sensor.radius], [told.sensor.radius / told.sensor.track]])
    ahead = np.asarray(run.t)[row + 1 : row + 1 + rows]
    models = {
        HEADS[name]: (ahead[1:], _speeds(ahead, path[worst]))
        for name, path in zip(("nominal", "corrected"), found.gap.paths, strict=True)
    }
    if np.array_equal(found.gap.paths[0], found.gap.paths[1], equal_nan=True):
        del models[HEADS["corrected"]]
    figure, axes = plot.figure(3, 1, size=(PHONE, 4.6), share_x=True)
    seen, moved = steps_of_run(own)
    ground = t[seen][1:], moved / np.diff(t[seen])
    plot.wheel_speeds(ground, (t[1:], rims), (t, np.stack(own.command)), modelled=models, axes=axes)
    return [Figure(plot.image(figure), "Commands, wheels and motion of the worst stretch", PICTURE)]


def _speeds(t: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Speed and turn rate (2, rows - 1) of poses (rows, 3)."""
    return increments_of(path.T) / np.diff(t)

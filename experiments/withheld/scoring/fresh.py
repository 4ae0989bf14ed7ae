"""The shrink that a diagnosis really brings: on fresh runs of the hidden robot, without noise and without slip.

16 runs from rest, 300 rows each, at session times all over the session. The refitted nominal model and the corrected
one drive them from the same start; the error is that of the motion over the horizon, in the frame of its own first
pose, over the camera's variance. With no noise the floor is zero: shrink = 1 - corrected / nominal.
"""

import numpy as np

import jaxident as ji
from jaxident.log import Log, make_log

from ..protocol import robots
from ..protocol.cases import hidden, simulate_runs

RUNS, ROWS = 16, 301
SMALLEST = 0.01
"""Of the nominal error, in camera variances: below it there is nothing to shrink."""


def fresh_runs(answer: dict, count: int = RUNS) -> list[tuple[Log, float]]:
    """Runs (log, session time) of the hidden robot that no diagnosis has seen."""
    rng, runs = np.random.default_rng([answer["seed"], 4]), []
    for number in range(count):
        runs.append({
            "robot": answer["robot"], "effects": hidden(answer) if answer["generator"] == "batch" else {},
            "period": answer["period"], "u": robots.draw_commands(rng, ROWS), "noise": None, "rng": None,
            "start": [*rng.uniform(-0.3, 0.3, 2), rng.uniform(-np.pi, np.pi)], "slip": np.zeros((ROWS, 2)),
            "session_time": (number + 0.5) / count * answer["session"],
        })  # fmt: skip
    if answer["generator"] == "batch":
        logs = simulate_runs(runs)
    else:
        from ..engine_robot.cases import drive_run

        logs = [drive_run(answer, run) for run in runs]
    times = [run["session_time"] for run in runs]
    return [
        (make_log(log[:, 0], *np.nan_to_num(log[:, 1:3]).T, *log[:, 3:].T), t)
        for log, t in zip(logs, times, strict=True)
    ]


def true_shrink(answer: dict, nominal, corrected, horizon: float, runs=None) -> dict:
    """Errors of both models [camera variances], each the mean of the three channels, and the shrink; null where there
    is nothing to shrink."""
    runs = fresh_runs(answer) if runs is None else runs
    rows = min(max(1, round(horizon / answer["period"])), ROWS // 2)
    before, after = (
        np.mean([error(model, *run, rows, answer["noise"]) for run in runs]) for model in (nominal, corrected)
    )
    return {"before": before, "after": after, "shrink": 1.0 - after / before if before > SMALLEST else None}


def error(model, log: Log, session_time: float, rows: int, noise: dict) -> float:
    """Mean squared error of the motion over `rows` rows, in camera variances."""
    seen = np.stack(log.pose, axis=1)
    start = seen[0].copy()
    for _ in range(3):  # the pose of the robot whose reported pose is the first: camera effects move it
        replay = np.stack(drive(model, log, start, session_time), axis=1)
        start += aside(seen[0] - replay[0])
    replay = np.stack(drive(model, log, start, session_time), axis=1)
    miss = local_motion(seen, rows) - local_motion(replay, rows)
    miss[:, 2] = aside(miss[:, 2:])[:, -1]
    return float(np.mean((miss / [noise["position"], noise["position"], noise["heading"]]) ** 2))


def drive(model, log: Log, start, session_time: float):
    """Poses that a model reports under the commands of a log."""
    state = ji.State(*map(float, start), 0.0, 0.0)
    return [np.asarray(column) for column in ji.simulate(model, log, start=state, session_time=session_time).pose]


def aside(difference: np.ndarray) -> np.ndarray:
    """The last entry wrapped to half a turn."""
    wrapped = difference.copy()
    wrapped[..., -1] = np.mod(wrapped[..., -1] + np.pi, 2.0 * np.pi) - np.pi
    return wrapped


def local_motion(pose: np.ndarray, rows: int) -> np.ndarray:
    """Along, left and turn (starts, 3) over `rows` rows, in the frame of the first of them."""
    move = aside(pose[rows:] - pose[:-rows])
    cosine, sine = np.cos(pose[:-rows, 2]), np.sin(pose[:-rows, 2])
    return np.stack(
        [move[:, 0] * cosine + move[:, 1] * sine, move[:, 1] * cosine - move[:, 0] * sine, move[:, 2]], axis=1
    )

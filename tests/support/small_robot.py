"""A small simulated robot whose windows are cheap to follow: what searches are tried with."""

import numpy as np

from jaxident.diagnosis.causes.search_rounds import Found, search
from jaxident.diagnosis.fit.refit import Data, Solution, refit
from jaxident.diagnosis.motion.linear import follow
from jaxident.diagnosis.motion.windows import Windows, cut
from jaxident.diagnosis.noise.law import Law, white_whitener
from jaxident.effects.coordinates import PLACES, neutral_vector, nominal_vector
from jaxident.log import join, make_log
from jaxident.robot.drive import Physical

ROWS, RUNS, STEP = 320, 3, 0.03
LAW = Law(2e-4, 2e-3)
VECTOR = neutral_vector(
    nominal_vector(Physical(np.array([3.0, 5.0]), np.array([[0.5, 0.4], [9.0, -8.5]])), np.array([0.1, 0.12]))
)


def robot_with(sizes) -> np.ndarray:
    """Coordinates of the robot with some of its effects, {(effect, coordinate): value}."""
    vector = VECTOR.copy()
    for pair, value in sizes.items():
        vector[PLACES[pair]] = value
    return vector


def windows_of(vector, seed=0, late=0, law=LAW, faster=None, runs=RUNS) -> Windows:
    """Windows of noisy poses that the follower itself makes from whole runs, so that a fit of its form is exact; every
    fifth change of the command `late` rows, or each one at which the robot is faster than `faster` [m/s]."""
    rng = np.random.default_rng(seed)
    logs, t = [], np.arange(ROWS) * STEP
    for _ in range(runs):
        u = np.repeat(np.round(rng.uniform(-1.0, 1.0, (ROWS // 10, 2)), 3), 10, axis=0)
        logs.append(make_log(t, u[:, 0], u[:, 1], 0.0 * t, 0.0 * t, 0.0 * t))
    whole = cut(join(logs), ROWS)
    fast = np.full((runs, ROWS - 1), True)
    if faster is not None:
        fast = np.linalg.norm(np.diff(_path(vector, whole)[..., :2], axis=1), axis=2) > faster * STEP
    for row in range(10, ROWS, 10) if faster is not None else range(50, ROWS, 50):
        here = fast[:, row - 1]
        whole.command[row : row + late, here] = whole.command[row - 1, here]
    path = _path(vector, whole)
    path = path + rng.normal(size=path.shape) * [law.position, law.position, law.heading]
    poses = [log._replace(x=p[:, 0], y=p[:, 1], theta=p[:, 2]) for log, p in zip(logs, path, strict=True)]
    return cut(join(poses), 40)


def _path(vector, whole: Windows) -> np.ndarray:
    """x, y, heading (runs, ROWS, 3) of whole runs from rest."""
    runs = len(whole.run)
    return -follow(vector[None], np.zeros((1, 5, runs)), whole)[0].reshape(runs, ROWS, 3)


def likeliest_end(windows, nominal, without=()) -> Found:
    """The end of a search that has the highest log evidence: without a log behind them windows cannot be foretold."""
    return max(search(windows, nominal, without), key=lambda end: end.log_evidence)


def nominal_fit(windows, law=LAW) -> tuple[Data, Solution]:
    """The fit without effects under white noise as large as it was made, and its data."""
    data = Data(windows, white_whitener(law, windows))
    begin = np.zeros((5, len(windows.run)))
    begin[:3] = windows.pose[0].T
    return data, refit(data, VECTOR, begin, ())

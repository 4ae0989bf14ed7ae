"""How far the robot of a log went and turned, as the poses tell: what its wheels have turned by."""

import numpy as np

from jaxident.log import Log


def ways(runs: list[Log]) -> np.ndarray:
    """Way [m], backwards counted negative, and turn [rad] of the robot from the first pose of a run to each row (2,
    runs, rows); where there is none, as at the pose before. Errors of poses do not add up: two changes that follow each
    other share one."""
    found = np.zeros((2, len(runs), max(len(run.t) for run in runs)))
    for k, run in enumerate(runs):
        pose = np.stack(run.pose)
        seen = np.flatnonzero(np.isfinite(pose).all(axis=0))
        if not len(seen):
            continue
        x, y, theta = pose[:, seen]
        turn = np.cumsum((np.diff(theta, prepend=theta[0]) + np.pi) % (2.0 * np.pi) - np.pi)
        half = 0.5 * np.diff(turn, prepend=0.0)
        middle = theta[0] + turn - half
        along = np.diff(x, prepend=x[0]) * np.cos(middle) + np.diff(y, prepend=y[0]) * np.sin(middle)
        along = along / np.sinc(half / np.pi)  # an arc is longer than its chord
        last = np.maximum(np.searchsorted(seen, np.arange(found.shape[2]), side="right") - 1, 0)
        found[:, k] = np.stack([np.cumsum(along), turn])[:, last]
    return found

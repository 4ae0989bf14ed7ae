"""How far the robot of a log went and turned, as the poses tell: what its wheels have turned by."""

import numpy as np

from jaxident.array_types import Array
from jaxident.log import Log


def way_and_turn(x: Array, y: Array, theta: Array) -> tuple[np.ndarray, np.ndarray]:
    """Way [m], backwards counted negative, and turn [rad] since the first of some poses that follow each other (...,
    rows); headings may be wrapped. Between two poses the robot drives an arc, which is longer than its chord."""
    turned = (np.diff(theta, axis=-1, prepend=theta[..., :1]) + np.pi) % (2.0 * np.pi) - np.pi
    middle = theta - 0.5 * turned
    dx, dy = (np.diff(place, axis=-1, prepend=place[..., :1]) for place in (x, y))
    arc = (dx * np.cos(middle) + dy * np.sin(middle)) / np.sinc(0.5 * turned / np.pi)
    return np.cumsum(arc, axis=-1), np.cumsum(turned, axis=-1)


def ways(runs: list[Log]) -> np.ndarray:
    """`way_and_turn` of runs, from the first pose of each to every row (2, runs, rows); a row without a pose has those
    of the pose before. Errors of poses do not add up: two changes that follow each other share one."""
    found = np.zeros((2, len(runs), max(len(run.t) for run in runs)))
    for k, run in enumerate(runs):
        pose = np.stack(run.pose)
        seen = np.flatnonzero(np.isfinite(pose).all(axis=0))
        if not len(seen):
            continue
        last = np.maximum(np.searchsorted(seen, np.arange(found.shape[2]), side="right") - 1, 0)
        found[:, k] = np.stack(way_and_turn(*pose[:, seen]))[:, last]
    return found

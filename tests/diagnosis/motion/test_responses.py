"""The path of a model, bridged where the camera saw nothing."""

import numpy as np
from support.small_robot import VECTOR, windows_of

from jaxident.diagnosis.motion.responses import modelled_path


def test_what_was_not_seen_is_bridged_as_by_hand():
    """Window by window with NumPy's interpolation over the rows that were seen; before the first of them and after the
    last one the nearest stays."""
    windows, draws = windows_of(VECTOR), np.random.default_rng(0)
    seen = draws.random(windows.seen.shape) < 0.3
    seen[10] = True
    seen[:, 0] = True
    pose = np.where(seen[..., None], windows.pose + np.array([0.0, 0.0, 3.0]), np.nan)
    pose[..., 2] = (pose[..., 2] + np.pi) % (2.0 * np.pi) - np.pi
    residual = 0.01 * draws.normal(size=(pose.shape[1], 3 * len(pose)))
    found = modelled_path(residual, windows._replace(pose=pose, seen=seen))
    rows, away = np.arange(len(pose)), residual.reshape(-1, len(pose), 3)
    for window in range(pose.shape[1]):
        own = seen[:, window]
        model = (pose[:, window] - away[window])[own]
        model[:, 2] = np.unwrap(model[:, 2])
        for k in range(3):
            np.testing.assert_allclose(found[k][window], np.interp(rows, rows[own], model[:, k]), atol=1e-12)

"""What the camera reports of true poses, run by run: plain NumPy, no code of the package."""

import numpy as np

from .commands import happens

OUTSIDE = {"heading_bias": {"amplitude": 0.0, "phase": 0.0}}
"""A bias of the heading that turns with it, theta += a sin(theta - phase): a marker that is not flat."""


def report(effects, period, poses, rngs):
    """Reported poses (rows, runs, 3) but for the white error and `frozen`; rngs, one per run, for what is random."""
    seen = np.array(poses)
    for run, given in enumerate(effects):
        seen[:, run] = mapped(given, seen[:, run])
        if rngs is not None:
            seen[:, run] = disturbed(given, period[run], seen[:, run], rngs[run])
    return seen


def mapped(effects, pose):
    """The part without chance: (rows, 3)."""
    x, y, theta = pose.T
    marker = effects.get("marker_offset", {"ahead": 0.0, "left": 0.0})
    x = x + marker["ahead"] * np.cos(theta) - marker["left"] * np.sin(theta)
    y = y + marker["ahead"] * np.sin(theta) + marker["left"] * np.cos(theta)
    bias = OUTSIDE["heading_bias"] | effects.get("heading_bias", {})
    theta = theta + bias["amplitude"] * np.sin(theta - bias["phase"])
    theta = theta + effects.get("heading_offset", {}).get("offset", 0.0)
    lens = {"strength": 0.0, "centre_x": 0.0, "centre_y": 0.0, "form": 0.0} | effects.get("lens_distortion", {})
    out_x, out_y = x - lens["centre_x"], y - lens["centre_y"]
    square = out_x**2 + out_y**2
    stretch = lens["strength"] * (square**2 / lens["form"] if lens["form"] else square)
    x, y = x + stretch * out_x, y + stretch * out_y
    tilt = effects.get("camera_tilt", {"along_x": 0.0, "along_y": 0.0})
    depth = 1.0 + tilt["along_x"] * x + tilt["along_y"] * y
    half = 0.5 * effects.get("camera_scale", {}).get("difference", 0.0)
    return np.stack([x / depth * (1.0 + half), y / depth * (1.0 - half), theta], axis=1)


def disturbed(effects, period, seen, rng):
    """Correlated errors and outliers: (rows, 3)."""
    rows = len(seen)
    if "coloured_noise" in effects:
        law = {"correlation_time": 0.5, "form": 0.0} | effects["coloured_noise"]
        kept, error = np.exp(-period / law["correlation_time"]), rng.normal(size=(rows, 3)) + 0j
        turn = np.exp(2j * np.pi * law["form"] * period)  # the other form rings: a mast that sways
        if law["form"]:
            error = error + 1j * rng.normal(size=(rows, 3))
        for row in range(1, rows):
            error[row] = kept * turn * error[row - 1] + np.sqrt(1.0 - kept**2) * error[row]
        seen = seen + error.real * [law["position"], law["position"], law["heading"]]
    if "outliers" in effects:
        law = {"position": 0.05, "heading": 0.2, "form": 0.0} | effects["outliers"]
        hit = rng.random(rows) < law["probability"]
        size = np.exp(law["form"] * rng.normal(size=(rows, 1))) if law["form"] else 1.0
        error = rng.normal(size=(rows, 3)) * size
        seen = seen + hit[:, None] * error * [law["position"], law["position"], law["heading"]]
    return seen


def frozen(effects, seen, rng):
    """Reported poses (rows, 3) with late frames repeated: the last step, after the white error."""
    law = {"probability": 0.0, "form": 0.0} | effects.get("frozen_frames", {})
    if law["probability"] <= 0.0:
        return seen
    late = happens(rng, len(seen), law["probability"], law["form"])
    source = np.where(late, 0, np.arange(len(seen)))
    return seen[np.maximum.accumulate(source)]

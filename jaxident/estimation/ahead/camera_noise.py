"""The noise that a filter goes by: the model's own, or the camera's as the log shows it."""

import numpy as np

from jaxident.effects.catalogue import BY_CHANCE, CATALOGUE
from jaxident.log import Log
from jaxident.robot.model import Model
from jaxident.robot.noise import Noise

SMALLEST = 1e-7
"""Camera noise [m], [rad] that noise-free logs are weighted by: files hold little more than six decimals."""
UNKNOWN = 1e-3, 5e-3
"""Camera noise [m], [rad] where five poses in a row are nowhere seen."""


def noise_for(model: Model, log: Log) -> Noise:
    """The model's noise law with the memory that one of its effects adds; sized from the log where the model has
    none: camera error by fourth differences, no slip."""
    noise = model.noise
    if noise is None or not (float(noise.position) > 0.0 and float(noise.heading) > 0.0):
        noise = Noise(*camera_noise(log))
    for effect in model.effects:
        if effect.name == BY_CHANCE["memory"] and noise.correlation_time is None:
            own = CATALOGUE[effect.name].neutral() | effect.parameters
            position, heading = (float(np.hypot(getattr(noise, key), own[key])) for key in ("position", "heading"))
            return noise._replace(
                position=position, heading=heading, correlation_time=own["correlation_time"],
                white_position=noise.position, white_heading=noise.heading,
            )  # fmt: skip
    return noise


def camera_noise(log: Log) -> tuple[float, float]:
    """Camera error [m], [rad] by fourth differences of the poses, which motion hardly enters; the median forgives
    switches. A difference of five white errors has 70 times their variance."""
    found = []
    for column in range(3):
        changes = [_fourth(run, column) for run in log.runs()]
        change = np.concatenate(changes)
        found.append(float(np.median(np.abs(change))) / 0.6745 / np.sqrt(70.0) if change.size else np.nan)
    position, heading = float(np.hypot(found[0], found[1])) / 2.0**0.5, found[2]
    if not np.isfinite(position + heading):
        return UNKNOWN
    return max(position, SMALLEST), max(heading, SMALLEST)


def _fourth(run: Log, column: int) -> np.ndarray:
    """Fourth differences of one column over the poses that are seen."""
    values = np.asarray(run.pose[column], float)
    values = values[np.isfinite(np.stack(run.pose)).all(axis=0)]
    return np.diff(np.unwrap(values) if column == 2 else values, n=4)

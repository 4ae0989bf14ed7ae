"""The floor of the gap: what camera, start state, slip and effects of chance leave even a perfect model, and how well
that is known.

The variances come from the filter's own covariance. To first order they are linear in the variances of the noise (the
filter's gain is optimal, so that a change of it changes nothing): scaling those of the camera in one further run tells
its part from that of slip, and laws as likely as the one chosen give the spread.
"""

import dataclasses
from typing import Any, NamedTuple

import numpy as np

from jaxident.diagnosis.account.luck import luck, luck_of_chance
from jaxident.diagnosis.account.models import LOST, without
from jaxident.diagnosis.noise.law import Law, deviations
from jaxident.diagnosis.noise.variance_uncertainty import Draws
from jaxident.diagnosis.preparation.judging import CHANNELS, Judged, into_channels, judge_model
from jaxident.diagnosis.preparation.prepare import Prepared
from jaxident.diagnosis.preparation.translate import noise_of
from jaxident.effects.catalogue import BY_CHANCE, CATALOGUE
from jaxident.log import run_begins
from jaxident.robot.model import Model

LARGER = 0.01
"""Part by which the camera's variances are scaled to see what depends on them."""
RARE = 0.1
"""Share of all draws below which a memory of slip is not followed by itself."""
MEMORY = BY_CHANCE["memory"]
SQUARES = {name: each.chance.squares for name, each in CATALOGUE.items() if each.chance and each.chance.squares}
"""Expected squares that effects of chance leave on single frames."""
LATE = 4
"""Frames in a row that may be repeats of one before: five are too rare to matter."""


class Floor(NamedTuple):
    """Expected squares (starts, 3) [m^2, m^2, rad^2] by camera, start state and slip, and by each effect of chance; and
    the mean over starts and channels of their sum over the camera's variances for laws as likely as the one chosen
    (draws,); `steady`: the same for a camera alone, as if nothing slipped; `likely`: what these laws happen to leave on
    just these starts, and `lucky` what each effect of chance does."""

    camera: Any
    start: Any
    slip: Any
    chance: dict[str, Any]
    draws: Any
    steady: Any
    lucky: dict[str, Any]
    likely: Any

    @property
    def total(self) -> np.ndarray:
        """Of all parts (starts, 3)."""
        return self.camera + self.start + self.slip + sum(self.chance.values())


def floor_of(model: Model, judged: Judged, prepared: Prepared, law: Law, draws: Draws) -> Floor:
    """The floor of a model with a noise law, as it was judged; `draws` are of the law."""
    plain = dataclasses.replace(model, covariance=None, parameter_order=())
    named = {effect.name: effect.parameters for effect in model.effects}
    unit, shape = deviations(law) ** 2, judged.error.shape
    white = np.array([law.position, law.position, law.heading]) ** 2
    camera = np.broadcast_to(white if MEMORY in named else unit, shape)
    (start, slip), chance = judged.squares, _in_the_camera(named, judged, prepared)
    if MEMORY in named:
        chance[MEMORY] = np.broadcast_to(unit - white, shape)
    random = sum(float(np.mean(part / unit)) for part in chance.values())
    found, steady = _spread(plain, judged, prepared, law, draws, float(np.mean(camera / unit)))
    moved = {}
    if LOST in named:  # jolts count as slip in a filter
        other = judge_model(without(plain, {LOST}), prepared)
        moved[LOST] = np.maximum(slip - other.squares[1], 0.0)
        slip, judged = slip - moved[LOST], judged._replace(slip=other.slip)
    if MEMORY in named:  # it is in the last poses as well, from which a start is known
        moved[MEMORY] = np.maximum(start - judge_model(without(plain, {MEMORY}), prepared).squares[0], 0.0)
        start = start - moved[MEMORY]
    chance |= {name: chance.get(name, 0.0) + part for name, part in moved.items()}
    lucky = {
        name: np.mean(part / unit) * luck_of_chance(name, named[name], part / unit, prepared, len(found))
        for name, part in chance.items()
    }
    calm = found - sum(float(np.mean(part / unit)) for part in moved.values())
    likely = calm * luck(judged, camera, unit, len(found)) + sum(lucky.values())
    return Floor(camera, start, slip, chance, found + random, steady + random, lucky, likely)


def _spread(
    model: Model, judged: Judged, prepared: Prepared, law: Law, draws: Draws, camera: float
) -> tuple[np.ndarray, np.ndarray]:
    """Means (draws,) over the camera's variances of what camera, start and slip leave, and of what the camera alone
    does, for each law drawn; camera: its own part as chosen."""
    unit, count = deviations(law) ** 2, draws.deviations.shape[1]
    whole, larger = np.mean(sum(judged.squares), axis=0), _variances(model, prepared, law, 1.0 + LARGER)
    by_camera = np.clip((larger - whole) / LARGER / np.maximum(whole, 1e-300), 0.0, 1.0)
    found, steady = np.zeros(count), np.zeros(count)
    for here in _by_memory(draws):
        own = draws.deviations[:, here] ** 2
        middle = np.sqrt(own.mean(axis=1))
        time = None if draws.slip_time is None else float(np.median(draws.slip_time[here]))
        slip = None if time is None else (middle[2], middle[3])
        coloured = None if law.coloured is None else (middle[-2], middle[-1])
        one = Law(middle[0], middle[1], slip, time, coloured, law.coloured_time)
        whole = _variances(model, prepared, one)
        seen_by = own[:2] if law.coloured is None else own[:2] + own[-2:]
        flat = (seen_by / seen_by.mean(axis=1, keepdims=True))[[0, 0, 1]]
        slid = flat if time is None else (own / middle[:, None] ** 2)[[2, 3, 3]]
        steady[here] = (camera + by_camera * whole / unit) @ flat / len(CHANNELS)
        found[here] = steady[here] + ((1.0 - by_camera) * whole / unit) @ slid / len(CHANNELS)
    return found, steady


def _by_memory(draws: Draws) -> list[np.ndarray]:
    """Draws, boolean (draws,), of each memory of slip; rare ones go with the nearest."""
    if draws.slip_time is None:
        return [np.ones(draws.deviations.shape[1], bool)]
    times, counts = np.unique(draws.slip_time, return_counts=True)
    often = times[counts > RARE * counts.sum()]
    nearest = often[np.argmin(np.abs(np.log(draws.slip_time[:, None] / often)), axis=1)]
    return [nearest == time for time in often]


def _variances(model: Model, prepared: Prepared, law: Law, scale: float = 1.0) -> np.ndarray:
    """Mean expected squares (3,) by start and slip under a law whose camera's variances are scaled."""
    apart = any(effect.name == MEMORY for effect in model.effects)
    noise, root = noise_of(law, apart), scale**0.5
    camera = ("position", "heading", "white_position", "white_heading")
    larger = {key: root * getattr(noise, key) for key in camera if getattr(noise, key) is not None}
    noise = noise._replace(**larger)
    judged = judge_model(dataclasses.replace(model, noise=noise), prepared)
    return np.mean(sum(judged.squares), axis=0)


def _in_the_camera(named: dict, judged: Judged, prepared: Prepared) -> dict[str, np.ndarray]:
    """Expected squares (starts, 3) of effects of chance that act on single frames."""
    own = {name: values for name, values in named.items() if name in SQUARES}
    if not own:
        return {}
    path, starts = judged.path, prepared.judging
    heading = np.asarray(prepared.log.theta)[run_begins(prepared.log)[starts.run] + starts.row + prepared.rows]
    late = [(path[:, -1] - path[:, max(-1 - k, -path.shape[1])]) for k in range(1, LATE + 1)]
    turned = [(into_channels(heading) @ part[..., None])[..., 0] for part in late]
    return {name: np.asarray(SQUARES[name](turned, **values)) for name, values in own.items()}

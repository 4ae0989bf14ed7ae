"""How well a law is known: laws as likely as the residuals leave them, drawn for replays.

The memory of slip is known worst, and two memories that fit windows alike foretell other errors at their ends: 0.2 s
in place of 0.28 s leaves a tenth to a third of the floor out. So it is sized over a grid of memories, each as likely as
its restricted likelihood says (a flat prior in its logarithm), and the variances are drawn about the best of each.
"""

from typing import NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.noise.law import Law, variances_of
from jaxident.diagnosis.noise.likelihood import Amounts, Sample, Sized, amounts_of, likeliest, likelihood, structure_of
from jaxident.diagnosis.noise.sizing import size_one

MEMORIES = tuple(np.geomspace(0.025, 1.6, 11).tolist())
"""Correlation times of slip [s] that are looked at, a factor of 1.5 apart."""
SMALLEST = 1e-3
"""Share of all likelihood below which a memory is not drawn."""


class Draws(NamedTuple):
    """Laws drawn: deviations (variances, draws), of the camera in position and heading, of slip and of the camera's
    memory as far as there are; correlation time of slip (draws,) and that of the camera, None without."""

    deviations: Array
    slip_time: Array | None
    coloured_time: float | None

    def less_slip(self, factor: float) -> "Draws":
        """The same laws with a part of their slip's variances."""
        deviations = np.array(self.deviations)
        deviations[2:4] *= factor**0.5
        return self._replace(deviations=deviations)


def sizes_by_memory(law: Law, given: Sample) -> list[Sized]:
    """The law sized again for each memory of slip; itself alone without slip."""
    if law.slip is None:
        return [Sized(law, 0.0, Amounts(()))]
    own = size_one(given, law, law.slip_time, law.coloured_time)
    rival = own.log_likelihood + np.log(SMALLEST)
    return [likeliest(given, structure_of(given, time, law.coloured_time), own.amounts, rival) for time in MEMORIES]


def draw_laws(sizes: list[Sized], given: Sample, count: int, seed: int = 0) -> Draws:
    """As many laws as asked for, of one structure, each as often as it is likely."""
    rng = np.random.default_rng([seed, 1])  # apart from that of the replays
    logs = np.array([sized.log_likelihood for sized in sizes])
    weights = np.exp(logs - logs.max())
    weights = np.where(weights < SMALLEST * weights.sum(), 0.0, weights)
    picks = rng.choice(len(sizes), count, p=weights / weights.sum())
    variances = len(variances_of(sizes[0].law))
    deviations, unit = np.zeros((variances, count)), rng.normal(size=(variances, count))
    for k in np.unique(picks):
        spread = np.linalg.cholesky(doubt_of(sizes[k].law, given)) @ unit[:, picks == k]
        deviations[:, picks == k] = np.sqrt(variances_of(sizes[k].law))[:, None] * np.exp(0.5 * spread)
    times = [sized.law.slip_time for sized in sizes]
    return Draws(deviations, None if times[0] is None else np.array(times)[picks], sizes[0].law.coloured_time)


def doubt_of(law: Law, given: Sample) -> np.ndarray:
    """Covariance (variances, variances) of the logarithms of a law's variances, by average information; no variance is
    known worse than by a factor of about e."""
    structure = structure_of(given, law.slip_time, law.coloured_time)
    amounts = np.concatenate(amounts_of(law, structure))
    curve = likelihood(given, structure.parts, amounts)[2]
    return np.linalg.inv(amounts[:, None] * curve * amounts + np.eye(len(amounts)))

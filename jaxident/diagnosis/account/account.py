"""The account: who causes how many millimetres of the refitted nominal model's error on runs kept for judging.

The mean squared error at the horizon is split into camera, start state, slip, every named effect and a rest. The share
of an effect is its Shapley value (Shapley 1953): what adding it to the model takes away from the error, averaged over
all orders of adding. A model with some of the effects has them at the size that all together were found with, and its
nominal parameters refitted on the runs that fit: to first order that is what the robot's error would lose if the effect
were switched off.
"""

from typing import NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.account.floor import Floor
from jaxident.diagnosis.account.shapley import shapley
from jaxident.diagnosis.account.shrink import HIGH, LOW, blocks
from jaxident.diagnosis.preparation.judging import CHANNELS
from jaxident.effects.catalogue import CATALOGUE

BEFORE, AFTER, UNNAMED = "before_wheel", "after_wheel", "unnamed"
CAMERA, START, SLIP, DISCOVERED, REST = "camera", "start", "slip", "discovered", "rest"
PLACES = {
    "actuation": BEFORE, "drive": BEFORE, "time": BEFORE, "contact": AFTER, CAMERA: CAMERA, START: START, SLIP: AFTER,
    DISCOVERED: UNNAMED, REST: UNNAMED,
}  # fmt: skip
"""Where each site of effects, and each other part, lies: command, motors, drive and load move the wheel; the ground and
random slip come after it."""


class Row(NamedTuple):
    """One part of the error: rms_position [m] and rms_heading [rad], negative where the part's mean square is; its
    share of the mean over channels of squares over the camera's variance, with a 90 % interval; that of each channel.
    """

    part: str
    rms_position: float
    rms_heading: float
    share: float
    interval: tuple[float, float]
    channels: dict[str, float]


class Account(NamedTuple):
    """Rows in the order camera, start, slip, effects, discovered, rest, whose shares add up to one, over the horizon
    [s] from so many starts; `failed`: starts from which some model's prediction is not finite, which count in none."""

    horizon: float
    windows: int
    failed: int
    rows: list[Row]

    def share(self, *parts: str) -> float:
        """Of some parts together."""
        return sum(row.share for row in self.rows if row.part in parts)

    @property
    def places(self) -> dict[str, float]:
        """Shares by place: motors and load before the wheel, ground and random slip after it, camera, start, and what
        has no name. They add up to one; empty without rows."""
        found = dict.fromkeys((BEFORE, AFTER, CAMERA, START, UNNAMED), 0.0) if self.rows else {}
        for row in self.rows:
            found[PLACES[CATALOGUE[row.part].site if row.part in CATALOGUE else row.part]] += row.share
        return found

    @property
    def named(self) -> tuple[str, ...]:
        """The effects that have a row."""
        return tuple(row.part for row in self.rows if row.part not in (CAMERA, START, SLIP, DISCOVERED, REST))


def account_of(
    horizon: float,
    errors: dict[frozenset[str], Array],
    players: tuple[str, ...],
    floor: Floor,
    unit: Array,
    seed: int = 0,
    discovered: Array | None = None,
) -> Account:
    """The account from errors (starts, 3) of the model with each set of players, and the floor of that with all of
    them; unit (3,): the camera's variances; discovered (starts, 3): errors of the model that has discovered laws as
    well, if any."""
    last = errors[frozenset(players)] if discovered is None else discovered
    kept = np.all([np.isfinite(error).all(axis=1) for error in (*errors.values(), last)], axis=0)
    squares = {joined: error[kept] ** 2 for joined, error in errors.items()}
    total, left = squares[frozenset()], squares[frozenset(players)]
    parts = {CAMERA: floor.camera[kept], START: floor.start[kept], SLIP: floor.slip[kept]}
    named = shapley(players, lambda joined: squares[joined])
    for name in dict.fromkeys((*players, *floor.chance)):
        parts[name] = named.get(name, np.zeros_like(total))
    parts[DISCOVERED] = left - last[kept] ** 2
    parts[REST] = last[kept] ** 2 - floor.total[kept]
    rows = _rows(parts, total, unit, floor, kept, seed) if kept.any() else []
    return Account(horizon, int(kept.sum()), int(np.sum(~kept)), rows)


def _rows(parts: dict[str, Array], total: Array, unit: Array, floor: Floor, kept: Array, seed: int) -> list[Row]:
    """One row per part; intervals by resampled starts, by laws of noise as likely as the one chosen, and by what chance
    may have done."""
    picks = blocks(np.random.default_rng(seed), len(total), len(floor.draws))
    whole, drawn = np.mean(total / unit), np.mean(total / unit, axis=1)[picks].mean(axis=1)
    slipping = floor.draws - floor.steady
    rows = []
    for name, part in parts.items():
        mean = np.mean(part, axis=0)
        spread = np.mean(part / unit, axis=1)[picks].mean(axis=1)
        if name in floor.chance:
            mean, spread = mean + np.mean(floor.chance[name][kept], axis=0), spread + floor.lucky[name]
        elif name == REST:
            spread = spread - (floor.draws - np.mean(floor.draws))
        elif name in (CAMERA, START):
            spread = spread * floor.steady / float(np.mean(floor.steady))
        elif name == SLIP and np.mean(slipping) > 0.0:
            spread = spread * slipping / float(np.mean(slipping))
        share = float(np.mean(mean / unit) / whole)
        low, high = np.quantile(spread / drawn, [LOW, HIGH])
        channels = mean / unit
        size = channels.sum() if abs(channels.sum()) > 0.0 else 1.0
        rows.append(Row(
            name, _root(mean[0] + mean[1]), _root(mean[2]), share, (min(float(low), share), max(float(high), share)),
            dict(zip(CHANNELS, (channels / size).tolist(), strict=True)),
        ))  # fmt: skip
    return rows


def _root(square: float) -> float:
    """The root of a mean square, with its sign."""
    return float(np.sign(square) * np.sqrt(abs(square)))

"""Discovered laws as arrays of one shape, so that every set of them runs through the same compiled program."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.effects.law_kinds import (
    ACTS,
    ALONG,
    MOST_KNOTS,
    MOST_LAWS,
    MOST_SURFACE_KNOTS,
    SIGNALS,
    TIMES,
    scaled,
)
from jaxident.robot.model import Discovered


class Laws(NamedTuple):
    """Some laws as arrays: places in ACTS, TIMES and SIGNALS (laws,), knots (laws, knots) and (laws, second knots), and
    values there (laws, knots, second knots). Without surfaces there is one second knot; a curve beside a surface has
    the same values at all of them. per_way (laws, 2): how far the wheel of a law turns per metre of the robot's way
    [rad/m] and per radian of its turn, 0 where the wheel's angle does not matter; phase (laws, n) [rad]: its angle at
    the beginning of each of n runs or windows, or (laws, 1) if all begin alike; sure, of the same shape: the part that
    is added of what such a law says, below 1 where the angle is uncertain."""

    act: Any
    times: Any
    signal: Any
    second: Any
    at: Any
    second_at: Any
    value: Any
    per_way: Any
    phase: Any
    sure: Any


IDLE = Discovered(ALONG, "1", "v", np.arange(2.0), np.zeros(2))
"""A law that does nothing: that of a robot without any in a program that runs laws."""


def laws_of(laws: Sequence[Discovered], largest: float = 1.0, surfaces: bool | None = None) -> Laws | None:
    """Laws as arrays, for commands over `largest`, filled up with some that do nothing; None of none. surfaces: whether
    there is room for surfaces; by default, whether one of the laws is one."""
    if not laws:
        return None
    laws = [*(scaled(law, 1.0 / largest) for law in laws), *[IDLE] * (MOST_LAWS - len(laws))]
    wide = any(law.second_signal for law in laws) if surfaces is None else surfaces
    names = list(SIGNALS)
    codes = [(list(ACTS).index(law.acts_on), list(TIMES).index(law.times), names.index(law.signal),
              names.index(law.second_signal or law.signal)) for law in laws]  # fmt: skip
    rows = [_padded(law, MOST_SURFACE_KNOTS if wide else 1) for law in laws]
    turn = [(0.0, 0.0) if law.period is None else np.array([1.0, law.half_track]) * 2.0 * np.pi / law.period
            for law in laws]  # fmt: skip
    act, times, signal, other = np.array(codes).T
    at, second_at, value = (np.stack(column) for column in zip(*rows, strict=True))
    return Laws(act, times, signal, other, at, second_at, value, np.array(turn), np.zeros((MOST_LAWS, 1)),
                np.ones((MOST_LAWS, 1)))  # fmt: skip


def acting(laws: Laws | None) -> int:
    """How many laws there are, those that only fill up left out."""
    return 0 if laws is None else int(np.max(np.flatnonzero(np.any(laws.value != 0.0, axis=(1, 2))), initial=-1)) + 1


def joined(laws: Laws | None, more: Laws) -> Laws:
    """Some laws and some more, MOST_LAWS at most; phase and sure of both for the same runs or windows."""
    if laws is None:
        return more
    second = max(laws.second_at.shape[1], more.second_at.shape[1])
    first, then = (_with_second(part, second) for part in (laws, more))
    count = acting(laws)
    return Laws(*(np.concatenate([one[:count], other])[:MOST_LAWS] for one, other in zip(first, then, strict=True)))


def _with_second(laws: Laws, second: int) -> Laws:
    """Laws with so many second knots, at which curves have the same values."""
    missing = second - laws.second_at.shape[1]
    second_at = np.stack([_longer(row, missing) for row in laws.second_at])
    value = np.pad(laws.value, [(0, 0), (0, 0), (0, missing)], mode="edge")
    return laws._replace(second_at=second_at, value=value)


def _padded(law: Discovered, second: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """MOST_KNOTS knots, so many second knots, and values (knots, second knots), the last repeated beyond the last."""
    at, second_at = np.asarray(law.at), np.arange(1.0) if law.second_at is None else np.asarray(law.second_at)
    value = np.asarray(law.value).reshape(len(at), len(second_at))
    more = (MOST_KNOTS - len(at), second - len(second_at))
    return _longer(at, more[0]), _longer(second_at, more[1]), np.pad(value, [(0, n) for n in more], mode="edge")


def _longer(at: Array, more: int) -> np.ndarray:
    """Knots with some more beyond the last."""
    return np.concatenate([at, at[-1] + (1.0 + np.arange(more)) * (np.ptp(at) or 1.0)])

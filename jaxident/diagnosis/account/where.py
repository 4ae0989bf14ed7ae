"""Where the gap lies: excess error by channel and over what the robot was doing, with false-discovery control."""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.preparation.judging import CHANNELS
from jaxident.diagnosis.preparation.prepare import Prepared
from jaxident.log import run_begins

OF_COMMANDS = ("u_r", "u_l", "|u|", "largest |u|")
"""Variables in commands over their largest."""
BINS = 4
SHUFFLES = 2000
DISCOVERIES = 0.05
"""Share of false regions allowed among those reported (Benjamini and Hochberg 1995)."""


class Region(NamedTuple):
    """A part of a variable's range in which the excess error is larger than elsewhere: its share of all excess, and the
    probability of such a mean by chance, adjusted for all regions looked at."""

    variable: str
    low: float
    high: float
    share: float
    p_value: float


class Place(NamedTuple):
    """excess: shares of the nominal model's error beyond the floor by channel. channels: shares of what the selected
    effects move; of the excess where there are none. regions: largest share first. table, the map: for each variable
    the bins' edges and the mean excess in each."""

    channels: dict[str, float]
    excess: dict[str, float]
    regions: list[Region]
    table: dict[str, tuple[Any, Any]]


def locate(
    errors: Array, floor: Array, path: Array, prepared: Prepared, moved: Array | None = None, seed: int = 0
) -> Place:
    """From the nominal model's squared errors and their floor (starts, 3) at the horizon, the best one's predicted
    poses (starts, rows, 3), and the squares that its effects move (starts, 3), None without effects."""
    kept = np.isfinite(errors).all(axis=1)
    if not kept.any():
        nothing = dict.fromkeys(CHANNELS, 0.0)
        return Place(nothing, nothing, [], {})
    excess = (errors - floor)[kept]
    variables = {name: value[kept] for name, value in describe(path, prepared).items()}
    beyond = _shares(excess)
    acting = beyond if moved is None else _shares(moved[kept])
    return Place(acting, beyond, *_regions(excess.mean(axis=1), variables, seed))


def _shares(squares: Array) -> dict[str, float]:
    """Of each channel in the mean of squares (windows, 3); zero where nothing is left."""
    total = np.maximum(squares.mean(axis=0), 0.0)
    share = total / total.sum() if total.sum() > 0.0 else np.zeros(len(CHANNELS))
    return dict(zip(CHANNELS, share.tolist(), strict=True))


def increments(path: Any) -> np.ndarray:
    """Movement of a path (three of (windows, rows)) along, sideways and in heading (3, windows, rows - 1) from row to
    row, as the robot's own heading half-way sees it."""
    dx, dy, turned = (np.diff(column, axis=1) for column in path)
    direction = path[2][:, :-1] + 0.5 * turned
    sine, cosine = np.sin(direction), np.cos(direction)
    return np.stack([cosine * dx + sine * dy, -sine * dx + cosine * dy, turned])


def describe(path: Array, prepared: Prepared) -> dict[str, np.ndarray]:
    """What the robot did from each judging start to the horizon (starts,): levels, speeds, reversals, rest, heading,
    position, time; path: predicted poses (starts, rows, 3)."""
    log, starts, runs = prepared.log, prepared.judging, prepared.log.runs()
    places = run_begins(log)[starts.run][:, None] + starts.row[:, None] + np.arange(prepared.rows)
    u = np.nan_to_num(np.stack(log.command, axis=-1))[places] / prepared.largest
    x, y, theta = np.moveaxis(path, 2, 0)
    along, _, turned = increments((x, y, theta))
    step = np.diff(np.asarray(log.t)[places], axis=1)
    v, w = along / step, turned / step
    passed = np.concatenate([[0.0], np.cumsum([run.t[-1] - run.t[0] for run in runs])])
    time = passed[starts.run] + np.asarray(log.t)[places[:, 0]] - np.array([run.t[0] for run in runs])[starts.run]
    return {
        "u_r": u[..., 0].mean(axis=1), "u_l": u[..., 1].mean(axis=1),
        "|u|": np.abs(u).mean(axis=(1, 2)), "largest |u|": np.abs(u).max(axis=(1, 2)),
        "v": v.mean(axis=1), "w": w.mean(axis=1), "|v|": np.abs(v).mean(axis=1), "|w|": np.abs(w).mean(axis=1),
        "v w": (v * w).mean(axis=1), "w^2": (w * w).mean(axis=1),
        "reversals": (np.diff(np.sign(u), axis=1) != 0).sum(axis=(1, 2)).astype(float),
        "rest": np.mean(np.abs(u) < 0.05, axis=(1, 2)),
        "heading": np.arctan2(np.sin(theta), np.cos(theta))[:, -1], "x": x.mean(axis=1), "y": y.mean(axis=1),
        "session time": time,
    }  # fmt: skip


def _regions(excess: Array, variables: dict[str, np.ndarray], seed: int = 0) -> tuple[list[Region], dict]:
    """Bins of each variable by its quantiles, tested by shuffling the excess over windows."""
    rng = np.random.default_rng(seed)
    shuffled = np.stack([rng.permutation(excess) for _ in range(SHUFFLES)])
    whole = float(np.sum(np.maximum(excess, 0.0)))  # 0 where the floor is above every error
    found, table = [], {}
    for name, value in variables.items():
        edges = np.unique(np.quantile(value, np.linspace(0.0, 1.0, BINS + 1)))
        if len(edges) < 3:
            continue
        bins = np.clip(np.searchsorted(edges, value, side="right") - 1, 0, len(edges) - 2)
        members = bins == np.arange(len(edges) - 1)[:, None]
        counts = np.maximum(members.sum(axis=1), 1)
        means = members @ excess / counts
        chance = (1.0 + np.sum(shuffled @ members.T / counts >= means - 1e-12, axis=0)) / (1.0 + SHUFFLES)
        share = members @ excess / whole if whole > 0.0 else 0.0 * means
        table[name] = edges, means
        found += [
            Region(name, float(edges[k]), float(edges[k + 1]), float(share[k]), float(chance[k]))
            for k in range(len(counts))
        ]
    return _discoveries(found), table


def _discoveries(regions: list[Region]) -> list[Region]:
    """Those that stand at the false-discovery rate, with adjusted probabilities."""
    order = sorted(regions, key=lambda region: -region.p_value)
    lowest, kept = 1.0, []
    for rank, region in zip(range(len(order), 0, -1), order, strict=True):
        lowest = min(lowest, region.p_value * len(order) / rank)
        if lowest <= DISCOVERIES and region.share > 0.0:
            kept.append(region._replace(p_value=lowest))
    return sorted(kept, key=lambda region: -region.share)

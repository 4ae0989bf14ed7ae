"""Where the gap lies: excess error by channel and over what the robot was doing, with false-discovery control."""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.extent.gap import CHANNELS
from jaxident.diagnosis.motion.responses import modelled_path
from jaxident.diagnosis.motion.windows import Windows

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
    errors: Array, floor: Array, residual: Array, windows: Windows, moved: Array | None = None, seed: int = 0
) -> Place:
    """From the nominal model's squared errors and their floor (windows, 3) at the horizon, the residuals (windows,
    numbers) of the best one, and the squares that its effects move (windows, 3), None without effects."""
    kept = np.isfinite(errors).all(axis=1)
    excess = (errors - floor)[kept]
    variables = {name: value[kept] for name, value in describe(residual, windows).items()}
    beyond = _shares(excess)
    acting = beyond if moved is None else _shares(moved[kept])
    return Place(acting, beyond, *_regions(excess.mean(axis=1), variables, seed))


def _shares(squares: Array) -> dict[str, float]:
    """Of each channel in the mean of squares (windows, 3); zero where nothing is left."""
    total = np.maximum(squares.mean(axis=0), 0.0)
    share = total / total.sum() if total.sum() > 0.0 else np.zeros(len(CHANNELS))
    return dict(zip(CHANNELS, share.tolist(), strict=True))


def increments(path: tuple[Array, Array, Array]) -> np.ndarray:
    """Movement of a path (three of (windows, rows)) along, sideways and in heading (3, windows, rows - 1) from row to
    row, as the robot's own heading half-way sees it."""
    dx, dy, turned = (np.diff(column, axis=1) for column in path)
    direction = path[2][:, :-1] + 0.5 * turned
    sine, cosine = np.sin(direction), np.cos(direction)
    return np.stack([cosine * dx + sine * dy, -sine * dx + cosine * dy, turned])


def describe(residual: Array, windows: Windows) -> dict[str, np.ndarray]:
    """What the robot did in each window (windows,): levels, speeds, reversals, rest, heading, position, time."""
    x, y, theta = path = modelled_path(residual, windows)
    step = np.asarray(windows.step).T
    rows = np.arange(step.shape[1])
    along, _, turned = increments(path)
    v, w = along / step[:, :-1], turned / step[:, :-1]
    places = np.minimum(windows.first + rows[:, None], len(windows.command) - 1)
    u = np.asarray(windows.command)[places, windows.run]
    return {
        "u_r": u[..., 0].mean(axis=0), "u_l": u[..., 1].mean(axis=0),
        "|u|": np.abs(u).mean(axis=(0, 2)), "largest |u|": np.abs(u).max(axis=(0, 2)),
        "v": v.mean(axis=1), "w": w.mean(axis=1), "|v|": np.abs(v).mean(axis=1), "|w|": np.abs(w).mean(axis=1),
        "v w": (v * w).mean(axis=1), "w^2": (w * w).mean(axis=1),
        "reversals": (np.diff(np.sign(u), axis=0) != 0).sum(axis=(0, 2)).astype(float),
        "rest": np.mean(np.abs(u) < 0.05, axis=(0, 2)),
        "heading": np.arctan2(np.sin(theta), np.cos(theta))[:, -1], "x": x.mean(axis=1), "y": y.mean(axis=1),
        "session time": windows.session[windows.run] + windows.t[windows.first, windows.run],
    }  # fmt: skip


def _regions(excess: Array, variables: dict[str, np.ndarray], seed: int = 0) -> tuple[list[Region], dict]:
    """Bins of each variable by its quantiles, tested by shuffling the excess over windows."""
    rng = np.random.default_rng(seed)
    shuffled = np.stack([rng.permutation(excess) for _ in range(SHUFFLES)])
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
        share = members @ excess / max(float(np.sum(np.maximum(excess, 0.0))), 1e-300)
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
